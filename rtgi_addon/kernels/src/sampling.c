/* Low-discrepancy numbers: twin of sobol_owen_at in numerics/sampling.py. */

#include "sampling.h"

/* Dimensions first … last - 1 of points index[i] of the sequences with seed[i], for i < n: out (n, last - first). tables:
   (dimensions, 4, 256) uint32, as sobol_tables has them. */
EXPORT void KERNEL(sobol_owen)(const uint32_t *tables, int32_t dimensions, int64_t n, const uint32_t *index, const uint32_t *seed,
                               int32_t first, int32_t last, float *out)
{
  WITHIN(last - 1, dimensions);
  for (int32_t d = first; d < last; d++) {
    const uint32_t *table = tables + (int64_t)d * 4 * 256;
    for (int64_t i = 0; i < n; i++) {
      uint32_t k = index[i];
      uint32_t bits = table[k & 255] ^ table[256 + ((k >> 8) & 255)] ^ table[512 + ((k >> 16) & 255)] ^ table[768 + (k >> 24)];
      uint32_t scramble = hash_next(hash_next(HASH_START, seed[i]), (uint32_t)(d + 1));
      out[i * (last - first) + d - first] = unit_interval(reversed_bits(owen_of_reversed(bits, scramble)));
    }
  }
}

/* Numbers (g * n, d) of directions as rays of several probes have them, shifted on the torus: out (h, d) for the rays rows (h,),
   of which m follow one another for each direction; shifts (p, d) of probes, probe (g, m). Twin of Gatherer.shifted. */
EXPORT void KERNEL(shifted)(int64_t h, const int32_t *rows, int64_t g, int64_t n, int64_t m, const float *numbers, int32_t d,
                            const int64_t *probes, int64_t p, const float *shifts, float *out)
{
  for (int64_t i = 0; i < h; i++) {
    int64_t ray = rows[i], direction = ray / m, block = direction / n;
    WITHIN(ray, g * n * m);
    int64_t probe = probes[block * m + ray % m];
    WITHIN(probe, p);
    for (int32_t k = 0; k < d; k++) {
      out[i * d + k] = wrapped(numbers[direction * d + k] + shifts[probe * d + k]);
    }
  }
}
