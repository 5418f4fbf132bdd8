/* Rays of probes: twins of Gatherer.trace, project and Gatherer._visibility in techniques/probes/gather.py, and of
   HitLight.reflected in transport/cache/hit_light.py. */

#include "texels.h"
#include "tracer.h"

/* Slots (h,) of hits. */
EXPORT void KERNEL(slots)(int64_t triangles, const Cells *cells, int64_t h, const int32_t *primitive, const float *u,
                          const float *v, const uint8_t *front, int32_t *slots)
{
  for (int64_t i = 0; i < h; i++) {
    WITHIN(primitive[i], triangles);
    slots[i] = slot_of(cells + primitive[i], u[i], v[i], front[i]);
  }
}

typedef struct {
  int64_t count, capacity;
  int32_t *rows, *primitive, *slots;
  float *u, *v, *t, *cosine;
} Found;

static inline void keep(Found *found, const Cells *cells, int64_t triangles, int64_t row, uint32_t primitive, float u, float v,
                        float t, Vec direction)
{
  int64_t i = found->count++;
  WITHIN(i, found->capacity);
  WITHIN(primitive, triangles);
  const Cells *here = cells + primitive;
  float cosine = -dot(load(here->normal, 0), direction);
  found->rows[i] = (int32_t)row;
  found->primitive[i] = (int32_t)primitive;
  found->u[i] = u;
  found->v[i] = v;
  found->t[i] = t;
  found->cosine[i] = cosine;
  found->slots[i] = slot_of(here, u, v, cosine > 0.0f);
}

/* Rays along directions (g, n, 3) from positions (g, m, 3): what those that hit something met, in the order block, direction,
   member. Returns the number of hits; every output has room for g * n * m. The m rays of a direction go as a packet. */
EXPORT int64_t KERNEL(trace)(const Tracer *tracer, int64_t triangles, const Cells *cells, int64_t g, int64_t n, int64_t m,
                             const float *positions, const float *directions, int32_t *rows, int32_t *primitive, float *u,
                             float *v, float *t, int32_t *slots, float *cosine)
{
  Found found = {0, g * n * m, rows, primitive, slots, u, v, t, cosine};
  RayHit hit;
  RayHit8 hits;
  _Alignas(32) int valid[LANES];
  memset(&hit, 0, sizeof hit);
  memset(&hits, 0, sizeof hits);
  for (int64_t block = 0; block < g; block++) {
    const float *from = positions + block * m * 3;
    for (int64_t i = 0; i < n; i++) {
      Vec direction = load(directions, block * n + i);
      int64_t row = (block * n + i) * m;
      if (m == 1) {
        nearest(tracer, &hit, load(from, 0), direction, INFINITE);
        if (hit.geometry != NOTHING) {
          keep(&found, cells, triangles, row, hit.primitive, hit.u, hit.v, hit.ray.tfar, direction);
        }
        continue;
      }
      for (int64_t first = 0; first < m; first += LANES) {
        int64_t lanes = m - first < LANES ? m - first : LANES;
        for (int64_t lane = 0; lane < LANES; lane++) {
          int64_t member = first + (lane < lanes ? lane : 0);
          valid[lane] = lane < lanes ? -1 : 0;
          hits.ray.org[0][lane] = from[3 * member];
          hits.ray.org[1][lane] = from[3 * member + 1];
          hits.ray.org[2][lane] = from[3 * member + 2];
          hits.ray.dir[0][lane] = direction.x;
          hits.ray.dir[1][lane] = direction.y;
          hits.ray.dir[2][lane] = direction.z;
          hits.ray.tnear[lane] = 0.0f;
          hits.ray.time[lane] = 0.0f;
          hits.ray.tfar[lane] = INFINITE;
          hits.ray.mask[lane] = NOTHING;
          hits.ray.flags[lane] = 0;
          hits.primitive[lane] = hits.geometry[lane] = hits.instance[lane] = NOTHING;
        }
        tracer->intersect8(valid, tracer->scene, &hits, NULL);
        for (int64_t lane = 0; lane < lanes; lane++) {
          if (hits.geometry[lane] != NOTHING) {
            keep(&found, cells, triangles, row + first + lane, hits.primitive[lane], hits.u[lane], hits.v[lane],
                 hits.ray.tfar[lane], direction);
          }
        }
      }
    }
  }
  return found.count;
}

/* Which hits lie on texels that are not smooth: their indices, and how many. */
EXPORT int64_t KERNEL(uneven)(int64_t texels, const uint8_t *smooth, int64_t h, const int32_t *texel, int64_t *rows)
{
  int64_t count = 0;
  for (int64_t i = 0; i < h; i++) {
    int64_t index = texel[i] < 0 ? texel[i] + texels : texel[i];
    WITHIN(index, texels);
    rows[count] = i;
    count += !smooth[index];
  }
  return count;
}

/* Radiance (h, 3) that hits reflect: rest and direct (texels, 3) the irradiance of their texels, uneven (c, 3) the direct light of
   those that are not smooth, in their order (c of them; NULL: no sources); albedo (h, 3), or with primitive (h,) that of triangles
   (albedos, 3). pdf_area (texels,): where it is not 0 direct light is shared with samples of bright surfaces, by a ray of density
   ray_pdf that arrived under cosine (h,) from t (h,) away, against pdf_area / per_light; NULL: it is not. */
EXPORT void KERNEL(reflected)(int64_t texels, const float *rest, const float *direct, const uint8_t *smooth,
                              const float *pdf_area, int64_t h, const int32_t *texel, int64_t c, const float *uneven,
                              int64_t albedos, const float *albedo, const int32_t *primitive, float ray_pdf, float per_light,
                              const float *cosine, const float *t, float *radiance)
{
  int64_t next = 0;
  for (int64_t i = 0; i < h; i++) {
    int64_t index = texel[i] < 0 ? texel[i] + texels : texel[i];
    WITHIN(index, texels);
    Vec light = load(rest, index);
    if (direct) {
      Vec lamps;
      if (smooth[index] || !uneven) {
        lamps = load(direct, index);
      } else {
        WITHIN(next, c);
        lamps = load(uneven, next++);
      }
      float sampled = pdf_area ? pdf_area[index] : 0.0f;
      if (sampled != 0.0f) {
        float by_ray = ray_pdf * fabsf(cosine[i]) / largest(t[i] * t[i], 1e-20f);
        lamps = mul(lamps, by_ray / largest(by_ray + sampled / per_light, 1e-30f));
      }
      light = add(light, lamps);
    }
    int64_t row = primitive ? primitive[i] : i;
    WITHIN(row, albedos);
    Vec colour = load(albedo, row);
    store(radiance, i, (Vec){light.x * colour.x * (1.0f / PI_F), light.y * colour.y * (1.0f / PI_F),
                             light.z * colour.z * (1.0f / PI_F)});
  }
}

/* Where the rays of some hits, which (c,) of rows (h,), met: points (c, 3) at t (h,) along directions (g, n, 3) from positions
   (g, m, 3), and the normals (c, 3) of their triangles, primitive (h,), turned to the side of their slots (h,). Twin of
   _ItemRays.points, and of the faces in TexelSampler.at. */
EXPORT void KERNEL(ray_points)(int64_t c, const int64_t *which, int64_t h, const int32_t *rows, int64_t g, int64_t n, int64_t m,
                               const float *positions, const float *directions, const float *t, int64_t triangles,
                               const float *normals, const int32_t *primitive, const int32_t *slots, float *points, float *faces)
{
  for (int64_t i = 0; i < c; i++) {
    int64_t hit = which[i];
    WITHIN(hit, h);
    int64_t ray = rows[hit], direction = ray / m;
    WITHIN(ray, g * n * m);
    WITHIN(primitive[hit], triangles);
    Vec along = mul(load(directions, direction), t[hit]);
    store(points, i, add(along, load(positions, direction / n * m + ray % m)));
    store(faces, i, mul(load(normals, primitive[hit]), slots[hit] & 1 ? 1.0f : -1.0f));
  }
}

#define MOST_COEFFICIENTS 81

/* Sums (g, m, k, 3) over directions of basis (g, n, k) times radiance: of hits rows (h,) ascending, radiance (h, 3); of the other
   rays sky (g * n, 3), NULL: 0. */
EXPORT void KERNEL(project)(int64_t g, int64_t n, int64_t m, int64_t k, const float *basis, int64_t h, const int32_t *rows,
                            const float *radiance, const float *sky, float *sums)
{
  float total[MOST_COEFFICIENTS * 3][LANES];
  WITHIN(k - 1, MOST_COEFFICIENTS);
  for (int64_t first = 0; first < m; first += LANES) {
    int64_t lanes = m - first < LANES ? m - first : LANES, next = 0;
    for (int64_t block = 0; block < g; block++) {
      memset(total, 0, (size_t)(k * 3) * sizeof total[0]);
      for (int64_t i = 0; i < n; i++) {
        int64_t direction = block * n + i, row = direction * m + first;
        float light[3][LANES];
        for (int channel = 0; channel < 3; channel++) {
          float miss = sky ? sky[3 * direction + channel] : 0.0f;
          for (int lane = 0; lane < LANES; lane++) {
            light[channel][lane] = miss;
          }
        }
        while (next < h && rows[next] < row) {
          next++;
        }
        for (; next < h && rows[next] < row + lanes; next++) {
          for (int channel = 0; channel < 3; channel++) {
            light[channel][rows[next] - row] = radiance[3 * next + channel];
          }
        }
        const float *weights = basis + direction * k;
        for (int64_t coefficient = 0; coefficient < k; coefficient++) {
          float weight = weights[coefficient];
          for (int channel = 0; channel < 3; channel++) {
            float *sum = total[3 * coefficient + channel];
            for (int lane = 0; lane < LANES; lane++) {
              sum[lane] += weight * light[channel][lane];
            }
          }
        }
      }
      for (int64_t lane = 0; lane < lanes; lane++) {
        float *out = sums + ((block * m + first + lane) * k) * 3;
        for (int64_t column = 0; column < 3 * k; column++) {
          out[column] = total[column][lane];
        }
      }
    }
  }
}

/* Distance and squared distance of the rays in each cell of a tile, sums (g, m, cells, 2), and their numbers weights (g, cells), both
   zero before, for the blocks that are early (g,). cell (g * n,); rays that hit nothing, and those that go beyond reach (g, m), go
   that far. */
EXPORT void KERNEL(visibility)(int64_t g, int64_t n, int64_t m, int64_t cells, const uint8_t *early, const int32_t *cell,
                               const float *reach, int64_t h, const int32_t *rows, const float *t, float *sums, float *weights)
{
  int64_t next = 0;
  for (int64_t block = 0; block < g; block++) {
    for (int64_t i = 0; i < n; i++) {
      int64_t direction = block * n + i;
      if (!early[block]) {
        while (next < h && rows[next] < (direction + 1) * m) {
          next++;
        }
        continue;
      }
      WITHIN(cell[direction], cells);
      weights[block * cells + cell[direction]] += 1.0f;
      for (int64_t member = 0; member < m; member++) {
        float distance = reach[block * m + member];
        if (next < h && rows[next] == direction * m + member) {
          distance = smallest(distance, t[next++]);
        }
        float *sum = sums + ((block * m + member) * cells + cell[direction]) * 2;
        sum[0] += distance;
        sum[1] += distance * distance;
      }
    }
  }
}

static inline const float *row_of(const float *rows, int64_t count, int32_t index)
{
  int64_t at = index < 0 ? index + count : index;
  WITHIN(at, count);
  return rows + 4 * at;
}

/* One pass of the radiosity: out (n, 3) = first (n, 3) + scale times the sum over rays (r, n) of radiance (texels, 4) at the texels
   that they hit (-1: the last row). Twin of transport/cache/solver.py: gather. */
EXPORT void KERNEL(spread)(int64_t texels, const float *radiance, int64_t r, int64_t n, const int32_t *hits, float scale,
                           const float *first, float *out)
{
  enum { TOGETHER = 64 };
  float total[TOGETHER][4];
  for (int64_t start = 0; start < n; start += TOGETHER) {
    int64_t width = n - start < TOGETHER ? n - start : TOGETHER, ray = 0;
    memset(total, 0, sizeof total);
    /* Four at a time: sums are read and written less often. */
    for (; ray + 4 <= r; ray += 4) {
      const int32_t *row = hits + ray * n + start;
      for (int64_t i = 0; i < width; i++) {
        const float *a = row_of(radiance, texels, row[i]), *b = row_of(radiance, texels, row[n + i]);
        const float *c = row_of(radiance, texels, row[2 * n + i]), *d = row_of(radiance, texels, row[3 * n + i]);
        for (int channel = 0; channel < 4; channel++) {
          total[i][channel] += (a[channel] + b[channel]) + (c[channel] + d[channel]);
        }
      }
    }
    for (; ray < r; ray++) {
      for (int64_t i = 0; i < width; i++) {
        const float *a = row_of(radiance, texels, hits[ray * n + start + i]);
        for (int channel = 0; channel < 4; channel++) {
          total[i][channel] += a[channel];
        }
      }
    }
    for (int64_t i = 0; i < width; i++) {
      for (int channel = 0; channel < 3; channel++) {
        int64_t at = 3 * (start + i) + channel;
        out[at] = first[at] + total[i][channel] * scale;
      }
    }
  }
}

/* Sums (g, m, k, 3) over directions of basis (g, n, k) times radiance (texels, 4) of the texel (g, n, m) that each ray hit; of rays
   with none (negative) sky (g * n, 3), NULL: 0. Twin of the plain case of relit_sums in techniques/probes/relight.py. */
EXPORT void KERNEL(project_texels)(int64_t g, int64_t n, int64_t m, int64_t k, const float *basis, int64_t texels,
                                   const float *radiance, const int32_t *texel, const float *sky, float *sums)
{
  float total[MOST_COEFFICIENTS * 3][LANES];
  WITHIN(k - 1, MOST_COEFFICIENTS);
  for (int64_t block = 0; block < g; block++) {
    for (int64_t first = 0; first < m; first += LANES) {
      int64_t lanes = m - first < LANES ? m - first : LANES;
      memset(total, 0, (size_t)(k * 3) * sizeof total[0]);
      for (int64_t direction = block * n; direction < (block + 1) * n; direction++) {
        float light[3][LANES];
        memset(light, 0, sizeof light);
        for (int64_t lane = 0; lane < lanes; lane++) {
          int32_t index = texel[direction * m + first + lane];
          const float *here = index >= 0 ? row_of(radiance, texels, index) : (sky ? sky + 3 * direction : NULL);
          for (int channel = 0; here && channel < 3; channel++) {
            light[channel][lane] = here[channel];
          }
        }
        const float *weights = basis + direction * k;
        for (int64_t coefficient = 0; coefficient < k; coefficient++) {
          float weight = weights[coefficient];
          for (int channel = 0; channel < 3; channel++) {
            float *sum = total[3 * coefficient + channel];
            for (int lane = 0; lane < LANES; lane++) {
              sum[lane] += weight * light[channel][lane];
            }
          }
        }
      }
      for (int64_t lane = 0; lane < lanes; lane++) {
        float *out = sums + ((block * m + first + lane) * k) * 3;
        for (int64_t column = 0; column < 3 * k; column++) {
          out[column] = total[column][lane];
        }
      }
    }
  }
}
