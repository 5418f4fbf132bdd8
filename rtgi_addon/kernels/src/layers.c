/* What GGX layers reflect in all: twin of the sums over samples in transport/surfaces/ggx.py: energy_table. */

#include "rtgi.h"

enum { MOST_LAYER_SAMPLES = 1024 };

static inline double masked(double cosine, double alpha)
{
  return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
}

/* Means (2 + indices, size, size) over samples, at most 1024 points on the unit disk (samples, 2): a row a roughness of these alpha (size,), a column a
   cosine of the view. What is reflected without Fresnel's terms at grazing angles and of those, then of the way from the
   reflectance at normal incidence to 1 what dielectrics of each pair of reflectance and index (indices, 2) do. */
EXPORT void KERNEL(layer_parts)(int64_t size, int64_t samples, const double *alpha, const double *disk, int64_t indices,
                                const float *dielectrics, double *parts)
{
  float share[MOST_LAYER_SAMPLES], along[MOST_LAYER_SAMPLES], part[MOST_LAYER_SAMPLES];
  WITHIN(samples - 1, MOST_LAYER_SAMPLES);
  for (int64_t row = 0; row < size; row++) {
    double wide = alpha[row];
    for (int64_t column = 0; column < size; column++) {
      double cosine = ((double)column + 0.5) / (double)size, sx = sqrt(1.0 - cosine * cosine) * wide;
      double reach = sqrt(sx * sx + cosine * cosine), sz = cosine / reach, middle = 0.5 * (1.0 + sz);
      double mask = masked(cosine, wide), base = 0.0, grazing = 0.0, *out = parts + row * size + column;
      sx /= reach;
      for (int64_t i = 0; i < samples; i++) {
        double x = disk[2 * i], y = (1.0 - middle) * sqrt(1.0 - x * x) + middle * disk[2 * i + 1];
        double z = sqrt(fmax(1.0 - x * x - y * y, 0.0));
        double hx = (z * sx - y * sz) * wide, hy = x * wide, hz = y * sx + z * sz, whole = sqrt(hx * hx + hy * hy + hz * hz);
        double met = (sqrt(1.0 - cosine * cosine) * hx + cosine * hz) / whole, light = 2.0 * met * (hz / whole) - cosine;
        double lit = light > 0.0 ? (1.0 + mask) / (1.0 + mask + masked(light, wide)) : 0.0;
        double rise = met < 0.0 ? 1.0 : met > 1.0 ? 0.0 : 1.0 - met, fifth = rise * rise * rise * rise * rise;
        base += lit * (1.0 - fifth);
        grazing += lit * fifth;
        share[i] = (float)lit;
        along[i] = met < 0.0 ? 0.0f : met > 1.0 ? 1.0f : (float)met;
      }
      out[0] = base / (double)samples;
      out[size * size] = grazing / (double)samples;
      for (int64_t k = 0; k < indices; k++) {
        float f0 = dielectrics[2 * k], index = dielectrics[2 * k + 1], rest = 1.0f - f0;
        double sum = 0.0;
        for (int64_t i = 0; i < samples; i++) {
          float c = along[i], g = sqrtf(largest(index * index - 1.0f + c * c, 0.0f)), across = (g - c) / largest(g + c, 1e-6f);
          float parallel = (c * (g + c) - 1.0f) / (c * (g - c) + 1.0f);
          part[i] = share[i] * ((0.5f * across * across * (1.0f + parallel * parallel) - f0) / rest);
        }
        for (int64_t i = 0; i < samples; i++) {
          sum += part[i];
        }
        out[(2 + k) * size * size] = sum / (double)samples;
      }
    }
  }
}
