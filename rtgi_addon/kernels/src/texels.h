/* Where on the surface cache's grid a hit lies: twin of TexelLayout.slots in transport/cache/texels.py. */

#ifndef RTGI_TEXELS_H
#define RTGI_TEXELS_H

#include "rtgi.h"

typedef struct {
  float start, scale, low, span;
  int32_t cells, warped;
} Axis;

/* One triangle: two cache lines. */
typedef struct {
  Axis a, b;
  int32_t base, stride, corner, unused;
  float normal[3], size;
} Cells;

static inline int32_t cell_of(const Axis *axis, float t)
{
  if (axis->warped) {
    t = (asinhf(axis->start + axis->scale * t) - axis->low) / axis->span;
  }
  /* numpy multiplies in double here: a float times an int32. */
  int32_t cell = (int32_t)((double)t * axis->cells);
  return cell < 0 ? 0 : (cell > axis->cells - 1 ? axis->cells - 1 : cell);
}

static inline int32_t slot_of(const Cells *cells, float u, float v, int front)
{
  float w = 1.0f - u - v;
  float a = cells->corner == 0 ? u : (cells->corner == 1 ? v : w);
  float b = cells->corner == 0 ? v : (cells->corner == 1 ? w : u);
  int32_t column = cell_of(&cells->a, a), row = cell_of(&cells->b, b);
  return 2 * (cells->base + column * cells->stride + row) + (front ? 1 : 0);
}

#endif
