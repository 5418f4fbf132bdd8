// A texel of a reflective shadow map (Dachsbacher and Stamminger 2005): transport/views/reflective_shadow_map.py, capture.
#include "include/material.glsl"
#include "include/fragment.glsl"
#include "include/instances.glsl"
#include "include/lamp_profile.glsl"

void main()
{
  if (material.surface.z != 0.0 && is_transparent(alpha_image, primitive)) {
    discard;
  }
  vec2 encoded = encoded_primitive(primitive);
  // What the lamp is not linked to stands in its way all the same.
  vec3 lit = is_among(lit_instances, instance_index) ? vec3(1.0) : vec3(0.0);
  vec3 albedo = lit * clamp(material_input(INPUT_ALBEDO, albedo_image), 0.0, MAX_ALBEDO);
  out_position = vec4(position_world, encoded.x);
  out_normal = vec4(facing_normal(), encoded.y);
  vec3 travelled = position_world - view.position_world;
  float way = view.orthographic != 0 ? dot(travelled, view.forward_world) : length(travelled);
  out_flux = vec4(texelFetch(power, ivec2(gl_FragCoord.xy), 0).rgb * profile_of_distance(way) * albedo, 1.0);
  gl_FragDepth = linear_depth();
}
