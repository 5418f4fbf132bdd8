// Irradiance from SH probes: eight neighbours of each volume that reaches the point, weighted by what they can know of it
// (techniques/probes/lookup.py, which derives it), volumes blended as in techniques/probes/field.py.
// A probe: (position from its volume's centre, 1 if it holds light), then its coefficients channel by channel.
// Distances: bordered octahedral tiles of (mean, mean square) of a texel and of the next one in its row.
#include "include/list.glsl"
#include "include/octahedral.glsl"
#include "include/sh.glsl"

#define PROBE_TEXELS (1 + 3 * SH_BLOCKS)

struct ProbeSum {
  vec3 irradiance;
#if PROBE_RECONSTRUCTION != PROBES_LINEAR
  vec4 red;
  vec4 green;
  vec4 blue;
#endif
};

#if PROBE_RECONSTRUCTION == PROBES_GEOMERICS
float probe_geomerics(vec4 sh, vec3 normal)
{
  float mean = max(sh.x, 0.0);
  vec3 vector = sh.wyz;
  float along = length(vector);
  float r = min(along / max(1.73205081 * mean, 1.1754944e-38), 1.0);
  float q = clamp(0.5 * (1.0 + dot(vector / max(along, 1.1754944e-38), normal)), 0.0, 1.0);
  float p = 1.0 + 2.0 * r;
  float a = (1.0 - r) / (1.0 + r);
  return 0.88622693 * mean * (a + (1.0 - a) * (p + 1.0) * pow(q, p));
}
#endif

#if PROBE_RECONSTRUCTION == PROBES_ZH3
float probe_zh3(vec4 sh, vec3 normal, vec3 axis)
{
  float mean = max(sh.x, 0.0);
  float ratio = min(abs(dot(sh.wyz, axis)) / max(mean, 1.1754944e-38), 1.73205081);
  float cosine = dot(axis, normal);
  float zonal = 0.31539157 * (3.0 * cosine * cosine - 1.0);
  float linear = 0.88622693 * sh.x + 1.02332671 * dot(sh.wyz, normal);
  return linear + 0.78539816 * mean * (0.08 * ratio + 0.6 * ratio * ratio) * zonal;
}
#endif

// How surely the probe sees the point at `offset` from it: one-sided Chebyshev, cubed.
float probe_visibility(int volume, int probe, vec3 offset)
{
  float distance = length(offset);
  if (distance <= 1e-6 * indirect.centre[volume].w) {
    offset = vec3(0.0, 0.0, 1.0);
  }
  int tile = indirect.tile[volume].x;
  vec2 position = (octahedral_encode(offset) + 1.0) * (0.5 * float(tile)) + 0.5;
  ivec2 low = clamp(ivec2(position), ivec2(0), ivec2(tile));
  vec2 f = position - vec2(low);
  int texel = indirect.tile[volume].y + (probe * (tile + 2) + low.y) * (tile + 1) + low.x;
  vec4 lower = list_texel(indirect_distances, texel, 1, 0);
  vec4 upper = list_texel(indirect_distances, texel + tile + 1, 1, 0);
  vec2 below = (1.0 - f.x) * lower.xy + f.x * lower.zw;
  vec2 above = (1.0 - f.x) * upper.xy + f.x * upper.zw;
  vec2 moments = below + f.y * (above - below);
  float behind = max(distance - moments.x, 0.0);
  float variance = abs(moments.y - moments.x * moments.x);
  float bound = variance / max(variance + behind * behind, 1.1754944e-38);
  return behind > 0.0 ? bound * bound * bound : 1.0;
}

// Irradiance of one volume at `offset` from its centre, where its samples' coordinates are `lattice`.
vec3 probe_volume_irradiance(int volume, vec3 offset, vec3 lattice, vec3 normal, vec4 basis[SH_BLOCKS])
{
  ivec3 last = indirect.resolution[volume].xyz - 1;
  vec3 position = clamp(lattice, vec3(0.0), vec3(last));
  ivec3 low = min(ivec3(position), max(last - 1, ivec3(0)));
  vec3 f = position - vec3(low);
  vec3 biased = offset + indirect.centre[volume].w * normal;
  ProbeSum sum;
  sum.irradiance = vec3(0.0);
#if PROBE_RECONSTRUCTION != PROBES_LINEAR
  sum.red = sum.green = sum.blue = vec4(0.0);
#endif
  float total = 0.0;
  for (int corner = 0; corner < 8; corner++) {
    ivec3 step = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    ivec3 cell = min(low + step, last);
    vec3 along = mix(1.0 - f, f, vec3(step));
    float trilinear = along.x * along.y * along.z;
    if (trilinear == 0.0) {
      continue;
    }
    int index = (cell.z * (last.y + 1) + cell.y) * (last.x + 1) + cell.x;
    int probe = indirect.resolution[volume].w + index;
    vec4 place = list_texel(indirect_probes, probe, PROBE_TEXELS, 0);
    float seen = 1.0;
#ifdef PROBE_NORMAL_WEIGHT
    vec3 towards = place.xyz - offset;
    float distance = length(towards);
    float cosine = distance > 0.0 ? dot(towards, normal) / max(distance, 1.1754944e-38) : 1.0;
    float wrapped = 0.5 * (cosine + 1.0);
    seen *= wrapped * wrapped + 0.2;
#endif
#ifdef PROBE_VISIBILITY
    seen *= probe_visibility(volume, index, biased - place.xyz);
#endif
    seen = seen < 0.2 ? seen * seen * seen / 0.04 : seen;
    float weight = trilinear * ((place.w != 0.0 ? seen + 1e-4 : 0.0) + 1e-12);
    total += weight;
#if PROBE_RECONSTRUCTION == PROBES_LINEAR
    vec3 irradiance = vec3(0.0);
    for (int block = 0; block < SH_BLOCKS; block++) {
      irradiance += vec3(dot(basis[block], list_texel(indirect_probes, probe, PROBE_TEXELS, 1 + block)),
                         dot(basis[block], list_texel(indirect_probes, probe, PROBE_TEXELS, 1 + SH_BLOCKS + block)),
                         dot(basis[block], list_texel(indirect_probes, probe, PROBE_TEXELS, 1 + 2 * SH_BLOCKS + block)));
    }
    sum.irradiance += weight * irradiance;
#else
    sum.red += weight * list_texel(indirect_probes, probe, PROBE_TEXELS, 1);
    sum.green += weight * list_texel(indirect_probes, probe, PROBE_TEXELS, 2);
    sum.blue += weight * list_texel(indirect_probes, probe, PROBE_TEXELS, 3);
#endif
  }
  float scale = 1.0 / total;
#if PROBE_RECONSTRUCTION == PROBES_GEOMERICS
  sum.irradiance = vec3(probe_geomerics(scale * sum.red, normal), probe_geomerics(scale * sum.green, normal),
                        probe_geomerics(scale * sum.blue, normal));
#elif PROBE_RECONSTRUCTION == PROBES_ZH3
  vec3 axis = 0.2126 * sum.red.wyz + 0.7152 * sum.green.wyz + 0.0722 * sum.blue.wyz;
  axis /= max(length(axis), 1.1754944e-38);
  sum.irradiance = vec3(probe_zh3(scale * sum.red, normal, axis), probe_zh3(scale * sum.green, normal, axis),
                        probe_zh3(scale * sum.blue, normal, axis));
#else
  sum.irradiance *= scale;
#endif
  return max(sum.irradiance, 0.0);
}

// 1 inside the volume, falling to 0 over its outermost cell.
float probe_coverage(int volume, vec3 lattice)
{
  vec3 resolution = vec3(indirect.resolution[volume].xyz);
  vec3 depth = min(lattice + 0.5, resolution - 0.5 - lattice) / min(0.5 * resolution, 1.0);
  return clamp(min(depth.x, min(depth.y, depth.z)), 0.0, 1.0);
}

// From the point to the volume's box [m].
float probe_distance(int volume, vec3 lattice)
{
  vec3 local = (2.0 * lattice + 1.0) / vec3(indirect.resolution[volume].xyz) - 1.0;
  return length(mat3(indirect.world_from_local[volume]) * (clamp(local, -1.0, 1.0) - local));
}

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec4 basis[SH_BLOCKS];
  sh_basis(normal_world, basis);
  vec3 sum = vec3(0.0);
  float total = 0.0;
  float left = 1.0;
  int nearest = 0;
  float nearest_distance = 3.402823e38;
  for (int volume = 0; volume < PROBE_VOLUMES; volume++) {
    vec3 offset = position_world - indirect.centre[volume].xyz;
    vec3 lattice = (indirect.lattice_from_offset[volume] * vec4(offset, 1.0)).xyz;
    float covered = probe_coverage(volume, lattice);
    float share = left * covered;
    left *= 1.0 - covered;
    total += share;
    if (share > 0.0) {
      sum += share * probe_volume_irradiance(volume, offset, lattice, normal_world, basis);
    }
    else {
      float distance = probe_distance(volume, lattice);
      nearest = distance < nearest_distance ? volume : nearest;
      nearest_distance = min(distance, nearest_distance);
    }
  }
  if (total > 0.0) {
    return sum / total;
  }
  vec3 offset = position_world - indirect.centre[nearest].xyz;
  vec3 lattice = (indirect.lattice_from_offset[nearest] * vec4(offset, 1.0)).xyz;
  return probe_volume_irradiance(nearest, offset, lattice, normal_world, basis);
}
