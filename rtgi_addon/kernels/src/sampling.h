/* Twins of numerics/sampling.py: the same integers, and the same floats but for the last bit of sines and cosines. */

#ifndef RTGI_SAMPLING_H
#define RTGI_SAMPLING_H

#include "rtgi.h"

static inline uint32_t lowbias32(uint32_t x)
{
  x ^= x >> 16;
  x *= 0x7FEB352Du;
  x ^= x >> 15;
  x *= 0x846CA68Bu;
  return x ^ (x >> 16);
}

static inline uint32_t hash_next(uint32_t state, uint32_t value)
{
  return lowbias32(state * 0x01000193u + value);
}

#define HASH_START 0x9E3779B9u

static inline uint32_t reversed_bits(uint32_t x)
{
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0F0F0F0Fu) | ((x & 0x0F0F0F0Fu) << 4);
  x = ((x >> 8) & 0x00FF00FFu) | ((x & 0x00FF00FFu) << 8);
  return (x >> 16) | (x << 16);
}

static inline uint32_t owen_of_reversed(uint32_t x, uint32_t seed)
{
  x ^= x * 0x3D20ADEAu;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526C56u;
  x ^= x * 0x53A22864u;
  return x;
}

static inline float unit_interval(uint32_t x)
{
  return (float)(x >> 8) * 0x1p-24f;
}

static inline float wrapped(float x)
{
  return x - floorf(x);
}

static inline void disk_from_square(float u0, float u1, float *x, float *y)
{
  float a = 2.0f * u0 - 1.0f, b = 2.0f * u1 - 1.0f;
  int wide = fabsf(a) > fabsf(b);
  float radius = wide ? a : b;
  float ratio = (wide ? b : a) / (radius == 0.0f ? 1.0f : radius);
  float angle = (float)(3.14159265358979323846 / 4.0) * ratio;
  float cosine = cosf(angle), sine = sinf(angle);
  *x = (wide ? cosine : sine) * radius;
  *y = (wide ? sine : cosine) * radius;
}

/* Malley's: density cosine/pi about +z. */
static inline Vec cosine_hemisphere(float u0, float u1)
{
  Vec local;
  disk_from_square(u0, u1, &local.x, &local.y);
  local.z = sqrtf(largest(0.0f, 1.0f - (local.x * local.x + local.y * local.y)));
  return local;
}

static inline void frame(Vec n, Vec *tangent, Vec *bitangent)
{
  float sign = copysignf(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  *tangent = (Vec){1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *bitangent = (Vec){b, sign + n.y * n.y * a, -n.y};
}

static inline Vec about(Vec normal, Vec local)
{
  Vec tangent, bitangent;
  frame(normal, &tangent, &bitangent);
  return add(add(mul(tangent, local.x), mul(bitangent, local.y)), mul(normal, local.z));
}

#endif
