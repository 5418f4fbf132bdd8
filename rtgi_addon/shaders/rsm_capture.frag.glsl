// A texel of a reflective shadow map (Dachsbacher and Stamminger 2005): transport/reflective_shadow_map.py, capture.
#include "include/material.glsl"
#include "include/fragment.glsl"

void main()
{
  if (material.surface.z != 0.0 && is_transparent(alpha_image, primitive)) {
    discard;
  }
  vec2 encoded = encoded_primitive(primitive);
  vec3 albedo = clamp(material_input(INPUT_ALBEDO, albedo_image), 0.0, MAX_ALBEDO);
  out_position = vec4(position_world, encoded.x);
  out_normal = vec4(facing_normal(), encoded.y);
  out_flux = vec4(texelFetch(power, ivec2(gl_FragCoord.xy), 0).rgb * albedo, 1.0);
  gl_FragDepth = linear_depth();
}
