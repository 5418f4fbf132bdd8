/* Directions: twins of texel_index in numerics/octahedral.py and of evaluate in numerics/sh.py. */

#include "rtgi.h"

/* Flat texel index (n,) in octahedral tiles of a resolution. */
EXPORT void KERNEL(octahedral_cells)(int64_t n, const float *directions, int32_t resolution, int32_t *cell)
{
  float half = 0.5f * (float)resolution;
  for (int64_t i = 0; i < n; i++) {
    Vec d = load(directions, i);
    float sum = fabsf(d.x) + fabsf(d.y) + fabsf(d.z), x = d.x / sum, y = d.y / sum;
    if (d.z < 0.0f) {
      float folded = (1.0f - fabsf(y)) * (x < 0.0f ? -1.0f : 1.0f);
      y = (1.0f - fabsf(x)) * (y < 0.0f ? -1.0f : 1.0f);
      x = folded;
    }
    int32_t column = (int32_t)floorf((x + 1.0f) * half), row = (int32_t)floorf((y + 1.0f) * half);
    column = column < 0 ? 0 : (column > resolution - 1 ? resolution - 1 : column);
    row = row < 0 ? 0 : (row > resolution - 1 ? resolution - 1 : row);
    cell[i] = row * resolution + column;
  }
}

/* Real spherical harmonics of bands 0 to order (at most 2) at unit directions, row by row: basis (n, (order + 1)^2). */
EXPORT void KERNEL(sh_basis)(int64_t n, const float *directions, int32_t order, float *basis)
{
  const float c0 = (float)0.28209479177387814, c1 = (float)0.4886025119029199, c2 = (float)1.0925484305920792;
  const float c3 = (float)0.9461746957575601, c4 = (float)0.31539156525252005, half = (float)0.5462742152960396;
  int64_t k = (order + 1) * (order + 1);
  for (int64_t i = 0; i < n; i++) {
    Vec d = load(directions, i);
    float *row = basis + i * k;
    row[0] = c0;
    if (order >= 1) {
      row[1] = d.y * c1;
      row[2] = d.z * c1;
      row[3] = d.x * c1;
    }
    if (order >= 2) {
      float scaled = c2 * d.z;
      row[4] = c2 * d.x * d.y;
      row[5] = scaled * d.y;
      row[6] = d.z * d.z * c3 - c4;
      row[7] = scaled * d.x;
      row[8] = (d.x + d.y) * (d.x - d.y) * half;
    }
  }
}
