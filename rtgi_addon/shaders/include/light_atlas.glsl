// Irradiance from the light atlas, the same in the preview and in every engine. What stands before says how a texel is read,
// vec4 rtgi_atlas_texel(ivec2 texel, int channel), and how many there are, RTGI_ATLAS_SIZE.

// The four coefficients of one channel at a place of the sheet, in texels: between the middles of four.
vec4 rtgi_atlas_between(vec2 place, int channel)
{
  vec2 lifted = place - 0.5;
  ivec2 low = ivec2(floor(lifted));
  vec2 f = lifted - vec2(low);
  ivec2 last = RTGI_ATLAS_SIZE - 1;
  ivec2 first = clamp(low, ivec2(0), last);
  ivec2 second = clamp(low + 1, ivec2(0), last);
  vec4 above = mix(rtgi_atlas_texel(first, channel), rtgi_atlas_texel(ivec2(second.x, first.y), channel), f.x);
  vec4 below = mix(rtgi_atlas_texel(ivec2(first.x, second.y), channel), rtgi_atlas_texel(second, channel), f.x);
  return mix(above, below, f.y);
}

// Irradiance [W/m^2] there under a unit normal: SH of order 1 of radiance, each band times that of the cosine.
vec3 rtgi_atlas_irradiance(vec2 place, vec3 normal)
{
  vec4 basis = vec4(0.8862269, 1.0233267 * normal.y, 1.0233267 * normal.z, 1.0233267 * normal.x);
  return max(vec3(dot(basis, rtgi_atlas_between(place, 0)), dot(basis, rtgi_atlas_between(place, 1)),
                  dot(basis, rtgi_atlas_between(place, 2))), vec3(0.0));
}
