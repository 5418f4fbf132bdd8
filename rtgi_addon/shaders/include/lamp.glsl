// A lamp's light at a point, seen through the point of the lamp that the whole frame shares (preview/lamp_sample.py): the samples of
// transport/lights, one function a kind. LAMP_SUN and so on are transport/lights/kinds.py's.

#include "include/lamp_profile.glsl"

struct LampLight {
  // Unit, towards the lamp.
  vec3 direction;
  // On a plane that faces the direction [W/m2].
  vec3 irradiance;
  // From the point to where the light leaves the lamp [m].
  float distance;
};

// A table's texels, linear between their middles; its columns may go round.
vec3 between_texels(sampler2D table, vec2 at, bool around)
{
  ivec2 size = textureSize(table, 0);
  at.y = clamp(at.y, 0.0, float(size.y - 1));
  at.x = around ? at.x : clamp(at.x, 0.0, float(size.x - 1));
  ivec2 low = ivec2(floor(at));
  vec2 part = at - vec2(low);
  ivec2 high = ivec2(around ? (low.x + 1) % size.x : min(low.x + 1, size.x - 1), min(low.y + 1, size.y - 1));
  low.x = (low.x + size.x) % size.x;
  vec3 lower = mix(texelFetch(table, low, 0).rgb, texelFetch(table, ivec2(high.x, low.y), 0).rgb, part.x);
  vec3 upper = mix(texelFetch(table, ivec2(low.x, high.y), 0).rgb, texelFetch(table, high, 0).rgb, part.x);
  return mix(lower, upper, part.y);
}

vec3 profile_of_direction(vec3 point, LampLight light)
{
  ivec2 size = textureSize(lamp_directions, 0);
  if (size.x == 1) {
    return vec3(1.0);
  }
  vec3 vector = -light.direction;
  if (lamp.profile_of_normals != 0) {
    vector = (point + light.direction * light.distance - lamp.position) / lamp.radius;
  }
  vec3 local = mat3(lamp.profile_from_world) * vector;
  float across = length(local.xy);
  float angle = across > 0.0 || local.z != 0.0 ? atan(across, -local.z) : 0.0;
  float azimuth = across > 0.0 ? atan(local.y, local.x) : 0.0;
  float turn = fract(azimuth * 0.15915494309189535);
  return between_texels(lamp_directions, vec2(turn * float(size.x), angle * float(size.y) / lamp.profile_reach) - 0.5, true);
}

// Of a place (s, t) along an area lamp's half axes; only a parallel beam shows a point more than one of them in a frame.
vec3 profile_of_place(vec2 place)
{
  vec2 size = vec2(textureSize(lamp_places, 0));
  return between_texels(lamp_places, (0.5 * place + 0.5) * size - 0.5, false);
}

float spot_attenuation(vec3 direction)
{
  vec3 local = mat3(lamp.local_from_world) * direction;
  float cosine = local.z / max(length(local), 1e-30);
  float t = clamp((cosine - lamp.cos_half_cone) * lamp.inverse_blend, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Points and spots: the shared point, seen on the disk that the lamp shows to the receiver.
LampLight point_light(vec3 point)
{
  vec3 towards = lamp.position - point;
  float squared = max(dot(towards, towards), 1e-12);
  float d = sqrt(squared);
  vec3 axis = towards / d;
  vec3 across = lamp.shift - axis * dot(axis, lamp.shift);
  LampLight light;
  light.direction = axis;
  light.distance = d;
  float factor = 1.0 / squared;
  bool inside = false;
  if (lamp.radius > 0.0 && lamp.soft_falloff != 0) {
    float away = squared + dot(across, across);
    light.direction = (towards + across) * inversesqrt(away);
    factor = d / (sqrt(away) * away);
    light.distance = sqrt(away);
  }
  else if (lamp.radius > 0.0) {
    float ratio = squared > lamp.radius * lamp.radius ? lamp.radius * lamp.radius / squared : 1.0;
    inside = ratio == 1.0;
    float one_minus_cos = inside ? 2.0 : ratio / (1.0 + sqrt(1.0 - ratio));
    vec3 part = across / lamp.radius;
    float part_squared = dot(part, part);
    float cosine = 1.0 - part_squared * one_minus_cos;
    light.direction = normalize(axis * cosine + part * sqrt(max(one_minus_cos * (2.0 - one_minus_cos * part_squared), 0.0)));
    factor = 2.0 * one_minus_cos / (lamp.radius * lamp.radius);
    float along = d * cosine;
    float chord = sqrt(max(lamp.radius * lamp.radius - squared + along * along, 0.0));
    light.distance = max(along + (inside ? chord : -chord), 0.0);
  }
  if (lamp.kind == LAMP_SPOT && !inside) {
    factor *= spot_attenuation(light.direction);
  }
  light.irradiance = lamp.strength * factor;
  return light;
}

LampLight area_light(vec3 point)
{
  vec3 from_centre = point - lamp.position;
  float height = dot(from_centre, lamp.axis);
  LampLight light;
  light.irradiance = vec3(0.0);
  light.distance = height;
  if (lamp.tan_half_spread == 0.0) {
    // A parallel beam.
    vec2 place = (mat3(lamp.beam) * from_centre).xy;
    bool lit = lamp.ellipse != 0 ? dot(place, place) <= 1.0 : all(lessThanEqual(abs(place), vec2(1.0)));
    light.direction = -lamp.axis;
    if (lit && height > 0.0) {
      light.irradiance = lamp.strength;
      if (lamp.profile != 0) {
        light.irradiance *= profile_of_place(place);
      }
    }
    return light;
  }
  vec3 towards = lamp.shift - from_centre;
  float squared = max(dot(towards, towards), 1e-12);
  light.direction = towards * inversesqrt(squared);
  light.distance = sqrt(squared);
  float cosine = -dot(light.direction, lamp.axis);
  if (cosine > 0.0 && height > 0.0) {
    float spread = 1.0;
    if (lamp.tan_half_spread < 1e29) {
      float tangent = sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine;
      spread = max(lamp.tan_half_spread - tangent, 0.0) * lamp.spread_gain;
    }
    light.irradiance = lamp.strength * (cosine / squared * spread);
  }
  return light;
}

LampLight lamp_light(vec3 point)
{
  if (lamp.kind == LAMP_SUN) {
    LampLight light;
    light.direction = lamp.axis;
    light.irradiance = lamp.strength;
    light.distance = 0.0;
    return light;
  }
  LampLight light;
  if (lamp.kind == LAMP_AREA) {
    light = area_light(point);
  }
  else {
    light = point_light(point);
  }
  if (lamp.profile != 0) {
    light.irradiance *= profile_of_direction(point, light) * profile_of_distance(light.distance);
  }
  return light;
}
