// Lists folded into textures: an item is `parts` texels side by side (preview/textures.py, fold).

vec4 list_texel(sampler2D list, int item, int parts, int part)
{
  int per_row = textureSize(list, 0).x / parts;
  return texelFetch(list, ivec2(item % per_row * parts + part, item / per_row), 0);
}
