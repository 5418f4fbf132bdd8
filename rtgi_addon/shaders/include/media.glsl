// Media (preview/media_tables.py): what is where, what it takes along a way, how it scatters. The twin of transport/media.
#include "include/list.glsl"

#define MEDIA_TEXELS 12
#define MEDIA_PI 3.14159265359
// Steps through a grid on the way to a lamp, at most.
#define MEDIA_STEPS 32
// Distances beyond are infinite.
#define MEDIA_FAR 1e9

struct Coefficients {
  vec3 scattering;
  vec3 absorption;
  vec3 emission;
};

vec4 medium_texel(int medium, int part)
{
  return list_texel(media_table, medium, MEDIA_TEXELS, part);
}

bool medium_seen(int medium)
{
  return medium_texel(medium, 1).w != 0.0;
}

vec3 medium_local(int medium, vec4 place)
{
  return vec3(dot(medium_texel(medium, 3), place), dot(medium_texel(medium, 4), place), dot(medium_texel(medium, 5), place));
}

// Where a ray is inside, from 0 to `limit`; x > y where it is not.
vec2 medium_span(int medium, vec3 origin, vec3 direction, float limit)
{
  if (medium_texel(medium, 0).w == 0.0) {
    return vec2(0.0, limit);
  }
  vec3 from = medium_local(medium, vec4(origin, 1.0));
  vec3 along = medium_local(medium, vec4(direction, 0.0));
  vec2 span = vec2(0.0, limit);
  for (int axis = 0; axis < 3; axis++) {
    if (abs(along[axis]) < 1e-20) {
      span = abs(from[axis]) > 1.0 ? vec2(1.0, 0.0) : span;
      continue;
    }
    vec2 t = (vec2(-1.0, 1.0) - from[axis]) / along[axis];
    span = vec2(max(span.x, min(t.x, t.y)), min(span.y, max(t.x, t.y)));
  }
  return span;
}

vec3 media_cell(int index)
{
  return list_texel(media_cells, index, 1, 0).rgb;
}

// Between the eight cells about a place, of those that begin at `first`; 1 where there are none.
vec3 medium_factor(int first, ivec3 resolution, vec3 local)
{
  if (first < 0) {
    return vec3(1.0);
  }
  vec3 place = clamp((local + 1.0) * (0.5 * vec3(resolution)) - 0.5, vec3(0.0), vec3(resolution - 1));
  ivec3 low = min(ivec3(place), max(resolution - 2, ivec3(0)));
  vec3 part = place - vec3(low);
  ivec3 high = min(low + 1, resolution - 1);
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    ivec3 bit = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    ivec3 at = low + bit * (high - low);
    vec3 share = mix(1.0 - part, part, vec3(bit));
    sum += media_cell(first + (at.z * resolution.y + at.y) * resolution.x + at.x) * (share.x * share.y * share.z);
  }
  return sum;
}

// Of a medium at a point that it fills.
Coefficients medium_at(int medium, vec3 point)
{
  Coefficients result;
  result.scattering = medium_texel(medium, 0).rgb;
  result.absorption = medium_texel(medium, 1).rgb;
  result.emission = medium_texel(medium, 2).rgb;
  vec4 cells = medium_texel(medium, 6);
  if (cells.x > 0.0) {
    ivec3 resolution = ivec3(cells.xyz);
    vec2 others = medium_texel(medium, 7).xy;
    vec3 local = medium_local(medium, vec4(point, 1.0));
    vec3 factor = medium_factor(int(cells.w), resolution, local);
    result.scattering *= factor;
    result.absorption *= int(others.x) == int(cells.w) ? factor : medium_factor(int(others.x), resolution, local);
    result.emission *= medium_factor(int(others.y), resolution, local);
  }
  return result;
}

// At any point: nothing outside the medium's box.
Coefficients medium_there(int medium, vec3 point)
{
  if (medium_texel(medium, 0).w != 0.0) {
    vec3 local = abs(medium_local(medium, vec4(point, 1.0)));
    if (max(local.x, max(local.y, local.z)) > 1.0) {
      return Coefficients(vec3(0.0), vec3(0.0), vec3(0.0));
    }
  }
  return medium_at(medium, point);
}

// The share of light that all media leave on the way from `origin` to `distance` along the unit `direction`.
vec3 media_transmittance(int count, vec3 origin, vec3 direction, float distance)
{
  vec3 depth = vec3(0.0);
  for (int medium = 0; medium < count; medium++) {
    vec2 span = medium_span(medium, origin, direction, distance);
    if (span.y <= span.x) {
      continue;
    }
    vec3 extinction = medium_texel(medium, 0).rgb + medium_texel(medium, 1).rgb;
    float within = span.y - span.x;
    if (medium_texel(medium, 6).x == 0.0) {
      depth += extinction * min(within, MEDIA_FAR);
      continue;
    }
    int steps = clamp(int(ceil(within / medium_texel(medium, 7).z)), 1, MEDIA_STEPS);
    for (int k = 0; k < steps; k++) {
      float t = span.x + within * ((float(k) + 0.5) / float(steps));
      Coefficients here = medium_at(medium, origin + direction * t);
      depth += (here.scattering + here.absorption) * (within / float(steps));
    }
  }
  return exp(-depth);
}

float media_lobe(vec4 lobe, float cosine)
{
  float spread = 1.0 + lobe.y * lobe.y - 2.0 * lobe.y * cosine;
  return lobe.x * (1.0 - lobe.y * lobe.y) * (1.0 + lobe.z * cosine * cosine) / (4.0 * MEDIA_PI * lobe.w * spread * sqrt(spread));
}

// Fournier and Forand's (transport/media/phase.py).
float media_sea(vec3 terms, float cosine)
{
  float part = max(0.5 * (1.0 - cosine), 1e-7);
  float v = terms.y;
  float delta = terms.x * part;
  float rest = 1.0 - delta;
  float power = pow(delta, v);
  float lobe = (v * rest - (1.0 - power) + (delta * (1.0 - power) - v * rest) / part) /
               (4.0 * MEDIA_PI * rest * rest * power);
  if (abs(rest) < 2e-2) {
    lobe = v * (v - 1.0 - (v + 1.0) / part) / (8.0 * MEDIA_PI);
    lobe += v * (v + 1.0) * rest * (2.0 * (v - 1.0) - (2.0 * v + 1.0) / part) / (24.0 * MEDIA_PI);
  }
  return lobe + terms.z * (3.0 * cosine * cosine - 1.0) / (16.0 * MEDIA_PI);
}

// Per steradian, for light that turns by the angle of that cosine.
float medium_phase(int medium, float cosine)
{
  if (medium_texel(medium, 10).w != 0.0) {
    return media_sea(medium_texel(medium, 11).xyz, cosine);
  }
  vec4 second = medium_texel(medium, 9);
  return media_lobe(medium_texel(medium, 8), cosine) + (second.x > 0.0 ? media_lobe(second, cosine) : 0.0);
}
