// One mirrored ray of every pixel, drawn by visible normals (Heitz 2018): transport/surfaces/ggx.py, sample_reflection.
#include "include/hash.glsl"
#include "include/reflected_look.glsl"

// Normals of microfacets as they are seen from `view`, which lies in the plane y = 0.
vec3 visible_normal(vec3 view, float alpha, vec2 u)
{
  vec3 stretched = normalize(view * vec3(alpha, alpha, 1.0));
  vec3 side = vec3(0.0, 1.0, 0.0), up = cross(stretched, side);
  float radius = sqrt(u.x), angle = 6.28318530718 * u.y;
  float x = radius * cos(angle), blend = 0.5 * (1.0 + stretched.z);
  float y = (1.0 - blend) * sqrt(max(1.0 - x * x, 0.0)) + blend * radius * sin(angle);
  float z = sqrt(max(1.0 - x * x - y * y, 0.0));
  return normalize((x * side + y * up + z * stretched) * vec3(alpha, alpha, 1.0));
}

float smith_lambda(float cosine, float alpha)
{
  return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) == 0.0) {
    imageStore(directions, texel, vec4(0.0));
    imageStore(weights, texel, vec4(0.0));
    return;
  }
  Mirror mirror = pixel_mirror(texel);
  uint state = hash_with(hash_with(HASH_START, uint(texel.x)), uint(texel.y));
  vec2 u = fract(ray.shift + vec2(uvec2(hash_with(state, 0u), hash_with(state, 1u)) >> 8) * exp2(-24.0));
  float cosine = clamp(dot(normal, mirror.towards_eye), 1e-3, 1.0);
  vec3 sideways = mirror.towards_eye - normal * dot(normal, mirror.towards_eye);
  float length_sideways = length(sideways);
  vec3 other = abs(normal.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  // Seen straight on, any tangent is as good as any other.
  vec3 tangent = length_sideways > 1e-6 ? sideways / length_sideways : normalize(other - normal * dot(normal, other));
  vec3 view = vec3(sqrt(1.0 - cosine * cosine), 0.0, cosine);
  vec3 local = mirror.look.alpha > MIN_ALPHA ? visible_normal(view, mirror.look.alpha, u) : vec3(0.0, 0.0, 1.0);
  vec3 half_vector = local.x * tangent + local.y * cross(normal, tangent) + local.z * normal;
  float along = dot(view, local), light = 2.0 * along * local.z - cosine;
  float mask = smith_lambda(cosine, mirror.look.alpha), share = 0.0;
  if (light > 0.0) {
    share = (1.0 + mask) / (1.0 + mask + smith_lambda(light, mirror.look.alpha));
  }
  vec3 weight = fresnel(mirror.look, along) * share;
  vec3 direction = normalize(2.0 * dot(half_vector, mirror.towards_eye) * half_vector - mirror.towards_eye);
  // Where all rays go below the surface their fallback is all that there is.
  weight = dot(mirror.face, direction) > 0.0 ? max(weight, vec3(LEAST_WEIGHT)) : vec3(LEAST_WEIGHT);
  imageStore(directions, texel, vec4(direction, 1.0));
  imageStore(weights, texel, vec4(weight, sqrt(mirror.look.alpha)));
}
