/* Embree's C interface as far as it is used here, by address: the library is the one inside the embreex wheel.

   Layouts of Embree 4 (rtcore_ray.h). What a later minor version may add to a hit comes at its end; there is room for it, and
   Python holds one known ray to each function before it trusts them. */

#ifndef RTGI_TRACER_H
#define RTGI_TRACER_H

#include "rtgi.h"

#define NOTHING 0xFFFFFFFFu
#define LANES 8

typedef struct {
  float org[3], tnear, dir[3], time, tfar;
  uint32_t mask, id, flags;
} Ray;

typedef struct {
  _Alignas(32) Ray ray;
  float normal[3], u, v;
  uint32_t primitive, geometry, instance, room[8];
} RayHit;

typedef struct {
  float org[3][LANES], tnear[LANES], dir[3][LANES], time[LANES], tfar[LANES];
  uint32_t mask[LANES], id[LANES], flags[LANES];
} Ray8;

typedef struct {
  _Alignas(64) Ray8 ray;
  float normal[3][LANES], u[LANES], v[LANES];
  uint32_t primitive[LANES], geometry[LANES], instance[LANES], room[4 * LANES];
} RayHit8;

typedef struct {
  void *scene;
  void (*intersect1)(void *scene, RayHit *hit, void *arguments);
  void (*occluded1)(void *scene, Ray *ray, void *arguments);
  void (*intersect8)(const int *valid, void *scene, RayHit8 *hit, void *arguments);
  void (*occluded8)(const int *valid, void *scene, Ray8 *ray, void *arguments);
} Tracer;

/* Rays without a limit end here, and limits beyond are taken for it. */
#define INFINITE 1e37f
/* As transport/rays/tracer.py has them. */
#define SELF_INTERSECTION 4e-6f
#define SHORTENED (1.0f - 1e-4f)

static inline void set_ray(Ray *ray, Vec origin, Vec direction, float limit)
{
  *ray = (Ray){{origin.x, origin.y, origin.z}, 0.0f, {direction.x, direction.y, direction.z}, 0.0f, limit, NOTHING, 0, 0};
}

static inline int is_occluded(const Tracer *tracer, Vec origin, Vec direction, float limit)
{
  _Alignas(32) Ray ray;
  set_ray(&ray, origin, direction, limit);
  tracer->occluded1(tracer->scene, &ray, NULL);
  return ray.tfar < 0.0f;
}

/* Shadow rays that wait until there are LANES of them. */
typedef struct {
  _Alignas(64) Ray8 ray;
  int64_t which[LANES];
  int waiting;
} Shadows;

static inline void clear(Shadows *shadows)
{
  memset(shadows, 0, sizeof *shadows);
  for (int lane = 0; lane < LANES; lane++) {
    shadows->ray.mask[lane] = NOTHING;
  }
}

static inline void put(Shadows *shadows, Vec origin, Vec direction, float limit, int64_t which)
{
  int lane = shadows->waiting++;
  shadows->ray.org[0][lane] = origin.x;
  shadows->ray.org[1][lane] = origin.y;
  shadows->ray.org[2][lane] = origin.z;
  shadows->ray.dir[0][lane] = direction.x;
  shadows->ray.dir[1][lane] = direction.y;
  shadows->ray.dir[2][lane] = direction.z;
  shadows->ray.tfar[lane] = limit;
  shadows->which[lane] = which;
}

/* Trace those that wait: the lanes that something lies in the way of are left with tfar < 0. */
static inline int sent(const Tracer *tracer, Shadows *shadows)
{
  _Alignas(32) int valid[LANES];
  int count = shadows->waiting;
  if (count) {
    for (int lane = 0; lane < LANES; lane++) {
      valid[lane] = lane < count ? -1 : 0;
    }
    tracer->occluded8(valid, tracer->scene, &shadows->ray, NULL);
  }
  shadows->waiting = 0;
  return count;
}

static inline void nearest(const Tracer *tracer, RayHit *hit, Vec origin, Vec direction, float limit)
{
  set_ray(&hit->ray, origin, direction, limit);
  hit->primitive = hit->geometry = hit->instance = NOTHING;
  tracer->intersect1(tracer->scene, hit, NULL);
}

/* Twin of transport/rays/tracer.py: offset_origins. */
static inline Vec off_surface(Vec point, Vec normal, Vec direction, float reach)
{
  float step = largest(farthest(point), reach) * SELF_INTERSECTION;
  return add(point, mul(normal, dot(normal, direction) >= 0.0f ? step : -step));
}

/* Twin of short_of in the same place, for targets at no surface. */
static inline float short_of(float distance)
{
  return smallest(distance * SHORTENED, INFINITE);
}

#endif
