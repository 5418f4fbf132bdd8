// An image as Cycles filters it, texel by texel: transport/surfaces/textures.py is the same in numpy. Bilinear weights are full floats, where a
// GPU's own filter has eight bits.

#define EXTENSION_REPEAT 0
#define EXTENSION_EXTEND 1
#define EXTENSION_CLIP 2
#define EXTENSION_MIRROR 3

// i mod n for n > 0; GLSL leaves % of negative numbers undefined.
int wrap_index(int i, int n)
{
  return i >= 0 ? i % n : n - 1 - (-1 - i) % n;
}

int extend_index(int i, int n, int extension, inout bool inside)
{
  if (extension == EXTENSION_REPEAT) {
    return wrap_index(i, n);
  }
  if (extension == EXTENSION_MIRROR) {
    int period = wrap_index(i, 2 * n);
    return period < n ? period : 2 * n - 1 - period;
  }
  if (extension == EXTENSION_CLIP) {
    inside = inside && i >= 0 && i < n;
  }
  return clamp(i, 0, n - 1);
}

vec4 extended_texel(sampler2D image, ivec2 position, int extension)
{
  ivec2 size = textureSize(image, 0);
  bool inside = true;
  ivec2 texel;
  texel.x = extend_index(position.x, size.x, extension, inside);
  texel.y = extend_index(position.y, size.y, extension, inside);
  return inside ? texelFetch(image, texel, 0) : vec4(0.0);
}

vec3 linear_from_srgb(vec3 encoded)
{
  vec3 curve = pow((max(encoded, vec3(0.0)) + 0.055) / 1.055, vec3(2.4));
  return mix(curve, encoded / 12.92, lessThanEqual(encoded, vec3(0.04045)));
}

vec4 filtered_texel(sampler2D image, vec2 uv, int extension, bool closest)
{
  vec2 position = uv * vec2(textureSize(image, 0));
  if (closest) {
    return extended_texel(image, ivec2(floor(position)), extension);
  }
  position -= 0.5;
  ivec2 corner = ivec2(floor(position));
  vec2 f = position - floor(position);
  vec4 lower = mix(extended_texel(image, corner, extension), extended_texel(image, corner + ivec2(1, 0), extension), f.x);
  vec4 upper = mix(extended_texel(image, corner + ivec2(0, 1), extension),
                   extended_texel(image, corner + ivec2(1, 1), extension), f.x);
  return mix(lower, upper, f.y);
}
