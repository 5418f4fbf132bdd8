/* Direct light of lamps with shadow rays: twin of Sources.irradiance in transport/paths/sources.py over the samples of the kinds of
   lamps in transport/lights (sun.py, point.py, spot.py, area.py with area_sampling.py), which say where their formulas are from. */

#include "sampling.h"
#include "tracer.h"

enum { SUN, POINT, SPOT, AREA };

/* A lamp of any kind. A sun's position is its direction of travel and its radius 1 - cos of half its angle; soft is a point's or
   spot's soft falloff, and that an area is an ellipse. */
typedef struct {
  int32_t kind, casts_shadow, soft, unused;
  float position[3], strength[3], radius;
  float local_from_world[9], cos_half_cone, inverse_blend;
  float u[3], v[3], normal[3], a, b, shear, tan_half_spread, spread_gain;
} Lamp;

typedef struct {
  Vec direction, irradiance;
  float distance;
} Sample;

static Vec in_cone(Vec axis, float one_minus_cos, float u0, float u1, float *cosine)
{
  float x, y;
  disk_from_square(u0, u1, &x, &y);
  float squared = x * x + y * y;
  *cosine = 1.0f - squared * one_minus_cos;
  float scale = sqrtf(largest(one_minus_cos * (2.0f - one_minus_cos * squared), 0.0f));
  x *= scale;
  y *= scale;
  Vec tangent, bitangent;
  frame(axis, &tangent, &bitangent);
  return normalized(add(add(mul(tangent, x), mul(bitangent, y)), mul(axis, *cosine)));
}

static Sample sun_sample(const Lamp *lamp, float u0, float u1)
{
  Vec direction = mul(load(lamp->position, 0), -1.0f);
  float cosine;
  if (lamp->radius > 0.0f) {
    direction = in_cone(direction, lamp->radius, u0, u1, &cosine);
  }
  return (Sample){direction, mul(load(lamp->strength, 0), 2.0f / (2.0f - lamp->radius)), INFINITY};
}

static float spot_attenuation(const Lamp *lamp, Vec direction)
{
  const float *m = lamp->local_from_world;
  float x = dot(load(m, 0), direction), y = dot(load(m, 1), direction), z = dot(load(m, 2), direction);
  float cosine = z / sqrtf(largest(x * x + y * y + z * z, TINY_F));
  float t = clamped((cosine - lamp->cos_half_cone) * lamp->inverse_blend, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

static Sample point_sample(const Lamp *lamp, Vec point, float u0, float u1)
{
  Vec towards = sub(load(lamp->position, 0), point);
  float squared = largest(dot(towards, towards), 1e-12f), d = sqrtf(squared), r = lamp->radius;
  Sample sample = {divided(towards, d), {0, 0, 0}, d};
  float factor = 1.0f / squared;
  if (r > 0.0f && lamp->soft) {
    float x, y;
    disk_from_square(u0, u1, &x, &y);
    x *= r;
    y *= r;
    Vec tangent, bitangent;
    frame(sample.direction, &tangent, &bitangent);
    Vec away = add(add(towards, mul(tangent, x)), mul(bitangent, y));
    float away_squared = d * d + x * x + y * y, length = sqrtf(away_squared);
    sample.direction = divided(away, length);
    sample.distance = length;
    factor = d / (length * away_squared);
  } else if (r > 0.0f) {
    float ratio = (r / d) * (r / d), cosine;
    float spread = ratio < 1.0f ? ratio / (1.0f + sqrtf(largest(1.0f - ratio, 0.0f))) : 2.0f;
    sample.direction = in_cone(sample.direction, spread, u0, u1, &cosine);
    float along = d * cosine, chord = sqrtf(largest(r * r - d * d + along * along, 0.0f));
    sample.distance = largest(along + (r < d ? -chord : chord), 0.0f);
    factor = 2.0f * spread / (r * r);
  }
  sample.irradiance = mul(load(lamp->strength, 0), factor);
  /* As in Cycles, the cone does not apply inside the lamp's own sphere. */
  if (lamp->kind == SPOT && !(r > 0.0f && !lamp->soft && squared <= r * r)) {
    sample.irradiance = mul(sample.irradiance, spot_attenuation(lamp, sample.direction));
  }
  return sample;
}

static double unit_clamped(double x)
{
  return x < -1.0 ? -1.0 : (x > 1.0 ? 1.0 : x);
}

/* Ureña's map: a point on the rectangle [x0, x1] x [y0, y1] at depth z below the origin; returns its solid angle. */
static float by_solid_angle(float fx0, float fx1, float fy0, float fy1, float fz, float u0, float u1, float *px, float *py)
{
  double x0 = fx0, x1 = fx1, y0 = fy0, y1 = fy1, z = -(double)fz, zz = z * z;
  double n0 = -y0 / sqrt(y0 * y0 + zz), n1 = x1 / sqrt(x1 * x1 + zz), n2 = y1 / sqrt(y1 * y1 + zz), n3 = -x0 / sqrt(x0 * x0 + zz);
  double g0 = asin(unit_clamped(-n0 * n1)), g1 = asin(unit_clamped(-n1 * n2));
  double g2 = asin(unit_clamped(-n2 * n3)), g3 = asin(unit_clamped(-n3 * n0));
  double solid_angle = -(g0 + g1 + g2 + g3);
  solid_angle = solid_angle > 0.0 ? solid_angle : 0.0;
  double angle = u0 * solid_angle + (g2 + g3), sine = sin(angle);
  double fu = (cos(angle) * n0 + n2) / (sine == 0.0 ? 1e-300 : sine);
  double cu = unit_clamped(copysign(1.0 / sqrt(fu * fu + n0 * n0), fu));
  double root = sqrt(1.0 - cu * cu), x = -(cu * z) / (root > 1e-15 ? root : 1e-15);
  x = x < x0 ? x0 : (x > x1 ? x1 : x);
  double depth = x * x + zz, h0 = y0 / sqrt(depth + y0 * y0), h1 = y1 / sqrt(depth + y1 * y1);
  double hv = h0 + u1 * (h1 - h0), rest = 1.0 - hv * hv, y = hv * sqrt(depth / (rest > 1e-15 ? rest : 1e-15));
  *px = (float)x;
  *py = (float)(y < y0 ? y0 : (y > y1 ? y1 : y));
  return (float)solid_angle;
}

static Sample area_sample(const Lamp *lamp, Vec point, float u0, float u1)
{
  Vec towards = sub(load(lamp->position, 0), point), lu = load(lamp->u, 0), lv = load(lamp->v, 0), normal = load(lamp->normal, 0);
  float x = dot(towards, lu), y = dot(towards, lv), z = -dot(towards, normal), px = 0.0f, py = 0.0f, weight;
  float a = lamp->a, b = lamp->b, shear = lamp->shear, spread = lamp->tan_half_spread;
  int ellipse = lamp->soft;
  if (spread == 0.0f) {
    float t = -y / b, s = (-x - lamp->shear * b * t) / a;
    int inside = ellipse ? s * s + t * t <= 1.0f : fabsf(s) <= 1.0f && fabsf(t) <= 1.0f;
    weight = inside && z > 0.0f ? PI_F : 0.0f;
  } else {
    float x0 = x - a, x1 = x + a, y0 = y - b, y1 = y + b;
    if (isfinite(spread) && shear == 0.0f && z > 0.0f) {
      /* Only the part of the lamp within the beam's reach lights the point: sample its bounding rectangle. */
      float reach = z * spread;
      x0 = largest(x0, -reach);
      x1 = smallest(x1, reach);
      y0 = largest(y0, -reach);
      y1 = smallest(y1, reach);
    }
    float width = largest(x1 - x0, 0.0f), height = largest(y1 - y0, 0.0f), rectangle = width * height;
    int as_ellipse = ellipse && (PI_F * a * b <= rectangle || shear != 0.0f), whole = as_ellipse || shear != 0.0f;
    float area = as_ellipse ? PI_F * a * b : rectangle;
    float cx = 0.5f * (x0 + x1), cy = 0.5f * (y0 + y1);
    int near = !ellipse && !whole && z > 0.0f && rectangle > 0.0f &&
               cx * cx + cy * cy + z * z < 16.0f * (width * width + height * height);
    float s = 2.0f * u0 - 1.0f, t = 2.0f * u1 - 1.0f;
    if (near) {
      weight = by_solid_angle(x0, x1, y0, y1, z, u0, u1, &px, &py);
    } else {
      px = cx + 0.5f * width * s;
      py = cy + 0.5f * height * t;
      if (as_ellipse) {
        disk_from_square(u0, u1, &s, &t);
      }
      if (whole) {
        px = x + a * s + shear * b * t;
        py = y + b * t;
      }
      float squared = largest(px * px + py * py + z * z, TINY_F);
      weight = area * z / (squared * sqrtf(squared));
    }
    int lit = z > 0.0f && area > 0.0f;
    if (ellipse && !as_ellipse) {
      float dx = (px - x) / a, dy = (py - y) / b;
      lit = lit && dx * dx + dy * dy <= 1.0f;
    }
    if (isfinite(spread)) {
      float tangent = sqrtf(px * px + py * py) / (z > 0.0f ? z : 1.0f);
      weight *= largest((spread - tangent) * lamp->spread_gain, 0.0f);
    }
    weight = lit ? weight : 0.0f;
  }
  float distance = sqrtf(largest(px * px + py * py + z * z, TINY_F));
  Vec direction = divided(sub(add(mul(lu, px), mul(lv, py)), mul(normal, z)), distance);
  return (Sample){direction, mul(load(lamp->strength, 0), weight), distance};
}

static inline Sample lamp_sample(const Lamp *lamp, Vec point, float u0, float u1)
{
  switch (lamp->kind) {
  case SUN:
    return sun_sample(lamp, u0, u1);
  case AREA:
    return area_sample(lamp, point, u0, u1);
  default:
    return point_sample(lamp, point, u0, u1);
  }
}

/* Samples of lamps, alone: directions (n, 3), distances (n,) and irradiance (n, 3) on planes that face them. Lamp source for all, or
   sources (n,). */
EXPORT void KERNEL(sample_lamps)(int64_t lamps, const Lamp *table, int64_t n, int32_t source, const int32_t *sources,
                                 const float *points, const float *uv, float *directions, float *distances, float *irradiance)
{
  for (int64_t i = 0; i < n; i++) {
    int32_t index = sources ? sources[i] : source;
    WITHIN(index, lamps);
    Sample sample = lamp_sample(table + index, load(points, i), uv[2 * i], uv[2 * i + 1]);
    store(directions, i, sample.direction);
    distances[i] = sample.distance;
    store(irradiance, i, sample.irradiance);
  }
}

/* One sample (n, 3) of the shadowed irradiance of lamp source, or sources (n,), at points with shading normals and face normals
   (n, 3), which rays found from reach (n,) away (NULL: 0). uv (n, 2), NULL for lamps that need none, is shifted by turn on the torus.
   Adds to light if adds. Returns how many shadow rays it took: points that follow one another lie close together, and go as a
   packet. */
EXPORT int64_t KERNEL(lamp_light)(const Tracer *tracer, int64_t lamps, const Lamp *table, int64_t n, int32_t source,
                                  const int32_t *sources, const float *points, const float *normals, const float *faces,
                                  const float *reach, const float *uv, float turn, int32_t adds, float *light)
{
  int64_t rays = 0;
  Shadows shadows;
  Vec arriving[LANES];
  clear(&shadows);
  if (!adds) {
    memset(light, 0, (size_t)(3 * n) * sizeof *light);
  }
  for (int64_t i = 0; i <= n; i++) {
    if (i < n) {
      int32_t index = sources ? sources[i] : source;
      WITHIN(index, lamps);
      const Lamp *lamp = table + index;
      Vec point = load(points, i), face = load(faces, i);
      float u0 = uv ? uv[2 * i] : 0.0f, u1 = uv ? uv[2 * i + 1] : 0.0f;
      if (turn != 0.0f) {
        u0 = wrapped(u0 + turn);
        u1 = wrapped(u1 + turn);
      }
      Sample sample = lamp_sample(lamp, point, u0, u1);
      float cosine = dot(load(normals, i), sample.direction);
      if (!(cosine > 0.0f && dot(face, sample.direction) > 0.0f &&
            sample.irradiance.x + sample.irradiance.y + sample.irradiance.z > 0.0f)) {
        continue;
      }
      if (!lamp->casts_shadow) {
        store(light, i, add(load(light, i), mul(sample.irradiance, cosine)));
        continue;
      }
      Vec origin = off_surface(point, face, sample.direction, reach ? reach[i] : 0.0f);
      arriving[shadows.waiting] = mul(sample.irradiance, cosine);
      put(&shadows, origin, sample.direction, short_of(sample.distance), i);
      if (shadows.waiting < LANES) {
        continue;
      }
    }
    int count = sent(tracer, &shadows);
    rays += count;
    for (int lane = 0; lane < count; lane++) {
      int64_t row = shadows.which[lane];
      if (shadows.ray.tfar[lane] >= 0.0f) {
        store(light, row, add(load(light, row), arriving[lane]));
      }
    }
  }
  return rays;
}
