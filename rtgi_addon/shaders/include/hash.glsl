// Well-mixed integers (numerics/sampling.py, hash_u32): begin with HASH_START and take in one value after the other.

#define HASH_START 0x9E3779B9u

uint hash_with(uint state, uint value)
{
  uint x = state * 0x01000193u + value;
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}
