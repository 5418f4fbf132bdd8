/* What surfaces reflect, and light that pixels keep and share: twins of surface_look and sample_reflection in
   transport/surfaces/ggx.py, of KeptLight in effects/kept_light.py and of a pass of effects/ray_traced/smoothing.py. */

#include "rtgi.h"

/* As transport/surfaces/ggx.py has them. */
#define MIN_ALPHA 2e-3f
#define MOST_ROOT 0.99
#define TAU 6.283185307179586

/* Bilinear between texel centres of a block of size x size texels of four. */
static inline void layer_energy(const float *table, int32_t size, int32_t block, float cosine, float roughness, float *energy)
{
  /* In this order what is no number is 0, and not an index beyond the table. */
  float x = smallest(largest(cosine * (float)size - 0.5f, 0.0f), (float)size - 0.5f);
  float y = smallest(largest(roughness * (float)size - 0.5f, 0.0f), (float)size - 0.5f);
  int32_t column = (int32_t)x < size - 2 ? (int32_t)x : size - 2, row = (int32_t)y < size - 2 ? (int32_t)y : size - 2;
  float fx = x - (float)column, fy = y - (float)row;
  const float *first = table + 4 * ((int64_t)(row + block * size) * size + column), *next = first + 4 * size;
  for (int k = 0; k < 4; k++) {
    float lower = first[k] + (first[4 + k] - first[k]) * fx, upper = next[k] + (next[4 + k] - next[k]) * fx;
    energy[k] = lower + (upper - lower) * fy;
  }
}

static inline float multiple_scattering(float fresnel, float energy, float mean_energy)
{
  float again = fresnel * mean_energy / largest(1.0f - fresnel * (1.0f - mean_energy), 1e-3f);
  return 1.0f + again * (1.0f - energy) / largest(energy, 1e-3f);
}

/* The looks of n surfaces by the energy table of 1 + (indices - 1) blocks: colours (n, 3), the others (n,). */
EXPORT void KERNEL(surface_look)(const float *table, int32_t size, int32_t indices, int64_t n, const float *albedo,
                                 const float *base_color, const float *metallic, const float *roughness, const float *specular,
                                 const float *view_cosine, float *diffuse, float *f0, float *edge, float *layer, float *coat,
                                 float *index, float *alpha)
{
  for (int64_t i = 0; i < n; i++) {
    float energy[4], low_energy[4], metal = metallic[i], reflect = specular[i];
    layer_energy(table, size, 0, view_cosine[i], roughness[i], energy);
    float once = energy[0] + energy[1], mean_once = energy[2] + energy[3];
    float root = sqrtf(clamped(reflect, 0.0f, (float)(MOST_ROOT * MOST_ROOT * MOST_ROOT * MOST_ROOT)));
    float refraction = (1.0f + root) / (1.0f - root);
    float fresnel_mean = (refraction - 1.0f) / (4.08567f + 1.00071f * refraction);
    float more_coat = multiple_scattering(fresnel_mean, once, mean_once);
    float held = smallest(largest(reflect, 0.0f), 1.0f), place = sqrtf(sqrtf(held)) * (float)(indices - 1);
    int32_t low = (int32_t)place < indices - 2 ? (int32_t)place : indices - 2;
    float blend = place - (float)low;
    layer_energy(table, size, 1 + low, view_cosine[i], roughness[i], low_energy);
    float dielectric = reflect * once + (1.0f - reflect) * (low_energy[0] * (1.0f - blend) + low_energy[1] * blend);
    float dielectric_mean = reflect * mean_once + (1.0f - reflect) * (low_energy[2] * (1.0f - blend) + low_energy[3] * blend);
    float below = largest(1.0f - dielectric * more_coat, 0.0f);
    float mean_coat = dielectric_mean * multiple_scattering(fresnel_mean, mean_once, mean_once);
    float rest = 1.0f - metal, scale = below / largest(1.0f - mean_coat, 0.05f);
    coat[i] = rest * more_coat;
    index[i] = refraction;
    alpha[i] = largest(roughness[i] * roughness[i], MIN_ALPHA);
    for (int k = 0; k < 3; k++) {
      float base = base_color[3 * i + k], rise = clamped(100.0f * base, 0.0f, 1.0f) - base, colour = base + rise / 21.0f;
      float more = multiple_scattering(colour, once, mean_once), more_mean = multiple_scattering(colour, mean_once, mean_once);
      float mean = metal * (base * mean_once + rise * energy[3]) * more_mean + rest * mean_coat;
      diffuse[3 * i + k] = largest(albedo[3 * i + k] - mean, 0.0f) * scale;
      f0[3 * i + k] = metal * base * more;
      edge[3 * i + k] = metal * rise * more;
      layer[3 * i + k] = f0[3 * i + k] * once + edge[3 * i + k] * energy[1] + coat[i] * dielectric;
    }
  }
}

static inline double smith(double cosine, double alpha)
{
  return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
}

/* Directions (n, 3) that layers reflect to towards_eye (n, 3), drawn by visible normals from u (n, 2), and weights (n, 3). */
EXPORT void KERNEL(sample_reflection)(int64_t n, const float *f0, const float *edge, const float *coat, const float *index,
                                      const float *alpha, const float *normals, const float *towards_eye, const float *u,
                                      float *directions, float *weights)
{
  for (int64_t i = 0; i < n; i++) {
    Vec normal = load(normals, i), eye = load(towards_eye, i), tangent;
    float straight = dot(normal, eye);
    Vec sideways = sub(eye, mul(normal, straight));
    float length = sqrtf(dot(sideways, sideways));
    double cosine = clamped(straight, 1e-3f, 1.0f), sine = sqrt(largest(1.0f - (float)cosine * (float)cosine, 0.0f));
    if (length > 1e-6f) {
      tangent = divided(sideways, length);
    } else {
      /* As numerics/sampling.py: frame has it. */
      float sign = copysignf(1.0f, normal.z), a = -1.0f / (sign + normal.z);
      tangent = (Vec){1.0f + sign * normal.x * normal.x * a, sign * normal.x * normal.y * a, -sign * normal.x};
    }
    double half[3] = {0.0, 0.0, 1.0}, wide = alpha[i];
    if (alpha[i] > MIN_ALPHA) {
      /* Stretched, the view lies in the plane y = 0: the basis is (sideways, up, stretched). */
      double sx = sine * wide, reach = sqrt(sx * sx + cosine * cosine), sz = cosine / reach;
      sx /= reach;
      double radius = sqrt((double)u[2 * i]), angle = TAU * (double)u[2 * i + 1];
      double x = radius * cos(angle), middle = 0.5 * (1.0 + sz);
      double y = (1.0 - middle) * sqrt(fmax(1.0 - x * x, 0.0)) + middle * radius * sin(angle);
      double z = sqrt(fmax(1.0 - x * x - y * y, 0.0));
      double hx = (z * sx - y * sz) * wide, hy = x * wide, hz = y * sx + z * sz;
      double whole = sqrt(hx * hx + hy * hy + hz * hz);
      half[0] = hx / whole;
      half[1] = hy / whole;
      half[2] = hz / whole;
    }
    Vec across = {normal.y * tangent.z - normal.z * tangent.y, normal.z * tangent.x - normal.x * tangent.z,
                  normal.x * tangent.y - normal.y * tangent.x};
    Vec facet = {(float)(half[0] * tangent.x + half[1] * across.x + half[2] * normal.x),
                 (float)(half[0] * tangent.y + half[1] * across.y + half[2] * normal.y),
                 (float)(half[0] * tangent.z + half[1] * across.z + half[2] * normal.z)};
    double along = sine * half[0] + cosine * half[2], light = 2.0 * along * half[2] - cosine;
    int lit = light > 0.0;
    double mask = smith(cosine, wide), shadow = smith(lit ? light : 1.0, wide);
    double share = lit ? (1.0 + mask) / (1.0 + mask + shadow) : 0.0;
    store(directions, i, normalized(sub(mul(facet, 2.0f * dot(facet, eye)), eye)));
    double met = along < 0.0 ? 0.0 : along > 1.0 ? 1.0 : along, grazing = (1.0 - met) * (1.0 - met), refraction = index[i];
    double g = sqrt(fmax(refraction * refraction - 1.0 + met * met, 0.0));
    double cross = (g - met) / fmax(g + met, 1e-6), parallel = (met * (g + met) - 1.0) / (met * (g - met) + 1.0);
    double mirrored = coat[i] * 0.5 * cross * cross * (1.0 + parallel * parallel);
    grazing *= grazing * (1.0 - met);
    for (int k = 0; k < 3; k++) {
      weights[3 * i + k] = (float)((f0[3 * i + k] + edge[3 * i + k] * grazing + mirrored) * share);
    }
  }
}

/* 2 to the power of x in [-126, 0], within 2e-7 of it: the C library's, which takes any x, is most of the time where every pixel
   looks at its neighbours. */
static inline float power_of_two(float x)
{
  int32_t whole = (int32_t)(x - 0.5f);
  float part = x - (float)whole;
  /* Taylor's, of part in [-1/2, 1/2]. */
  float y = 1.0f + part * (0.69314718f + part * (0.24022651f + part * (0.055504109f + part * (0.0096181291f + part * (
    0.0013333558f + part * (0.00015403530f + part * 0.000015252734f))))));
  uint32_t bits = (uint32_t)(whole + 127) << 23;
  float scale;
  memcpy(&scale, &bits, sizeof scale);
  return y * scale;
}

/* x to the power of 72. */
static inline float likeness(float x)
{
  float square = x * x, fourth = square * square, eighth = fourth * fourth, power = eighth * eighth;
  power *= power;
  return x > 0.0f ? power * power * eighth : 0.0f;
}

/* Add light (m, 3) that one sample of a picture gathered at points (m, 3) with normals (m, 3), to what (n,) places ask of it: those
   of the pixels pixel (n,) with points and unit normals (n, 3), one over a pixel's width inverse (n,). */
EXPORT void KERNEL(kept_light)(int64_t m, const float *kept_points, const uint16_t *kept_normals, const float *light, float worth,
                               int64_t n, const int64_t *pixel, const float *points, const float *normals, const float *inverse,
                               float *total, float *weight, float *found)
{
  for (int64_t i = 0; i < n; i++) {
    WITHIN(pixel[i], m);
    const uint16_t *halves = kept_normals + 3 * pixel[i];
    Vec normal = load(normals, i), kept = {half_to_float(halves[0]), half_to_float(halves[1]), half_to_float(halves[2])};
    float off = dot(normal, sub(load(kept_points, pixel[i]), load(points, i))) * inverse[i];
    float counts = likeness(dot(normal, kept));
    counts *= off * off < 31.0f ? power_of_two(-4.0f * off * off) : 0.0f;
    found[i] += counts;
    counts *= worth;
    for (int k = 0; k < 3; k++) {
      total[3 * i + k] += light[3 * pixel[i] + k] * counts;
    }
    weight[i] += counts;
  }
}

enum { TOGETHER_SHARED = 128, WAYS = 4 };

/* How much (count,) light counts that comes to count pixels from here on from as many from there on, in one picture. */
static void alike(const float *points, const float *normals, const float *inverse, const float *reach, int64_t here, int64_t there,
                  int64_t count, float *counts)
{
  const float *p = points + 3 * here, *q = points + 3 * there, *n = normals + 3 * here, *m = normals + 3 * there;
  for (int64_t i = 0; i < count; i++) {
    float x = q[3 * i] - p[3 * i], y = q[3 * i + 1] - p[3 * i + 1], z = q[3 * i + 2] - p[3 * i + 2];
    float like = likeness(n[3 * i] * m[3 * i] + n[3 * i + 1] * m[3 * i + 1] + n[3 * i + 2] * m[3 * i + 2]);
    float off = (n[3 * i] * x + n[3 * i + 1] * y + n[3 * i + 2] * z) * inverse[here + i], exponent = -4.0f * off * off;
    if (reach) {
      float near = smallest(reach[here + i], reach[there + i]);
      exponent -= (x * x + y * y + z * z) / largest(near * near, 1e-20f);
    }
    counts[i] = exponent > -64.0f ? like * power_of_two(largest(exponent, -64.0f)) : 0.0f;
  }
}

/* What is shared at pixel here, by counts of its taps, which lie apart from it: see share_light. */
static inline void shared_at(int64_t here, int64_t channels, const float *values, const float *weight, const float *by,
                             const int64_t *apart, int64_t pixels, float *mean, float *counted)
{
  float total[4] = {0, 0, 0, 0}, sum = weight[here] * 0.25f, most = 0.25f;
  for (int64_t k = 0; k < channels; k++) {
    total[k] = values[channels * here + k] * sum;
  }
  for (int tap = 0; tap < 2 * WAYS; tap++) {
    /* What is beyond the picture counts by nothing, and is not read. */
    if (by[tap] > 0.0f) {
      int64_t there = here + apart[tap];
      WITHIN(there, pixels);
      float share = by[tap] * weight[there];
      most += by[tap];
      for (int64_t k = 0; k < channels; k++) {
        total[k] += values[channels * there + k] * share;
      }
      sum += share;
    }
  }
  for (int64_t k = 0; k < channels; k++) {
    mean[channels * here + k] = total[k] / largest(sum, 1e-20f);
  }
  counted[here] = sum / most;
}

/* One pass over a picture of height x width pixels: values (h, w, channels) that count by weight (h, w), averaged over taps step
   pixels apart into mean and counted; points and normals (h, w, 3), inverse (h, w) one over a pixel's width, reach (h, w) or NULL,
   seen (h, w); a tap whose opposite is not like the pixel counts by alone. */
EXPORT void KERNEL(share_light)(int64_t height, int64_t width, int64_t step, const float *points, const float *normals,
                                const float *inverse, const float *reach, const uint8_t *seen, int64_t channels,
                                const float *values, const float *weight, float alone, float *mean, float *counted)
{
  static const int ways[WAYS][2] = {{0, 1}, {1, -1}, {1, 0}, {1, 1}};
  static const float shares[WAYS] = {0.125f, 0.0625f, 0.125f, 0.0625f};
  float counts[2 * WAYS][TOGETHER_SHARED];
  int64_t apart[2 * WAYS];
  for (int64_t row = 0; row < height; row++) {
    for (int64_t start = 0; start < width; start += TOGETHER_SHARED) {
      int64_t end = start + TOGETHER_SHARED < width ? start + TOGETHER_SHARED : width;
      memset(counts, 0, sizeof counts);
      for (int tap = 0; tap < 2 * WAYS; tap++) {
        int64_t sign = tap & 1 ? -step : step, down = sign * ways[tap / 2][0], along = sign * ways[tap / 2][1];
        int64_t first = start + along < 0 ? -along : start, last = end + along > width ? width - along : end;
        apart[tap] = down * width + along;
        if (row + down >= 0 && row + down < height && first < last) {
          alike(points, normals, inverse, reach, row * width + first, row * width + first + apart[tap], last - first,
                counts[tap] + (first - start));
        }
      }
      for (int64_t column = start; column < end; column++) {
        int64_t here = row * width + column, at = column - start;
        float by[2 * WAYS];
        for (int tap = 0; tap < 2 * WAYS; tap++) {
          float both = smallest(counts[tap & ~1][at], counts[tap | 1][at]);
          by[tap] = seen[here] ? (both + alone * counts[tap][at]) * shares[tap / 2] : 0.0f;
        }
        /* Numbers of channels that are known make other loops. */
        if (channels == 3) {
          shared_at(here, 3, values, weight, by, apart, height * width, mean, counted);
        } else {
          shared_at(here, channels, values, weight, by, apart, height * width, mean, counted);
        }
        counted[here] = seen[here] ? counted[here] : 0.0f;
      }
    }
  }
}
