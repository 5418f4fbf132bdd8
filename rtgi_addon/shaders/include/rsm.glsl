// Irradiance of reflective shadow maps from sampled texels (techniques/rsm/gather.py, which derives it). A texel of a map, in three
// blocks side by side: (position, normal x), (normal y z, flux/pi red green), (blue, area/pi, density by flux, 0); `cumulative` holds
// the running sums of the quantized flux.
#include "include/list.glsl"
#ifdef IN_MEDIA
#include "include/media.glsl"
#endif

const float PI = 3.14159265;

// One of the maps that share the textures: `place` is its first texel in `cumulative`, which has one texel where `texels` has three.
struct RsmMap {
  int size;
  ivec2 place;
  int in_disk;
  int by_flux;
  int first_sample;
  float disk_radius;
};

struct Sample {
  ivec2 texel;
  vec2 place;
};

// Where a number of 24 bits from [0, 1) falls in `total` whole parts: which part, and how far into it. In integers, since the
// product has more bits than a float.
uint whole_part(float xi, uint total, out float fraction)
{
  uint k = uint(xi * 16777216.0);
  uint k_high = k >> 12;
  uint k_low = k & 4095u;
  uint t_high = total >> 12;
  uint t_low = total & 4095u;
  uint low = k_low * t_low;
  uint middle = k_high * t_low + k_low * t_high + (low >> 12);
  fraction = float((middle & 4095u) << 12 | (low & 4095u)) * exp2(-24.0);
  return k_high * t_high + (middle >> 12);
}

uint running_sum(RsmMap map, int column, int row)
{
  return row < 0 ? 0u : uint(texelFetch(cumulative, map.place + ivec2(column, row), 0).r);
}

// The texel and the place in it that follow the flux: a row by what it holds, then a texel of it.
Sample sample_by_flux(RsmMap map, vec2 xi)
{
  int last = map.size - 1;
  float fraction;
  uint target = whole_part(xi.y, running_sum(map, last, last), fraction);
  int low = 0;
  int high = last;
  while (low < high) {
    int middle = (low + high) / 2;
    if (running_sum(map, last, middle) > target) {
      high = middle;
    }
    else {
      low = middle + 1;
    }
  }
  Sample chosen;
  chosen.texel.y = low;
  uint before = running_sum(map, last, low - 1);
  uint total = running_sum(map, last, low) - before;
  chosen.place.y = float(low) + (float(target - before) + fraction) / float(total);

  target = before + whole_part(xi.x, total, fraction);
  low = 0;
  high = last;
  while (low < high) {
    int middle = (low + high) / 2;
    if (running_sum(map, middle, chosen.texel.y) > target) {
      high = middle;
    }
    else {
      low = middle + 1;
    }
  }
  chosen.texel.x = low;
  uint start = low > 0 ? running_sum(map, low - 1, chosen.texel.y) : before;
  chosen.place.x = float(low) + (float(target - start) + fraction) / float(running_sum(map, low, chosen.texel.y) - start);
  chosen.place /= float(map.size);
  return chosen;
}

Sample sample_disk(RsmMap map, vec2 xi, vec2 centre)
{
  float angle = xi.y * (2.0 * PI);
  float reach = map.disk_radius * xi.x * sqrt(xi.x);
  Sample chosen;
  chosen.place = centre + reach * vec2(cos(angle), sin(angle));
  chosen.texel = ivec2(floor(chosen.place * float(map.size)));
  return chosen;
}

// A texel's irradiance, weighted by the balance heuristic.
vec3 contribution(RsmMap map, Sample chosen, vec2 centre, vec3 position, vec3 normal)
{
  if (any(lessThan(chosen.texel, ivec2(0))) || any(greaterThanEqual(chosen.texel, ivec2(map.size)))) {
    return vec3(0.0);
  }
  ivec2 place = ivec2(3 * map.place.x, map.place.y) + chosen.texel;
  vec4 a = texelFetch(texels, place, 0);
  vec4 b = texelFetch(texels, place + ivec2(map.size, 0), 0);
  vec4 c = texelFetch(texels, place + ivec2(2 * map.size, 0), 0);
  vec2 offset = (chosen.place - centre) / map.disk_radius;
  float squared = dot(offset, offset);
  float disk = squared < 1.0 ? pow(max(squared, 1e-12), -2.0 / 3.0) : 0.0;
  float disk_density = float(map.in_disk) / (3.0 * PI * map.disk_radius * map.disk_radius);
  float density = disk * disk_density + c.z * float(map.by_flux);
  if (density <= 0.0) {
    return vec3(0.0);
  }
  float weight = float(map.size * map.size) / density;

  vec3 towards = a.xyz - position;
  float squared_distance = dot(towards, towards);
  vec3 direction = towards / sqrt(max(squared_distance, 1.1754944e-38));
  float leaving = max(-dot(vec3(a.w, b.xy), direction), 0.0);
  float arriving = max(dot(normal, direction), 0.0);
  vec3 irradiance = vec3(b.zw, c.x) * (weight * arriving * leaving / max(squared_distance + c.y, 1e-20));
#ifdef IN_MEDIA
  if (irradiance != vec3(0.0)) {
    irradiance *= media_transmittance(indirect.media, position, direction, sqrt(squared_distance));
  }
#endif
  return irradiance;
}

// The sum over the map's part of the pattern, turned by `shift`, for a receiver that projects to `centre` of the unit square.
vec3 rsm_irradiance(RsmMap map, vec2 centre, vec2 shift, vec3 position, vec3 normal)
{
  vec3 sum = vec3(0.0);
  // A map in which nothing is lit has no flux to follow.
  int samples = running_sum(map, map.size - 1, map.size - 1) > 0u ? map.in_disk + map.by_flux : 0;
  for (int i = 0; i < samples; i++) {
    vec2 xi = list_texel(pattern, map.first_sample + i, 1, 0).xy + shift;
    xi -= floor(xi);
    Sample chosen;
    if (i < map.in_disk) {
      chosen = sample_disk(map, xi, centre);
    }
    else {
      chosen = sample_by_flux(map, xi);
    }
    sum += contribution(map, chosen, centre, position, normal);
  }
  return sum;
}
