// What media and mist leave of a surface's light (effects/stylized/shading.py).
vec3 left_at(ivec2 texel)
{
  vec3 left = effect.in_media != 0 ? texelFetch(transmittance, texel, 0).rgb : vec3(1.0);
  return effect.in_mist != 0 ? left * texelFetch(left_by_mist, texel, 0).rgb : left;
}
