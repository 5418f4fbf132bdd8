// The world's radiance by direction: bilinear in an equirectangular map, columns wrap and rows end at the poles
// (transport/lights/environment.py, _Equirect).

vec3 world_radiance(sampler2D map, mat3 map_from_world, vec3 direction)
{
  ivec2 size = textureSize(map, 0);
  vec3 d = map_from_world * direction;
  vec2 uv = vec2(0.5 - atan(d.y, d.x) * 0.15915494309, atan(d.z, length(d.xy)) * 0.31830988618 + 0.5);
  vec2 position = uv * vec2(size) - 0.5;
  vec2 f = position - floor(position);
  ivec2 low = ivec2(floor(position));
  ivec2 high = low + 1;
  low.x = low.x < 0 ? size.x - 1 : low.x;
  high.x = high.x >= size.x ? 0 : high.x;
  low.y = max(low.y, 0);
  high.y = min(high.y, size.y - 1);
  vec3 bottom = mix(texelFetch(map, low, 0).rgb, texelFetch(map, ivec2(high.x, low.y), 0).rgb, f.x);
  vec3 top = mix(texelFetch(map, ivec2(low.x, high.y), 0).rgb, texelFetch(map, high, 0).rgb, f.x);
  return mix(bottom, top, f.y);
}
