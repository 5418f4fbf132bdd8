// Irradiance from SH probes: eight neighbours of each volume that reaches the point, weighted by what they can know of it
// (techniques/lattice/lookup.py, which derives it), volumes blended as in techniques/lattice/field.py. Materials here have no bumps,
// so the shading normal is the surface's own, too.
// With PROBE_SCATTERED some volumes' eight are nodes, each of which names up to four probes in indirect_nodes.
// A probe: (position from its volume's centre, 1 if it holds light), then its coefficients channel by channel.
// Distances: bordered octahedral tiles of (mean, mean square) of a texel and of the next one in its row.
#include "include/list.glsl"
#include "include/probe_weights.glsl"
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
  float r = min(along / max(1.73205081 * mean, RTGI_TINY), 1.0);
  float q = clamp(0.5 * (1.0 + dot(vector / max(along, RTGI_TINY), normal)), 0.0, 1.0);
  float p = 1.0 + 2.0 * r;
  float a = (1.0 - r) / (1.0 + r);
  return RTGI_COSINE_0 * mean * (a + (1.0 - a) * (p + 1.0) * pow(q, p));
}
#endif

#if PROBE_RECONSTRUCTION == PROBES_ZH3
float probe_zh3(vec4 sh, vec3 normal, vec3 axis)
{
  float mean = max(sh.x, 0.0);
  float ratio = min(abs(dot(sh.wyz, axis)) / max(mean, RTGI_TINY), 1.73205081);
  float cosine = dot(axis, normal);
  float zonal = RTGI_COSINE_2_ZONAL * (3.0 * cosine * cosine - 1.0);
  float linear = RTGI_COSINE_0 * sh.x + RTGI_COSINE_1 * dot(sh.wyz, normal);
  return linear + mean * (0.08 * ratio + 0.6 * ratio * ratio) * zonal;
}
#endif

#if PROBE_RECONSTRUCTION == PROBES_LINEAR
// The basis that the probes' coefficients are held against: up to the second order with the cosine lobe, which those of higher
// orders have in them.
void probe_basis(vec3 normal, out vec4 basis[SH_BLOCKS])
{
#  if SH_ORDER <= 2
  vec4 second;
  float ninth;
  rtgi_cosine_basis(normal, basis[0], second, ninth);
#    if SH_ORDER == 2
  basis[1] = second;
  basis[2] = vec4(ninth, 0.0, 0.0, 0.0);
#    endif
#  else
  sh_basis(normal, basis);
#  endif
}
#endif

// How surely the probe sees the point at offset from it.
float probe_visibility(int volume, int probe, vec3 offset)
{
  int tile = indirect.tile[volume].x;
  vec2 position = rtgi_tile_position(offset, tile, indirect.centre[volume].w);
  ivec2 low = clamp(ivec2(position), ivec2(0), ivec2(tile));
  vec2 f = position - vec2(low);
  int texel = indirect.tile[volume].y + (probe * (tile + 2) + low.y) * (tile + 1) + low.x;
  vec4 row = mix(list_texel(indirect_distances, texel, 1, 0), list_texel(indirect_distances, texel + tile + 1, 1, 0), f.y);
  return rtgi_seen_share(length(offset), mix(row.xy, row.zw, f.x));
}

// The samples' coordinates of a point at offset from the volume's centre.
vec3 probe_lattice(int volume, vec3 offset)
{
  return (indirect.lattice_from_offset[volume] * vec4(offset, 1.0)).xyz;
}

// Adds a probe of one volume with its share in a point at offset from the volume's centre, which must be seen at `biased`; `meant`
// says that the probe is one that is read there, and does not stand in for others.
void probe_add(int volume, int index, vec3 offset, vec3 biased, vec3 normal, vec4 basis[SH_BLOCKS], float share, bool meant,
               inout ProbeSum sum, inout float total)
{
  int probe = indirect.resolution[volume].w + index;
  vec4 place = list_texel(indirect_probes, probe, PROBE_TEXELS, 0);
  float seen = 1.0;
#ifdef PROBE_NORMAL_WEIGHT
  seen *= rtgi_side_weight(place.xyz - offset, normal);
#endif
#ifdef PROBE_VISIBILITY
  seen *= probe_visibility(volume, index, biased - place.xyz);
#endif
  float weight = rtgi_probe_weight(share, seen, meant && place.w != 0.0);
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

// Irradiance of one volume at `offset` from its centre.
vec3 probe_volume_irradiance(int volume, vec3 offset, vec3 normal, vec4 basis[SH_BLOCKS])
{
  vec3 lattice = probe_lattice(volume, rtgi_lifted(offset, normal, indirect.centre[volume].w));
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
#ifdef PROBE_SCATTERED
    bool scattered = indirect.tile[volume].z != 0;
    vec4 words = scattered ? list_texel(indirect_nodes, indirect.tile[volume].w + index, 1, 0) : vec4(0.0);
    for (int slot = 0; slot < (scattered ? 4 : 1); slot++) {
      float word = words[slot];
      bool meant = word >= 0.0;
      float share = scattered ? trilinear * rtgi_word_share(word) : trilinear;
      index = scattered ? rtgi_word_probe(word) : index;
      if (share > 0.0) {
        probe_add(volume, index, offset, biased, normal, basis, share, meant, sum, total);
      }
    }
#else
    probe_add(volume, index, offset, biased, normal, basis, trilinear, true, sum, total);
#endif
  }
  float scale = 1.0 / total;
#if PROBE_RECONSTRUCTION == PROBES_GEOMERICS
  sum.irradiance = vec3(probe_geomerics(scale * sum.red, normal), probe_geomerics(scale * sum.green, normal),
                        probe_geomerics(scale * sum.blue, normal));
#elif PROBE_RECONSTRUCTION == PROBES_ZH3
  vec3 axis = 0.2126 * sum.red.wyz + 0.7152 * sum.green.wyz + 0.0722 * sum.blue.wyz;
  axis /= max(length(axis), RTGI_TINY);
  sum.irradiance = vec3(probe_zh3(scale * sum.red, normal, axis), probe_zh3(scale * sum.green, normal, axis),
                        probe_zh3(scale * sum.blue, normal, axis));
#else
  sum.irradiance *= scale;
#endif
  return max(sum.irradiance, 0.0);
}

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec4 basis[SH_BLOCKS];
#if PROBE_RECONSTRUCTION == PROBES_LINEAR
  probe_basis(normal_world, basis);
#endif
  vec3 sum = vec3(0.0);
  float total = 0.0;
  float left = 1.0;
  int nearest = 0;
  float nearest_distance = 3.402823e38;
  for (int volume = 0; volume < PROBE_VOLUMES; volume++) {
    vec3 offset = position_world - indirect.centre[volume].xyz;
    vec3 lattice = probe_lattice(volume, offset);
    vec3 resolution = vec3(indirect.resolution[volume].xyz);
    float covered = rtgi_coverage(lattice, resolution);
    float share = left * covered;
    left *= 1.0 - covered;
    total += share;
    if (share > 0.0) {
      sum += share * probe_volume_irradiance(volume, offset, normal_world, basis);
    }
    else {
      float distance = length(mat3(indirect.offset_from_lattice[volume]) * rtgi_to_box(lattice, resolution));
      nearest = distance < nearest_distance ? volume : nearest;
      nearest_distance = min(distance, nearest_distance);
    }
  }
  if (total > 0.0) {
    return sum / total;
  }
  return probe_volume_irradiance(nearest, position_world - indirect.centre[nearest].xyz, normal_world, basis);
}
