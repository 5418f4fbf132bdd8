// Whether the scene's surfaces stand in front of a point of an overlay, by the G-buffer behind it.

float overlay_depth(vec3 position)
{
  return dot(position - overlay.position_world, overlay.forward_world);
}

bool overlay_hidden(vec3 position)
{
  ivec2 texel = ivec2(gl_FragCoord.xy * vec2(textureSize(gbuffer_position, 0)) / vec2(overlay.size));
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) == 0.0) {
    return false;
  }
  float scene = overlay_depth(texelFetch(gbuffer_position, texel, 0).xyz);
  return overlay_depth(position) > scene + overlay.tolerance * (1.0 + abs(scene));
}
