/* Samples of bright surfaces and of virtual lights: twins of BrightSurfaces.connect in transport/cache/bright.py and of gather in
   techniques/vpl/gather.py. */

#include "tracer.h"

/* Join points (n, 3) to the pool (pool, 3 and so on), one connection each, by numbers (n,): unit directions (n, 3) and contributions
   (n, 3). shading and face (n, 3) are the receivers' normals, NULL in free space. Returns how many shadow rays it took. */
EXPORT int64_t KERNEL(connect_bright)(const Tracer *tracer, int64_t pool, const float *pool_points, const float *pool_normals,
                                      const float *pool_radiance, const float *density, int64_t n, const float *numbers,
                                      const float *points, const float *shading, const float *face, float per_light, float per_ray,
                                      float *directions, float *contributions)
{
  int64_t rays = 0;
  Shadows shadows;
  Vec arriving[LANES];
  clear(&shadows);
  memset(contributions, 0, (size_t)(3 * n) * sizeof *contributions);
  for (int64_t i = 0; i <= n; i++) {
    if (i < n) {
      int64_t pick = (int64_t)(numbers[i] * (float)pool);
      pick = pick < pool - 1 ? pick : pool - 1;
      WITHIN(pick, pool);
      Vec point = load(points, i), target = load(pool_points, pick), normal = load(pool_normals, pick), towards = sub(target, point);
      float squared = largest(dot(towards, towards), 1e-20f), distance = sqrtf(squared);
      Vec direction = divided(towards, distance);
      store(directions, i, direction);
      float transfer = largest(-dot(normal, direction), 0.0f) / squared;
      if (shading) {
        transfer *= largest(dot(load(shading, i), direction), 0.0f) * (dot(load(face, i), direction) > 0.0f ? 1.0f : 0.0f);
      }
      if (!(transfer > 0.0f)) {
        continue;
      }
      Vec start = shading ? off_surface(point, load(face, i), direction, 0.0f) : point;
      Vec end = off_surface(target, normal, mul(direction, -1.0f), 0.0f);
      arriving[shadows.waiting] = mul(load(pool_radiance, pick), transfer / (per_light * density[pick] + per_ray * transfer));
      put(&shadows, start, sub(end, start), 1.0f - 1e-5f, i);
      if (shadows.waiting < LANES) {
        continue;
      }
    }
    int count = sent(tracer, &shadows);
    rays += count;
    for (int lane = 0; lane < count; lane++) {
      if (shadows.ray.tfar[lane] >= 0.0f) {
        store(contributions, shadows.which[lane], arriving[lane]);
      }
    }
  }
  return rays;
}

/* Irradiance (n, 3) that points (n, 3), off their surfaces, with normals (n, 3) receive of lights with positions, normals and radiant
   flux over pi (lights, 3), the geometry term bounded by clamp (negative: not at all), with shadow rays unless tracer is NULL.
   Returns how many those were. Points that follow one another go as a packet to one light after the other: their rays end in one
   place, and begin close together where the points do. */
EXPORT int64_t KERNEL(virtual_lights)(const Tracer *tracer, int64_t lights, const float *positions, const float *light_normals,
                                      const float *flux, int64_t n, const float *points, const float *normals, float clamp,
                                      float *irradiance)
{
  int64_t rays = 0;
  float bound = clamp >= 0.0f ? clamp : INFINITY;
  for (int64_t first = 0; first < n; first += LANES) {
    int64_t lanes = n - first < LANES ? n - first : LANES;
    float point[3][LANES], normal[3][LANES], total[3][LANES], transfer[LANES];
    _Alignas(32) int valid[LANES];
    _Alignas(64) Ray8 packet;
    for (int lane = 0; lane < LANES; lane++) {
      int64_t row = first + (lane < lanes ? lane : 0);
      for (int axis = 0; axis < 3; axis++) {
        packet.org[axis][lane] = point[axis][lane] = points[3 * row + axis];
        /* Lanes that are no point face no light. */
        normal[axis][lane] = lane < lanes ? normals[3 * row + axis] : 0.0f;
        total[axis][lane] = 0.0f;
      }
      packet.mask[lane] = NOTHING;
      packet.tnear[lane] = packet.time[lane] = 0.0f;
      packet.id[lane] = packet.flags[lane] = 0;
    }
    for (int64_t k = 0; k < lights; k++) {
      Vec light = load(positions, k), facing = load(light_normals, k), colour = load(flux, k);
      int count = 0;
      for (int lane = 0; lane < LANES; lane++) {
        float x = light.x - point[0][lane], y = light.y - point[1][lane], z = light.z - point[2][lane];
        float leaving = -(x * facing.x + y * facing.y + z * facing.z);
        float arriving = x * normal[0][lane] + y * normal[1][lane] + z * normal[2][lane];
        float squared = x * x + y * y + z * z, product = leaving * arriving / largest(squared * squared, 1e-30f);
        product = smallest(product, bound);
        int lit = leaving > 0.0f && arriving > 0.0f && product > 0.0f;
        packet.dir[0][lane] = x;
        packet.dir[1][lane] = y;
        packet.dir[2][lane] = z;
        packet.tfar[lane] = 1.0f;
        transfer[lane] = lit ? product : 0.0f;
        valid[lane] = -lit;
        count += lit;
      }
      if (!count) {
        continue;
      }
      if (tracer) {
        tracer->occluded8(valid, tracer->scene, &packet, NULL);
        rays += count;
      }
      for (int lane = 0; lane < LANES; lane++) {
        float weight = packet.tfar[lane] >= 0.0f ? transfer[lane] : 0.0f;
        total[0][lane] += colour.x * weight;
        total[1][lane] += colour.y * weight;
        total[2][lane] += colour.z * weight;
      }
    }
    for (int64_t lane = 0; lane < lanes; lane++) {
      store(irradiance, first + lane, (Vec){total[0][lane], total[1][lane], total[2][lane]});
    }
  }
  return rays;
}
