// Dots and strokes for darkness, in the axes of the object (effects/stylized/pattern.py).

#define PATTERN_STIPPLE 1

float bayer(ivec2 cell)
{
  int order = 0;
  for (int bit = 0; bit < 3; ++bit) {
    int i = (cell.x >> bit) & 1;
    int j = (cell.y >> bit) & 1;
    order += (2 * (i ^ j) + i) << (2 * (2 - bit));
  }
  return (float(order) + 0.5) / 64.0;
}

float stroke(float place, float width, float blur)
{
  float off = abs(place - floor(place) - 0.5);
  return width > 0.0 ? clamp((0.5 * width - off) / max(blur, 1e-6) + 0.5, 0.0, 1.0) : 0.0;
}

float ink_in(vec2 place, float cell, float footprint, float darkness)
{
  if (effect.pattern == PATTERN_STIPPLE) {
    vec2 index = floor(place / cell);
    ivec2 within = ivec2(index - 8.0 * floor(index / 8.0));
    return darkness > bayer(within.yx) ? 1.0 : 0.0;
  }
  float blur = footprint / cell;
  float first = stroke((place.x + place.y) * (0.70710678119 / cell), min(darkness, 0.5), blur);
  float second = stroke((place.x - place.y) * (0.70710678119 / cell), clamp(2.0 * darkness - 1.0, 0.0, 1.0), blur);
  return 1.0 - (1.0 - first) * (1.0 - second);
}

float ink(ivec2 texel, float darkness)
{
  int instance = effect_instance(texel);
  vec3 axis_x = list_texel(instances, instance, INSTANCE_TEXELS, 0).xyz;
  vec3 axis_y = list_texel(instances, instance, INSTANCE_TEXELS, 1).xyz;
  vec3 axis_z = list_texel(instances, instance, INSTANCE_TEXELS, 2).xyz;
  vec3 offset = surface_position(texel) - list_texel(instances, instance, INSTANCE_TEXELS, 3).xyz;
  vec3 local = vec3(dot(axis_x, offset), dot(axis_y, offset), dot(axis_z, offset));
  vec3 face = texelFetch(gbuffer_geometry, texel, 0).xyz;
  vec3 normal = abs(vec3(dot(axis_x, face), dot(axis_y, face), dot(axis_z, face)));
  bool along_x = normal.x > normal.y && normal.x > normal.z;
  bool along_y = !along_x && normal.y > normal.z;
  vec2 place = vec2(along_x ? local.y : local.x, along_x || along_y ? local.z : local.y);
  float footprint = footprint_at(effect_depth(texel));
  float level = log2(max(footprint * effect.pattern_spacing, 1e-12));
  float octave = floor(level);
  float cell = exp2(octave);
  float share = smooth_step(2.0 * (level - octave) - 1.0);
  float result = ink_in(place, cell, footprint, darkness);
  return share > 0.0 ? mix(result, ink_in(place, 2.0 * cell, footprint, darkness), share) : result;
}
