/* Arrays of rays against Embree: twins of EmbreeTracer in transport/rays/embree.py. */

#include "tracer.h"

/* Nearest hits of n rays; limits NULL: none. A miss has primitive -1 and t infinite. */
EXPORT void KERNEL(intersect)(const Tracer *tracer, int64_t n, const float *origins, const float *directions, const float *limits,
                              int32_t *primitive, float *u, float *v, float *t)
{
  RayHit hit;
  memset(&hit, 0, sizeof hit);
  for (int64_t i = 0; i < n; i++) {
    nearest(tracer, &hit, load(origins, i), load(directions, i), limits ? limits[i] : INFINITE);
    int found = hit.geometry != NOTHING;
    primitive[i] = found ? (int32_t)hit.primitive : -1;
    u[i] = found ? hit.u : 0.0f;
    v[i] = found ? hit.v : 0.0f;
    t[i] = found ? hit.ray.tfar : INFINITY;
  }
}

/* hidden[i] 1 where something lies between the origin and the limit. */
EXPORT void KERNEL(occluded)(const Tracer *tracer, int64_t n, const float *origins, const float *directions, const float *limits,
                             uint8_t *hidden)
{
  for (int64_t i = 0; i < n; i++) {
    hidden[i] = (uint8_t)is_occluded(tracer, load(origins, i), load(directions, i),
                                     limits ? smallest(limits[i], INFINITE) : INFINITE);
  }
}

/* One ray through every function, for Python to see that structures are as it thinks: found (4, 3) float is t, u, v of intersect1 and
   of each of two lanes of intersect8, then what occluded1, occluded8's first and second lane say. */
EXPORT void KERNEL(try_tracer)(const Tracer *tracer, const float *origin, const float *direction, float *found)
{
  RayHit hit;
  memset(&hit, 0, sizeof hit);
  Vec o = load(origin, 0), d = load(direction, 0);
  nearest(tracer, &hit, o, d, INFINITE);
  found[0] = hit.geometry == NOTHING ? -1.0f : hit.ray.tfar;
  found[1] = hit.u;
  found[2] = hit.v;
  RayHit8 hits;
  _Alignas(32) int valid[LANES];
  memset(&hits, 0, sizeof hits);
  for (int lane = 0; lane < LANES; lane++) {
    valid[lane] = lane < 2 ? -1 : 0;
    for (int axis = 0; axis < 3; axis++) {
      hits.ray.org[axis][lane] = origin[axis];
      hits.ray.dir[axis][lane] = lane ? -direction[axis] : direction[axis];
    }
    hits.ray.tfar[lane] = INFINITE;
    hits.ray.mask[lane] = hits.primitive[lane] = hits.geometry[lane] = hits.instance[lane] = NOTHING;
  }
  _Alignas(64) Ray8 shadows = hits.ray;
  tracer->intersect8(valid, tracer->scene, &hits, NULL);
  for (int lane = 0; lane < 2; lane++) {
    found[3 + 3 * lane] = hits.geometry[lane] == NOTHING ? -1.0f : hits.ray.tfar[lane];
    found[4 + 3 * lane] = hits.u[lane];
    found[5 + 3 * lane] = hits.v[lane];
  }
  tracer->occluded8(valid, tracer->scene, &shadows, NULL);
  found[9] = is_occluded(tracer, o, d, INFINITE) ? 1.0f : 0.0f;
  found[10] = shadows.tfar[0] < 0.0f ? 1.0f : 0.0f;
  found[11] = shadows.tfar[1] < 0.0f ? 1.0f : 0.0f;
}
