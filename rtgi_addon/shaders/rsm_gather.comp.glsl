// Adds one reflective shadow map's irradiance at every receiver, from sampled texels (techniques/rsm/gather.py, which derives it).
// A receiver: (position, shift x), (normal, shift y), (projection into the map, 0, 0). A texel of the map, in three blocks side by
// side: (position, normal x), (normal y z, flux/pi red green), (blue, area/pi, density by flux, 0).
#include "include/list.glsl"
#include "include/receiver.glsl"

const float PI = 3.14159265;

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

uint running_sum(int column, int row)
{
  return row < 0 ? 0u : uint(texelFetch(cumulative, ivec2(column, row), 0).r);
}

// The texel and the place in it that follow the flux: a row by what it holds, then a texel of it.
Sample sample_by_flux(vec2 xi)
{
  int last = parameters.size - 1;
  float fraction;
  uint target = whole_part(xi.y, running_sum(last, last), fraction);
  int low = 0;
  int high = last;
  while (low < high) {
    int middle = (low + high) / 2;
    if (running_sum(last, middle) > target) {
      high = middle;
    }
    else {
      low = middle + 1;
    }
  }
  Sample chosen;
  chosen.texel.y = low;
  uint before = running_sum(last, low - 1);
  uint total = running_sum(last, low) - before;
  chosen.place.y = float(low) + (float(target - before) + fraction) / float(total);

  target = before + whole_part(xi.x, total, fraction);
  low = 0;
  high = last;
  while (low < high) {
    int middle = (low + high) / 2;
    if (running_sum(middle, chosen.texel.y) > target) {
      high = middle;
    }
    else {
      low = middle + 1;
    }
  }
  chosen.texel.x = low;
  uint start = low > 0 ? running_sum(low - 1, chosen.texel.y) : before;
  chosen.place.x = float(low) + (float(target - start) + fraction) / float(running_sum(low, chosen.texel.y) - start);
  chosen.place /= float(parameters.size);
  return chosen;
}

Sample sample_disk(vec2 xi, vec2 centre)
{
  float angle = xi.y * (2.0 * PI);
  float reach = parameters.disk_radius * xi.x * sqrt(xi.x);
  Sample chosen;
  chosen.place = centre + reach * vec2(cos(angle), sin(angle));
  chosen.texel = ivec2(floor(chosen.place * float(parameters.size)));
  return chosen;
}

// A texel's irradiance, weighted by the balance heuristic.
vec3 contribution(Sample chosen, vec2 centre, vec3 position, vec3 normal)
{
  if (any(lessThan(chosen.texel, ivec2(0))) || any(greaterThanEqual(chosen.texel, ivec2(parameters.size)))) {
    return vec3(0.0);
  }
  vec4 a = texelFetch(texels, chosen.texel, 0);
  vec4 b = texelFetch(texels, chosen.texel + ivec2(parameters.size, 0), 0);
  vec4 c = texelFetch(texels, chosen.texel + ivec2(2 * parameters.size, 0), 0);
  vec2 offset = (chosen.place - centre) / parameters.disk_radius;
  float squared = dot(offset, offset);
  float disk = squared < 1.0 ? pow(max(squared, 1e-12), -2.0 / 3.0) : 0.0;
  float disk_density = float(parameters.in_disk) / (3.0 * PI * parameters.disk_radius * parameters.disk_radius);
  float density = disk * disk_density + c.z * float(parameters.by_flux);
  if (density <= 0.0) {
    return vec3(0.0);
  }
  float weight = float(parameters.size * parameters.size) / density;

  vec3 towards = a.xyz - position;
  float squared_distance = dot(towards, towards);
  vec3 direction = towards / sqrt(max(squared_distance, 1.1754944e-38));
  float leaving = max(-dot(vec3(a.w, b.xy), direction), 0.0);
  float arriving = max(dot(normal, direction), 0.0);
  return vec3(b.zw, c.x) * (weight * arriving * leaving / max(squared_distance + c.y, 1e-20));
}

void main()
{
  ivec2 place;
  int index = receiver_index(place, imageSize(irradiance).x, parameters.first_row, parameters.count);
  if (index < 0) {
    return;
  }
  vec4 point = list_texel(receivers, index, 3, 0);
  vec4 normal = list_texel(receivers, index, 3, 1);
  vec2 centre = list_texel(receivers, index, 3, 2).xy;
  vec2 shift = vec2(point.w, normal.w);
  vec3 sum = vec3(0.0);
  int samples = parameters.in_disk + parameters.by_flux;
  for (int i = 0; i < samples; i++) {
    vec2 xi = list_texel(pattern, i, 1, 0).xy + shift;
    xi -= floor(xi);
    Sample chosen = sample_disk(xi, centre);
    if (i >= parameters.in_disk) {
      chosen = sample_by_flux(xi);
    }
    sum += contribution(chosen, centre, point.xyz, normal.xyz);
  }
  imageStore(irradiance, place, imageLoad(irradiance, place) + vec4(sum, 0.0));
}
