/* Surfaces at hits: twins of Geometry.points, Surfaces.shading_normal and the tables of Surfaces in transport/surfaces. */

#include "rtgi.h"

/* World points (n, 3) at Embree's barycentrics on triangles (t, 3, 3). */
EXPORT void KERNEL(points)(int64_t triangles, const float *corners, int64_t n, const int32_t *primitive, const float *u,
                           const float *v, float *points)
{
  for (int64_t i = 0; i < n; i++) {
    WITHIN(primitive[i], triangles);
    const float *corner = corners + 9 * (int64_t)primitive[i];
    for (int axis = 0; axis < 3; axis++) {
      float origin = corner[axis];
      points[3 * i + axis] = origin + u[i] * (corner[3 + axis] - origin) + v[i] * (corner[6 + axis] - origin);
    }
  }
}

/* Unit shading normals (n, 3) where smooth (mesh triangles,); the others' are those of their triangles. */
EXPORT void KERNEL(shading_normals)(int64_t triangles, const float *normals, const int32_t *mesh_triangle, const int32_t *instance,
                                    int64_t mesh_triangles, const uint8_t *smooth, const float *corner_normals, int64_t instances,
                                    const float *matrices, int64_t n, const int32_t *primitive, const float *u, const float *v,
                                    float *out)
{
  for (int64_t i = 0; i < n; i++) {
    WITHIN(primitive[i], triangles);
    Vec normal = load(normals, primitive[i]);
    int64_t local = mesh_triangle[primitive[i]];
    WITHIN(local, mesh_triangles);
    if (smooth[local]) {
      const float *corner = corner_normals + 9 * local;
      float w = 1.0f - u[i] - v[i];
      Vec mean = add(add(mul(load(corner, 0), w), mul(load(corner, 1), u[i])), mul(load(corner, 2), v[i]));
      WITHIN(instance[primitive[i]], instances);
      const float *matrix = matrices + 9 * (int64_t)instance[primitive[i]];
      Vec world = {dot(load(matrix, 0), mean), dot(load(matrix, 1), mean), dot(load(matrix, 2), mean)};
      float length = sqrtf(dot(world, world));
      if (length > 0.0f) {
        normal = divided(world, largest(length, 1e-30f));
      }
    }
    store(out, i, normal);
  }
}

enum { BYTES, HALVES, FLOATS };
enum { REPEAT, MIRROR, CLIP, EXTEND };

/* An image of four components a texel, and how it is read: component -1 for all three colours, else one of r, g, b, a. */
typedef struct {
  const void *texels;
  int64_t width, height;
  int32_t type, extension, closest, srgb, component, transformed;
  float transform[6];
  const float *uv;
  const float *attribute;
} LookUp;

#define SRGB_STEPS 4096
static float srgb_table[SRGB_STEPS + 2];

static float srgb_curve(float encoded)
{
  return encoded <= 0.04045f ? encoded * (1.0f / 12.92f)
                             : (float)pow((largest(encoded, 0.0f) + 0.055f) * (1.0f / 1.055f), 2.4f);
}

/* Call once, before threads do. */
EXPORT void KERNEL(prepare)(void)
{
  for (int i = 0; i <= SRGB_STEPS + 1; i++) {
    srgb_table[i] = (float)pow(((double)i / SRGB_STEPS + 0.055) / 1.055, (double)2.4f);
  }
}

static inline float linear_from_srgb(float encoded)
{
  if (encoded <= 0.04045f || encoded > 1.0f) {
    return srgb_curve(encoded);
  }
  /* Between the curve's values at 1/4096 a chord is off by 2e-8. */
  float at = encoded * SRGB_STEPS;
  int step = (int)at;
  float share = at - (float)step;
  return srgb_table[step] + share * (srgb_table[step + 1] - srgb_table[step]);
}

static inline float half_to_float(uint16_t half)
{
  uint32_t exponent = (half >> 10) & 31u, mantissa = half & 1023u, sign = (uint32_t)(half & 0x8000u) << 16, bits;
  float value;
  if (exponent == 0) {
    value = (float)mantissa * 0x1p-24f;
    return sign ? -value : value;
  }
  bits = sign | (exponent == 31 ? 0x7F800000u : (exponent + 112u) << 23) | (mantissa << 13);
  memcpy(&value, &bits, sizeof value);
  return value;
}

static inline int64_t brought_inside(int64_t index, int64_t size, int extension, int *inside)
{
  if (extension == REPEAT) {
    int64_t rest = (size & (size - 1)) == 0 ? (index & (size - 1)) : index % size;
    return rest < 0 ? rest + size : rest;
  }
  if (extension == MIRROR) {
    int64_t period = index % (2 * size);
    period = period < 0 ? period + 2 * size : period;
    return period < size ? period : 2 * size - 1 - period;
  }
  if (extension == CLIP && (index < 0 || index >= size)) {
    *inside = 0;
  }
  return index < 0 ? 0 : (index > size - 1 ? size - 1 : index);
}

/* As a cast to int64 from a finite float; far beyond any image it does not matter where. */
static inline int64_t whole(float x)
{
  return x > -9e15f && x < 9e15f ? (int64_t)x : 0;
}

static inline void add_texel(const LookUp *look, float column, float row, float weight, float *value)
{
  int inside = 1;
  int64_t x = brought_inside(whole(column), look->width, look->extension, &inside);
  int64_t y = brought_inside(whole(row), look->height, look->extension, &inside);
  int64_t at = 4 * (y * look->width + x);
  WITHIN(at, 4 * look->width * look->height);
  if (!inside) {
    return;
  }
  if (look->type == BYTES) {
    const uint8_t *texel = (const uint8_t *)look->texels + at;
    weight *= 1.0f / 255.0f;
    for (int k = 0; k < 4; k++) {
      value[k] += (float)texel[k] * weight;
    }
  } else if (look->type == HALVES) {
    const uint16_t *texel = (const uint16_t *)look->texels + at;
    for (int k = 0; k < 4; k++) {
      value[k] += half_to_float(texel[k]) * weight;
    }
  } else {
    const float *texel = (const float *)look->texels + at;
    for (int k = 0; k < 4; k++) {
      value[k] += texel[k] * weight;
    }
  }
}

/* Twin of TextureSampler.sample. */
static Vec texture(const LookUp *look, float u, float v)
{
  float value[4] = {0, 0, 0, 0}, x = u * (float)look->width, y = v * (float)look->height;
  if (look->closest) {
    add_texel(look, floorf(x), floorf(y), 1.0f, value);
  } else {
    x -= 0.5f;
    y -= 0.5f;
    float column = floorf(x), row = floorf(y), fx = x - column, fy = y - row, gx = 1.0f - fx, gy = 1.0f - fy;
    add_texel(look, column, row, gx * gy, value);
    add_texel(look, column + 1.0f, row, fx * gy, value);
    add_texel(look, column, row + 1.0f, gx * fy, value);
    add_texel(look, column + 1.0f, row + 1.0f, fx * fy, value);
  }
  if (look->component >= 0) {
    float one = value[look->component];
    one = look->srgb && look->component != 3 ? linear_from_srgb(one) : one;
    return (Vec){one, one, one};
  }
  if (look->srgb) {
    return (Vec){linear_from_srgb(value[0]), linear_from_srgb(value[1]), linear_from_srgb(value[2])};
  }
  return (Vec){value[0], value[1], value[2]};
}

/* Values (n, 3) of a material's input on triangles: constants (faces, 3), or where group (faces,) is not -1 factors (faces, 3) times
   what looks[group] reads, plus offsets (faces, 3), held within low and high. face (n,), or NULL: of_triangle (t,) says it. Twin of
   _Table.evaluate in transport/surfaces/materials.py. */
EXPORT void KERNEL(surface_values)(int64_t faces, const float *constants, const float *factors, const float *offsets,
                                   const int32_t *group, int64_t groups, const LookUp *looks, float low, float high,
                                   int64_t triangles, const int32_t *mesh_triangle, int64_t mesh_triangles,
                                   const int32_t *of_triangle, int64_t n, const int32_t *face, const int32_t *primitive,
                                   const float *u, const float *v, float *out)
{
  for (int64_t i = 0; i < n; i++) {
    WITHIN(primitive[i], triangles);
    int64_t side = face ? face[i] : of_triangle[primitive[i]];
    WITHIN(side, faces);
    if (group[side] < 0) {
      store(out, i, load(constants, side));
      continue;
    }
    WITHIN(group[side], groups);
    const LookUp *look = looks + group[side];
    Vec value = load(factors, side);
    int64_t local = mesh_triangle[primitive[i]];
    WITHIN(local, mesh_triangles);
    float w = 1.0f - u[i] - v[i];
    if (look->texels) {
      const float *corner = look->uv + 6 * local;
      float s = w * corner[0] + u[i] * corner[2] + v[i] * corner[4], t = w * corner[1] + u[i] * corner[3] + v[i] * corner[5];
      if (look->transformed) {
        const float *m = look->transform;
        float turned = s * m[0] + t * m[1] + m[2];
        t = s * m[3] + t * m[4] + m[5];
        s = turned;
      }
      Vec read = texture(look, s, t);
      value = (Vec){value.x * read.x, value.y * read.y, value.z * read.z};
    }
    if (look->attribute) {
      const float *corner = look->attribute + 9 * local;
      Vec read = add(add(mul(load(corner, 0), w), mul(load(corner, 1), u[i])), mul(load(corner, 2), v[i]));
      value = (Vec){value.x * read.x, value.y * read.y, value.z * read.z};
    }
    value = add(value, load(offsets, side));
    store(out, i, (Vec){clamped(value.x, low, high), clamped(value.y, low, high), clamped(value.z, low, high)});
  }
}
