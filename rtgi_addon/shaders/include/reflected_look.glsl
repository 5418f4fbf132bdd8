// The surface of a pixel as it reflects (effects/lit.py, seen_surfaces), for effects that mirror.
#include "include/brdf.glsl"

struct Mirror {
  vec3 point;
  vec3 normal;
  vec3 face;
  vec3 towards_eye;
  // Of the view to the normal, as reflectance goes by.
  float cosine;
  SurfaceLook look;
};

Mirror pixel_mirror(ivec2 texel)
{
  Mirror mirror;
  vec4 albedo = texelFetch(gbuffer_albedo, texel, 0), base = texelFetch(gbuffer_base_color, texel, 0);
  vec4 geometry = texelFetch(gbuffer_geometry, texel, 0);
  mirror.point = texelFetch(gbuffer_position, texel, 0).xyz;
  mirror.normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  mirror.face = geometry.xyz;
  mirror.towards_eye = frame.orthographic != 0 ? -frame.forward_world : normalize(frame.position_world - mirror.point);
  mirror.cosine = clamp(dot(mirror.normal, mirror.towards_eye), 0.0, 1.0);
  mirror.look = surface_look(albedo.rgb, base.rgb, base.w, texelFetch(gbuffer_emission, texel, 0).w, geometry.w, mirror.cosine);
  return mirror;
}
