// How a surface of the G-buffer reflects.

struct SurfaceLook {
  vec3 albedo;
};

SurfaceLook surface_at(ivec2 texel)
{
  SurfaceLook look;
  look.albedo = texelFetch(gbuffer_albedo, texel, 0).rgb;
  return look;
}

// Radiance per irradiance [1/sr] from unit `towards_light` to unit `towards_eye`.
vec3 reflectance(SurfaceLook look, vec3 normal, vec3 towards_eye, vec3 towards_light)
{
  return look.albedo * 0.31830988618;
}
