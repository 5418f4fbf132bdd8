// Adds the light of one lamp, as far as one of its shadow maps sees the pixels.
#include "include/lamp.glsl"
#include "include/shadow.glsl"
#include "include/brdf.glsl"
#include "include/instances.glsl"
#ifdef IN_MEDIA
#include "include/media.glsl"
#endif
#include "include/luminance.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, camera.size))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) == 0.0) {
    return;
  }
  vec3 point = texelFetch(gbuffer_position, texel, 0).xyz;
  vec3 towards_eye = camera.orthographic != 0 ? -camera.forward_world : camera.position_world - point;
  float depth = dot(point - camera.position_world, camera.forward_world);
  if (depth < shadow.camera_near || depth >= shadow.camera_far) {
    return;
  }
  vec4 albedo = texelFetch(gbuffer_albedo, texel, 0);
  if (!is_among(lit_instances, int(albedo.w))) {
    return;
  }
  LampLight light = lamp_light(point);
  vec4 geometry = texelFetch(gbuffer_geometry, texel, 0);
  float cosine = dot(normal, light.direction);
  if (cosine <= 0.0 || dot(geometry.xyz, light.direction) <= 0.0 || light.irradiance == vec3(0.0)) {
    return;
  }
  float visible = shadow.casts_shadow != 0 ? shadow_visibility(point, geometry.xyz) : 1.0;
  if (visible <= 0.0) {
    return;
  }
  vec3 left = vec3(visible);
#ifdef IN_MEDIA
  if (shadow.casts_shadow != 0) {
    float away = lamp.kind == LAMP_SUN ? 2.0 * MEDIA_FAR : light.distance;
    left *= media_transmittance(media.count, point, light.direction, away);
  }
#endif
  vec4 base = texelFetch(gbuffer_base_color, texel, 0);
  float roughness = texelFetch(gbuffer_emission, texel, 0).w;
  towards_eye = normalize(towards_eye);
  SurfaceLook look = surface_look(albedo.rgb, base.rgb, base.w, roughness, geometry.w,
                                  clamp(dot(normal, towards_eye), 0.0, 1.0));
  vec3 reflected = reflectance(look, normal, towards_eye, light.direction);
  vec4 sum = imageLoad(direct, texel);
  vec3 arriving = light.irradiance * (cosine * left);
  imageStore(direct, texel, sum + vec4(reflected * arriving, luminance(arriving)));
}
