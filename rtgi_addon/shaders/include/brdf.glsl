// How a surface of the G-buffer reflects: Lambert under a GGX layer, as Cycles' Principled BSDF with multiple scattering does.
// Energy that the layer reflects is what lies below it does not get (transport/surfaces/ggx.py); both together reflect the material's albedo.

const float INVERSE_PI = 0.31830988618;
const float MIN_ALPHA = 2e-3;

// Indices of refraction in the table (transport/surfaces/ggx.py).
const int INDICES = 12;
const float MOST_ROOT = 0.99;

struct SurfaceLook {
  vec3 diffuse;
  // What the layer reflects as metal at normal incidence, and how much more at grazing angles.
  vec3 f0;
  vec3 edge;
  // Share of light from everywhere alike that it reflects to the eye in all.
  vec3 layer;
  // How much of the layer is a dielectric, and its index. All of these with what scattering more than once adds.
  float coat;
  float index;
  float alpha;
};

float dielectric_fresnel(float cosine, float index)
{
  float g = sqrt(max(index * index - 1.0 + cosine * cosine, 0.0));
  float across = (g - cosine) / max(g + cosine, 1e-6);
  float along = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0);
  return 0.5 * across * across * (1.0 + along * along);
}

// Share that microfacets reflect at `cosine` to their normals.
vec3 fresnel(SurfaceLook look, float cosine)
{
  float c = clamp(cosine, 0.0, 1.0);
  return look.f0 + look.edge * pow(1.0 - c, 5.0) + look.coat * dielectric_fresnel(c, look.index);
}

// A block of the table, bilinear between texel centres: of 0 the two terms of the layer's energy and their means.
vec4 layer_energy(float cosine, float roughness, int block)
{
  int last = textureSize(ggx_energy, 0).x - 1;
  // The last half texel, where roughness is 1 and eyes look straight on, goes on as the one before.
  vec2 place = clamp(vec2(cosine, roughness) * float(last + 1) - 0.5, vec2(0.0), vec2(last) + 0.5);
  ivec2 low = min(ivec2(place), ivec2(last - 1));
  vec2 f = place - vec2(low);
  low.y += block * (last + 1);
  vec4 bottom = mix(texelFetch(ggx_energy, low, 0), texelFetch(ggx_energy, low + ivec2(1, 0), 0), f.x);
  vec4 top = mix(texelFetch(ggx_energy, low + ivec2(0, 1), 0), texelFetch(ggx_energy, low + ivec2(1, 1), 0), f.x);
  return mix(bottom, top, f.y);
}

// What a dielectric layer reflects once of light from everywhere alike, at `cosine` and in the mean.
vec2 dielectric_energy(float f0, float cosine, float roughness, vec4 energy)
{
  float place = sqrt(sqrt(clamp(f0, 0.0, 1.0))) * float(INDICES - 1);
  int low = min(int(place), INDICES - 2);
  vec4 way = layer_energy(cosine, roughness, 1 + low);
  return f0 * (energy.xz + energy.yw) + (1.0 - f0) * mix(way.xz, way.yw, place - float(low));
}

vec3 multiple_scattering(vec3 mean_fresnel, float energy, float mean_energy)
{
  vec3 again = mean_fresnel * mean_energy / max(1.0 - mean_fresnel * (1.0 - mean_energy), vec3(1e-3));
  return 1.0 + again * (1.0 - energy) / max(energy, 1e-3);
}

SurfaceLook surface_look(vec3 albedo, vec3 base_color, float metallic, float roughness, float specular, float view_cosine)
{
  SurfaceLook look;
  look.alpha = max(roughness * roughness, MIN_ALPHA);
  vec4 energy = layer_energy(view_cosine, roughness, 0);
  float once = energy.x + energy.y;
  float mean_once = energy.z + energy.w;
  // A metal that reflects almost nothing head on reflects little at grazing angles, too.
  vec3 rise = clamp(100.0 * base_color, 0.0, 1.0) - base_color;
  vec3 more = multiple_scattering(base_color + rise / 21.0, once, mean_once);
  vec3 more_mean = multiple_scattering(base_color + rise / 21.0, mean_once, mean_once);
  float root = sqrt(clamp(specular, 0.0, pow(MOST_ROOT, 4.0)));
  look.index = (1.0 + root) / (1.0 - root);
  // The mean of the Fresnel equations over a uniform sky (Kulla and Conty 2017).
  vec3 fresnel_mean = vec3((look.index - 1.0) / (4.08567 + 1.00071 * look.index));
  float more_coat = multiple_scattering(fresnel_mean, once, mean_once).x;
  vec2 dielectric = dielectric_energy(specular, view_cosine, roughness, energy);
  float below = max(1.0 - dielectric.x * more_coat, 0.0);
  float mean_coat = dielectric.y * multiple_scattering(fresnel_mean, mean_once, mean_once).x;
  vec3 mean = metallic * (base_color * mean_once + rise * energy.w) * more_mean + (1.0 - metallic) * mean_coat;
  look.diffuse = max(albedo - mean, vec3(0.0)) * below / max(1.0 - mean_coat, 0.05);
  look.f0 = metallic * base_color * more;
  look.edge = metallic * rise * more;
  look.coat = (1.0 - metallic) * more_coat;
  look.layer = look.f0 * once + look.edge * energy.y + look.coat * dielectric.x;
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
  return result + fresnel(look, dot(towards_eye, half_vector)) * (distribution * masking);
}
