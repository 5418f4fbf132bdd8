/* Texels of the surface cache: twins of TexelLayout.sample in transport/cache/texels.py with TexelNumbers and TexelSampler in
   surface_points.py, of TexelTable in texel_table.py, and of the rays in SurfaceCache._trace in surface_cache.py. */

#include "sampling.h"
#include "texels.h"
#include "tracer.h"

/* What TexelLayout knows: the first slots are those of groups of small triangles, members (in all) with the sums of their areas
   member_sums (members + 1,) from group_starts (groups + 1,) on; the others cells of own triangles, which have them from own_starts
   (own,) on. */
typedef struct {
  const Cells *cells;
  const float *corners;
  const int64_t *own_triangles, *own_starts, *members, *group_starts;
  const double *member_sums;
  int64_t triangles, own, groups, member_count;
} Layout;

/* Hits on surfaces, n of them. */
typedef struct {
  const int32_t *primitive, *slots;
  const float *u, *v;
  int64_t n;
} Hits;

static inline Vec point_at(const Layout *layout, int32_t primitive, float u, float v)
{
  WITHIN(primitive, layout->triangles);
  const float *corner = layout->corners + 9 * (int64_t)primitive;
  float p[3];
  for (int axis = 0; axis < 3; axis++) {
    float origin = corner[axis];
    p[axis] = origin + u * (corner[3 + axis] - origin) + v * (corner[6 + axis] - origin);
  }
  return (Vec){p[0], p[1], p[2]};
}

static inline Vec face_of(const Layout *layout, int32_t primitive, int32_t slot)
{
  return mul(load(layout->cells[primitive].normal, 0), slot & 1 ? 1.0f : -1.0f);
}

/* A point a little above the surface: by group_lift of a texel's side over small triangles, by cell_lift over a flat cell. */
static inline Vec lifted(const Layout *layout, const Hits *hits, int64_t i, const float *lifts)
{
  int32_t primitive = hits->primitive[i], slot = hits->slots[i];
  Vec point = point_at(layout, primitive, hits->u[i], hits->v[i]);
  float lift = layout->cells[primitive].size * ((slot >> 1) < layout->groups ? lifts[0] : lifts[1]);
  return add(point, mul(face_of(layout, primitive, slot), lift));
}

static inline double held(double x, double low, double high)
{
  return x < low ? low : (x > high ? high : x);
}

/* Where cells of an axis begin, as a share of the edge. */
static double cell_start(const Axis *axis, int64_t index)
{
  double t = (double)index / axis->cells;
  if (axis->warped) {
    t = (sinh((double)axis->low + (double)axis->span * t) - (double)axis->start) / (double)axis->scale;
  }
  return held(t, 0.0, 1.0);
}

/* The last of rising numbers [first, last) that is not above target; first if all are. */
static int64_t last_below(const double *sums, int64_t first, int64_t last, double target)
{
  while (last - first > 1) {
    int64_t middle = first + (last - first) / 2;
    if (sums[middle] <= target) {
      first = middle;
    } else {
      last = middle;
    }
  }
  return first;
}

/* What one slot's samples share: a cell of a triangle, cut by the triangle's long edge, or a group. */
typedef struct {
  int64_t triangle, first, last;
  double a0, width, b0, height, limit, x1, x2, h1, slope, area;
} Place;

static Place place_of(const Layout *layout, int32_t slot)
{
  Place place;
  memset(&place, 0, sizeof place);
  if (slot < layout->groups) {
    place.triangle = -1;
    place.first = layout->group_starts[slot];
    place.last = layout->group_starts[slot + 1];
    return place;
  }
  int64_t first = 0, last = layout->own;
  WITHIN(0, last);
  while (last - first > 1) {
    int64_t middle = first + (last - first) / 2;
    if (layout->own_starts[middle] <= slot) {
      first = middle;
    } else {
      last = middle;
    }
  }
  place.triangle = layout->own_triangles[first];
  WITHIN(place.triangle, layout->triangles);
  const Cells *cells = layout->cells + place.triangle;
  int64_t local = slot - layout->own_starts[first], column = local / cells->stride, row = local % cells->stride;
  place.a0 = cell_start(&cells->a, column);
  place.b0 = cell_start(&cells->b, row);
  double width = cell_start(&cells->a, column + 1) - place.a0, height = cell_start(&cells->b, row + 1) - place.b0;
  place.width = width > 1e-9 ? width : 1e-9;
  place.height = height > 1e-9 ? height : 1e-9;
  double limit = 1.0 - place.a0 - place.b0;
  place.limit = limit > 1e-9 ? limit : 1e-9;
  place.x1 = held((place.limit - place.height) / place.width, 0.0, 1.0);
  place.x2 = held(place.limit / place.width, place.x1, 1.0);
  place.h1 = held((place.limit - place.x1 * place.width) / place.height, 0.0, 1.0);
  place.slope = place.width / place.height;
  double run = place.x2 - place.x1;
  place.area = place.x1 + run * place.h1 - 0.5 * place.slope * run * run;
  return place;
}

/* A point of the place, as a primitive with Embree's barycentrics. */
static inline void point_of(const Layout *layout, const Place *place, float xi0, float xi1, int32_t *primitive, float *u, float *v)
{
  float a, b;
  int64_t triangle = place->triangle;
  if (triangle < 0) {
    const double *sums = layout->member_sums;
    double low = sums[place->first], target = low + xi0 * (sums[place->last] - low);
    int64_t index = last_below(sums, place->first, place->last, target);
    WITHIN(index, layout->member_count);
    /* What is left of the first number within the chosen triangle is again uniform. */
    double root = sqrt(held((target - sums[index]) / (sums[index + 1] - sums[index]), 0.0, 1.0 - 1e-7));
    triangle = layout->members[index];
    a = (float)(1.0 - root);
    b = (float)(root * xi1);
  } else {
    double target = xi0 * place->area, beyond = target - place->x1, x = target;
    if (beyond > 0.0) {
      double square = place->h1 * place->h1 - 2.0 * place->slope * beyond, sum = place->h1 + sqrt(square > 0.0 ? square : 0.0);
      x = place->x1 + 2.0 * beyond / (sum > 1e-12 ? sum : 1e-12);
    }
    x = held(x, 0.0, place->x2);
    double y = xi1 * held((place->limit - x * place->width) / place->height, 0.0, 1.0);
    a = (float)(place->a0 + place->width * x);
    b = (float)(place->b0 + place->height * y);
  }
  WITHIN(triangle, layout->triangles);
  int corner = layout->cells[triangle].corner;
  float rest = 1.0f - a - b;
  *primitive = (int32_t)triangle;
  *u = corner == 0 ? a : (corner == 1 ? rest : b);
  *v = corner == 0 ? b : (corner == 1 ? a : rest);
}

/* Points (m, n) on texels with slots (n,): by numbers (m, 2) shifted on the torus by shifts (n, 2); where accepted (n, kept) is 0 (NULL:
   nowhere) the texel's seed. Their world positions and the normals (m, n, 3) of the sides are left out where points is NULL. */
EXPORT void KERNEL(texel_points)(const Layout *layout, int64_t m, const float *numbers, int64_t n, const float *shifts,
                                 const int32_t *slots, int64_t kept, const uint8_t *accepted, const int32_t *seed_primitive,
                                 const float *seed_u, const float *seed_v, int32_t *primitive, float *u, float *v, float *points,
                                 float *faces)
{
  for (int64_t i = 0; i < n; i++) {
    Place place = place_of(layout, slots[i] >> 1);
    for (int64_t k = 0; k < m; k++) {
      int64_t at = k * n + i;
      if (!accepted || accepted[i * kept + k]) {
        float xi0 = wrapped(numbers[2 * k] + shifts[2 * i]), xi1 = wrapped(numbers[2 * k + 1] + shifts[2 * i + 1]);
        point_of(layout, &place, xi0, xi1, primitive + at, u + at, v + at);
      } else {
        primitive[at] = seed_primitive[i];
        u[at] = seed_u[i];
        v[at] = seed_v[i];
      }
      if (points) {
        store(points, at, point_at(layout, primitive[at], u[at], v[at]));
        store(faces, at, face_of(layout, primitive[at], slots[i]));
      }
    }
  }
}

/* Cosine-distributed rays (r, n) of n texels, by numbers (r, 2) shifted on the torus by shifts (n, 2); ray k of each leaves from its
   point k modulo p: points with shading and face normals (p, n, 3). Gives all directions (r, n, 3) and the density (r, n) of each ray
   on what it met (0: nothing); of the hits their rows (found), primitive, u, v, slots and cosines to the front's normal; the rows that
   escaped, and in counts how many hit, escaped, and were traced: a ray into the surface that it leaves is not, and sees nothing.
   Neighbouring texels' rays go as a packet. */
EXPORT void KERNEL(texel_rays)(const Tracer *tracer, const Layout *layout, int64_t r, const float *numbers, int64_t n,
                               const float *shifts, int64_t p, const float *points, const float *shading, const float *faces,
                               float *directions, float *density, int64_t *found, int32_t *primitive, float *u, float *v,
                               int32_t *hit_slots, float *cosines, int64_t *escaped, int64_t *counts)
{
  int64_t hit = 0, missed = 0, traced = 0;
  _Alignas(32) int valid[LANES];
  RayHit8 hits;
  memset(&hits, 0, sizeof hits);
  for (int lane = 0; lane < LANES; lane++) {
    hits.ray.mask[lane] = NOTHING;
  }
  memset(density, 0, (size_t)(r * n) * sizeof *density);
  for (int64_t k = 0; k < r; k++) {
    for (int64_t start = 0; start < n; start += LANES) {
      int64_t lanes = n - start < LANES ? n - start : LANES;
      float cosine[LANES];
      int any = 0;
      for (int64_t lane = 0; lane < LANES; lane++) {
        valid[lane] = 0;
        if (lane >= lanes) {
          continue;
        }
        int64_t texel = start + lane, from = k % p * n + texel;
        Vec local = cosine_hemisphere(wrapped(numbers[2 * k] + shifts[2 * texel]),
                                      wrapped(numbers[2 * k + 1] + shifts[2 * texel + 1]));
        Vec direction = about(load(shading, from), local), face = load(faces, from);
        store(directions, k * n + texel, direction);
        cosine[lane] = local.z;
        if (!(dot(face, direction) > 0.0f)) {
          continue;
        }
        Vec origin = off_surface(load(points, from), face, direction, 0.0f);
        hits.ray.org[0][lane] = origin.x;
        hits.ray.org[1][lane] = origin.y;
        hits.ray.org[2][lane] = origin.z;
        hits.ray.dir[0][lane] = direction.x;
        hits.ray.dir[1][lane] = direction.y;
        hits.ray.dir[2][lane] = direction.z;
        hits.ray.tfar[lane] = INFINITE;
        hits.primitive[lane] = hits.geometry[lane] = hits.instance[lane] = NOTHING;
        valid[lane] = -1;
        any++;
      }
      if (!any) {
        continue;
      }
      traced += any;
      tracer->intersect8(valid, tracer->scene, &hits, NULL);
      for (int64_t lane = 0; lane < lanes; lane++) {
        int64_t row = k * n + start + lane;
        if (!valid[lane]) {
          continue;
        }
        if (hits.geometry[lane] == NOTHING) {
          escaped[missed++] = row;
          continue;
        }
        WITHIN(hits.primitive[lane], layout->triangles);
        const Cells *here = layout->cells + hits.primitive[lane];
        float t = hits.ray.tfar[lane], met = dot(load(here->normal, 0), load(directions, row));
        density[row] = cosine[lane] * (float)(1.0 / 3.14159265358979323846) * fabsf(met) / largest(t * t, 1e-20f);
        found[hit] = row;
        primitive[hit] = (int32_t)hits.primitive[lane];
        u[hit] = hits.u[lane];
        v[hit] = hits.v[lane];
        cosines[hit] = met;
        hit_slots[hit++] = slot_of(here, hits.u[lane], hits.v[lane], met < 0.0f);
      }
    }
  }
  counts[0] = hit;
  counts[1] = missed;
  counts[2] = traced;
}

/* Texels (h,) of slots (h,) by first (slot_count,): -1 where there is none yet. Gives the rows whose texel is mixed (texels,), and how
   many have none; returns how many are mixed. */
EXPORT int64_t KERNEL(look_up)(int64_t slot_count, const int32_t *first, int64_t texels, const uint8_t *mixed, int64_t h,
                               const int32_t *slots, int32_t *texel, int64_t *open, int64_t *missing)
{
  int64_t count = 0, none = 0;
  for (int64_t i = 0; i < h; i++) {
    WITHIN(slots[i], slot_count);
    int32_t index = texel[i] = first[slots[i]];
    if (index < 0) {
      none++;
      continue;
    }
    WITHIN(index, texels);
    open[count] = i;
    count += mixed[index];
  }
  *missing = none;
  return count;
}

/* Whether anything is close above the surface at rows (k,) of hits (NULL: the first k): within reach[0] of a texel's side, or, where
   emissive of a material, by material of triangles, is not NULL, an emitter within reach[1]. */
EXPORT void KERNEL(covered)(const Tracer *tracer, const Layout *layout, const float *reach, const int32_t *material,
                            int64_t materials, const uint8_t *emissive, const Hits *hits, int64_t k, const int64_t *rows,
                            uint8_t *result)
{
  RayHit hit;
  Shadows shadows;
  clear(&shadows);
  memset(&hit, 0, sizeof hit);
  for (int64_t i = 0; i <= k; i++) {
    if (i < k) {
      int64_t row = rows ? rows[i] : i;
      WITHIN(row, hits->n);
      int32_t primitive = hits->primitive[row];
      Vec point = point_at(layout, primitive, hits->u[row], hits->v[row]), normal = face_of(layout, primitive, hits->slots[row]);
      float size = layout->cells[primitive].size;
      point = off_surface(point, normal, normal, 0.0f);
      if (emissive) {
        nearest(tracer, &hit, point, normal, reach[1] * size);
        result[i] = hit.geometry != NOTHING;
        if (result[i] && hit.ray.tfar > reach[0] * size) {
          WITHIN(material[hit.primitive], materials);
          result[i] = emissive[material[hit.primitive]] != 0;
        }
        continue;
      }
      put(&shadows, point, normal, smallest(reach[0] * size, INFINITE), i);
      if (shadows.waiting < LANES) {
        continue;
      }
    }
    int count = sent(tracer, &shadows);
    for (int lane = 0; lane < count; lane++) {
      result[shadows.which[lane]] = shadows.ray.tfar[lane] < 0.0f;
    }
  }
}

/* Which of rows (k,) of hits (NULL: the first k), covered (k,) or not, do not belong to the texel (hits,) of seeds that they lie on,
   from which they are hidden, or covered otherwise than it. Returns how many rays that took. */
EXPORT int64_t KERNEL(apart)(const Tracer *tracer, const Layout *layout, const float *lifts, float segment, const Hits *hits,
                             int64_t k, const int64_t *rows, const uint8_t *covered, const int32_t *texel, const Hits *seeds,
                             const uint8_t *seeds_covered, int32_t from_seed, uint8_t *result)
{
  int64_t rays = 0;
  Shadows shadows;
  clear(&shadows);
  for (int64_t i = 0; i <= k; i++) {
    if (i < k) {
      int64_t row = rows ? rows[i] : i;
      WITHIN(row, hits->n);
      int64_t seed = texel[row];
      WITHIN(seed, seeds->n);
      result[i] = covered[i] != seeds_covered[seed];
      if (result[i]) {
        continue;
      }
      rays++;
      Vec hit = lifted(layout, hits, row, lifts), base = lifted(layout, seeds, seed, lifts);
      Vec start = from_seed ? base : hit, direction = sub(from_seed ? hit : base, start);
      if (!(dot(direction, direction) > 0.0f)) {
        continue;
      }
      put(&shadows, start, direction, segment, i);
      if (shadows.waiting < LANES) {
        continue;
      }
    }
    int count = sent(tracer, &shadows);
    for (int lane = 0; lane < count; lane++) {
      result[shadows.which[lane]] = shadows.ray.tfar[lane] < 0.0f;
    }
  }
  return rays;
}
