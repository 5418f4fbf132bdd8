/* A final gather: twins of CachedScene.look_about in transport/cache/look.py, but for its numbers beyond the first two, and of
   the means over rays in effects/ray_traced/diffuse.py. */

#include "sampling.h"
#include "texels.h"
#include "tracer.h"

/* One number of an Owen-scrambled Sobol sequence, as sampling.c has it. */
static inline float sobol(const uint32_t *tables, int32_t dimension, uint32_t index, uint32_t seed)
{
  const uint32_t *table = tables + (int64_t)dimension * 4 * 256;
  uint32_t bits = table[index & 255] ^ table[256 + ((index >> 8) & 255)] ^ table[512 + ((index >> 16) & 255)] ^ table[768 + (index >> 24)];
  uint32_t scramble = hash_next(hash_next(HASH_START, seed), (uint32_t)(dimension + 1));
  return unit_interval(reversed_bits(owen_of_reversed(bits, scramble)));
}

/* rays cosine-distributed rays from each of n points on surfaces, with unit shading normals and triangles' normals faces (n, 3), by
   the sequences key (n * rays,) at index (n * rays,) of what purpose draws: where they start and their directions (n * rays, 3),
   cosines to the shading normal (n * rays,), and of those that met a surface, in their order, the rows, triangles, barycentrics,
   distances, slots, and cosines between the front's normal and the way back. Returns how many these are; every output has room for
   all. tables: those of sobol_owen. */
EXPORT int64_t KERNEL(cosine_rays)(const Tracer *tracer, int64_t triangles, const Cells *cells, const uint32_t *tables, int32_t purpose,
                                   int64_t n, int64_t rays, const uint32_t *key, const uint32_t *index,
                                   const float *points, const float *normals, const float *faces, float *origins, float *directions,
                                   float *leaving, int32_t *rows, int32_t *primitive, float *u, float *v, float *t, int32_t *slots,
                                   float *cosine)
{
  int64_t count = 0, total = n * rays;
  RayHit8 hits;
  _Alignas(32) int valid[LANES];
  Vec tangent = {0.0f, 0.0f, 0.0f}, bitangent = tangent, normal = tangent, point = tangent, face = tangent;
  memset(&hits, 0, sizeof hits);
  for (int64_t first = 0; first < total; first += LANES) {
    int64_t lanes = total - first < LANES ? total - first : LANES;
    for (int64_t lane = 0; lane < LANES; lane++) {
      int64_t ray = first + (lane < lanes ? lane : 0), i = ray / rays;
      valid[lane] = lane < lanes ? -1 : 0;
      if (lane == 0 || ray % rays == 0 || lane >= lanes) {
        point = load(points, i);
        normal = load(normals, i);
        face = load(faces, i);
        frame(normal, &tangent, &bitangent);
      }
      uint32_t seed = hash_next(hash_next(hash_next(HASH_START, key[ray]), 0u), (uint32_t)purpose);
      uint32_t place = reversed_bits(owen_of_reversed(reversed_bits(index[ray]), hash_next(hash_next(HASH_START, seed), 2u)));
      Vec local = cosine_hemisphere(sobol(tables, 0, place, seed), sobol(tables, 1, place, seed));
      Vec direction = add(add(mul(tangent, local.x), mul(bitangent, local.y)), mul(normal, local.z));
      Vec origin = off_surface(point, face, direction, 0.0f);
      store(origins, ray, origin);
      store(directions, ray, direction);
      leaving[ray] = local.z;
      hits.ray.org[0][lane] = origin.x;
      hits.ray.org[1][lane] = origin.y;
      hits.ray.org[2][lane] = origin.z;
      hits.ray.dir[0][lane] = direction.x;
      hits.ray.dir[1][lane] = direction.y;
      hits.ray.dir[2][lane] = direction.z;
      hits.ray.tnear[lane] = 0.0f;
      hits.ray.tfar[lane] = INFINITE;
      hits.ray.mask[lane] = NOTHING;
      hits.primitive[lane] = hits.geometry[lane] = hits.instance[lane] = NOTHING;
    }
    tracer->intersect8(valid, tracer->scene, &hits, NULL);
    for (int64_t lane = 0; lane < lanes; lane++) {
      if (hits.geometry[lane] == NOTHING) {
        continue;
      }
      WITHIN(hits.primitive[lane], triangles);
      const Cells *here = cells + hits.primitive[lane];
      float towards = -dot(load(here->normal, 0), load(directions, first + lane));
      rows[count] = (int32_t)(first + lane);
      primitive[count] = (int32_t)hits.primitive[lane];
      u[count] = hits.u[lane];
      v[count] = hits.v[lane];
      t[count] = hits.ray.tfar[lane];
      cosine[count] = towards;
      slots[count++] = slot_of(here, hits.u[lane], hits.v[lane], towards > 0.0f);
    }
  }
  return count;
}

/* Means (n, 4) over rays of each of n points: of radiance (n * rays, 3) along directions (n * rays, 3) that leave on the side of
   faces (n, 3), and of one over the distances t (h,) of the rays rows (h,) that met a surface, in their order. */
EXPORT void KERNEL(gathered)(int64_t n, int64_t rays, const float *faces, const float *directions, const float *radiance, int64_t h,
                             const int64_t *rows, const float *t, float *mean)
{
  int64_t next = 0;
  for (int64_t i = 0; i < n; i++) {
    Vec face = load(faces, i), sum = {0.0f, 0.0f, 0.0f};
    float near = 0.0f;
    for (int64_t ray = i * rays; ray < (i + 1) * rays; ray++) {
      if (dot(face, load(directions, ray)) > 0.0f) {
        sum = add(sum, load(radiance, ray));
      }
      for (; next < h && rows[next] == ray; next++) {
        near += 1.0f / largest(t[next], 1e-6f);
      }
    }
    for (int k = 0; k < 3; k++) {
      mean[4 * i + k] = (k == 0 ? sum.x : k == 1 ? sum.y : sum.z) / (float)rays;
    }
    mean[4 * i + 3] = near / (float)rays;
  }
}
