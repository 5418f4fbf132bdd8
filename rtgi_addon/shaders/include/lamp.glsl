// A lamp's light at a point, seen through the point of the lamp that the whole frame shares (preview/lamp_sample.py): the samples of
// transport/lamps.py and transport/area_lamps.py.

#define LAMP_SUN 0
#define LAMP_POINT 1
#define LAMP_SPOT 2
#define LAMP_AREA 3

struct LampLight {
  // Unit, towards the lamp.
  vec3 direction;
  // On a plane that faces the direction [W/m2].
  vec3 irradiance;
};

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
  float factor = 1.0 / squared;
  bool inside = false;
  if (lamp.radius > 0.0 && lamp.soft_falloff != 0) {
    float away = squared + dot(across, across);
    light.direction = (towards + across) * inversesqrt(away);
    factor = d / (sqrt(away) * away);
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
  if (lamp.tan_half_spread == 0.0) {
    // A parallel beam.
    vec2 place = (mat3(lamp.beam) * from_centre).xy;
    bool lit = lamp.ellipse != 0 ? dot(place, place) <= 1.0 : all(lessThanEqual(abs(place), vec2(1.0)));
    light.direction = -lamp.axis;
    if (lit && height > 0.0) {
      light.irradiance = lamp.strength;
    }
    return light;
  }
  vec3 towards = lamp.shift - from_centre;
  float squared = max(dot(towards, towards), 1e-12);
  light.direction = towards * inversesqrt(squared);
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
    return light;
  }
  if (lamp.kind == LAMP_AREA) {
    return area_light(point);
  }
  return point_light(point);
}
