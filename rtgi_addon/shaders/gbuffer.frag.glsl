// Everything that shading needs to know of the nearest surface, with no light in it.
#include "include/material.glsl"
#include "include/fragment.glsl"

void main()
{
  if (material.surface.z != 0.0 && is_transparent(alpha_image, primitive)) {
    discard;
  }
  vec2 encoded = encoded_surface(primitive, int(material.surface.w));
  out_position = vec4(position_world, encoded.x);
  out_normal = vec4(facing_normal(), encoded.y);
  out_albedo = vec4(clamp(material_input(INPUT_ALBEDO, albedo_image), 0.0, MAX_ALBEDO), float(instance_index));
  out_base_color = vec4(max(material_input(INPUT_BASE_COLOR, base_color_image), 0.0),
                        clamp(material_input(INPUT_METALLIC, metallic_image).r, 0.0, 1.0));
  out_emission = vec4(max(material_input(INPUT_EMISSION, emission_image), 0.0),
                      clamp(material_input(INPUT_ROUGHNESS, roughness_image).r, 0.0, 1.0));
  out_geometry = vec4(facing_side() * face_normal_world / max(length(face_normal_world), 1e-30),
                      clamp(dot(material_input(INPUT_SPECULAR, specular_image), vec3(1.0 / 3.0)), 0.0, 1.0));
  gl_FragDepth = linear_depth();
}
