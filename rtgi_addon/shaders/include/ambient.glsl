// The light that a bake knows where media are, on a lattice of its own (effects/media/ambient.py): texels of `ambient`. AMBIENT is the
// struct with the lattice's place and resolution.
#define SH_ORDER 2
#include "include/sh.glsl"
#include "include/list.glsl"

// Of the light about a point, at one of the lattice's points near it.
int ambient_point(vec3 point, vec3 shift)
{
  vec3 local = (AMBIENT.ambient_from_world * vec4(point, 1.0)).xyz;
  vec3 place = (local + 1.0) * (0.5 * vec3(AMBIENT.ambient_resolution)) - 0.5;
  vec3 last = vec3(AMBIENT.ambient_resolution - 1);
  ivec3 at = ivec3(clamp(floor(clamp(place, vec3(0.0), last) + shift), vec3(0.0), last));
  return (at.z * AMBIENT.ambient_resolution.y + at.y) * AMBIENT.ambient_resolution.x + at.x;
}

// Light that comes along the eye's `direction` per scattering coefficient.
vec3 ambient_scattered(int point, vec3 direction, vec3 moments)
{
  vec4 basis[SH_BLOCKS];
  sh_basis(direction, basis);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 9; k++) {
    float moment = k == 0 ? moments.x : (k < 4 ? moments.y : moments.z);
    sum += list_texel(ambient, point, 9, k).rgb * (basis[k / 4][k % 4] * moment);
  }
  return max(sum, vec3(0.0));
}
