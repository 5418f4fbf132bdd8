// How a surface of the G-buffer reflects: Lambert under a GGX layer, as Cycles' Principled BSDF with multiple scattering does.
// Energy that the layer reflects is what lies below it does not get (preview/ggx.py); both together reflect the material's albedo.

const float INVERSE_PI = 0.31830988618;
const float MIN_ALPHA = 2e-3;

struct SurfaceLook {
  vec3 diffuse;
  // Reflectance at normal incidence and at grazing angles.
  vec3 f0;
  vec3 f90;
  float alpha;
  // What scattering more than once adds to the layer.
  vec3 gain;
};

// The two terms of the layer's energy and their means, bilinear between texel centres.
vec4 layer_energy(float cosine, float roughness)
{
  ivec2 last = textureSize(ggx_energy, 0) - 1;
  vec2 place = clamp(vec2(cosine, roughness) * vec2(last + 1) - 0.5, vec2(0.0), vec2(last));
  ivec2 low = min(ivec2(place), last - 1);
  vec2 f = place - vec2(low);
  vec4 bottom = mix(texelFetch(ggx_energy, low, 0), texelFetch(ggx_energy, low + ivec2(1, 0), 0), f.x);
  vec4 top = mix(texelFetch(ggx_energy, low + ivec2(0, 1), 0), texelFetch(ggx_energy, low + ivec2(1, 1), 0), f.x);
  return mix(bottom, top, f.y);
}

vec3 multiple_scattering(vec3 f0, vec3 f90, float energy)
{
  vec3 mean_fresnel = f0 + (f90 - f0) / 21.0;
  return 1.0 + mean_fresnel * (1.0 - energy) / max(energy, 1e-3);
}

SurfaceLook surface_look(vec3 albedo, vec3 base_color, float metallic, float roughness, float specular, float view_cosine)
{
  SurfaceLook look;
  look.f0 = mix(vec3(specular), base_color, metallic);
  // A layer that reflects almost nothing head on reflects little at grazing angles, too.
  look.f90 = clamp(100.0 * look.f0, 0.0, 1.0);
  look.alpha = max(roughness * roughness, MIN_ALPHA);
  vec4 energy = layer_energy(view_cosine, roughness);
  look.gain = multiple_scattering(look.f0, look.f90, energy.x + energy.y);
  vec3 reflected = (look.f0 * energy.x + look.f90 * energy.y) * look.gain;
  vec3 mean = (look.f0 * energy.z + look.f90 * energy.w) * multiple_scattering(look.f0, look.f90, energy.z + energy.w);
  float below = 1.0 - max(reflected.r, max(reflected.g, reflected.b));
  float below_mean = 1.0 - max(mean.r, max(mean.g, mean.b));
  look.diffuse = max(albedo - mean, vec3(0.0)) * max(below, 0.0) / max(below_mean, 0.05);
  return look;
}

// Radiance per irradiance [1/sr] from unit `towards_light` to unit `towards_eye`, with the light above the surface.
vec3 reflectance(SurfaceLook look, vec3 normal, vec3 towards_eye, vec3 towards_light)
{
  vec3 result = look.diffuse * INVERSE_PI;
  vec3 half_vector = normalize(towards_eye + towards_light);
  float nh = clamp(dot(normal, half_vector), 0.0, 1.0);
  // A shading normal may be seen from behind.
  float nv = max(dot(normal, towards_eye), 1e-3);
  float nl = max(dot(normal, towards_light), 1e-6);
  float a2 = look.alpha * look.alpha;
  float t = nh * nh * (a2 - 1.0) + 1.0;
  float distribution = a2 * INVERSE_PI / (t * t);
  float masking = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
  float grazing = pow(clamp(1.0 - dot(towards_eye, half_vector), 0.0, 1.0), 5.0);
  return result + mix(look.f0, look.f90, grazing) * look.gain * (distribution * masking);
}
