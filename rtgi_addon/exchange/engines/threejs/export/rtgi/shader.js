// The look-up on the GPU, as it is spliced into three's own materials. lookup.js is the same on the CPU and says what it does;
// weights.js has its functions of places and distances alone, which all of RTGI's shaders share.

import { weights } from './weights.js';

// Where others may add to the look-up's functions, and to its light.
export const DECLARED = '// RTGI: declared\n', LIT = '// RTGI: lit\n';

const vertexPars = /* glsl */ `
uniform mat4 rtgiFromWorld;
varying vec3 vRTGIPosition;
`;

const vertexMain = /* glsl */ `
vec4 rtgiPosition = vec4(transformed, 1.0);
#ifdef USE_BATCHING
  rtgiPosition = batchingMatrix * rtgiPosition;
#endif
#ifdef USE_INSTANCING
  rtgiPosition = instanceMatrix * rtgiPosition;
#endif
vRTGIPosition = (rtgiFromWorld * (modelMatrix * rtgiPosition)).xyz;
`;

const fragmentPars = /* glsl */ `
// A probe is nine texels: its radiance coefficients; in the fourth channel of the first four its offset from the lattice point and
// whether it holds light.
uniform highp sampler2D rtgiProbes;
// Bordered octahedral tiles of (mean, deviation) of the distance, of a texel and of the next one in its row.
uniform highp usampler2D rtgiDistances;
uniform mat4 rtgiFromWorld;
uniform float rtgiIntensity;
uniform mat4 rtgiLatticeFromOffset[RTGI_VOLUMES];
uniform mat4 rtgiOffsetFromLattice[RTGI_VOLUMES];
uniform vec4 rtgiCentre[RTGI_VOLUMES];      // the volume's centre; how far the point that must be seen is moved along its normal
uniform ivec4 rtgiResolution[RTGI_VOLUMES]; // probes along the axes; its first probe
uniform ivec2 rtgiTile[RTGI_VOLUMES];       // texels along a tile without its border; its first texel
uniform float rtgiDistanceStep[RTGI_VOLUMES];
#ifdef RTGI_SCATTERED
// What the nodes of scattered volumes name: four words each.
uniform highp sampler2D rtgiWords;
uniform ivec2 rtgiNodes[RTGI_VOLUMES];      // the volume's first node; whether it is scattered
#endif
varying vec3 vRTGIPosition;

${weights}
ivec2 rtgiTexel(int index, int width) {
  return ivec2(index % width, index / width);
}

// Distance and its square in two neighbouring texels of a row, (mean, mean square) each.
vec4 rtgiMoments(int texel, float distanceStep) {
  vec4 pair = distanceStep * vec4(texelFetch(rtgiDistances, rtgiTexel(texel, textureSize(rtgiDistances, 0).x), 0));
  vec2 squared = pair.xz * pair.xz + pair.yw * pair.yw;
  return vec4(pair.x, squared.x, pair.z, squared.y);
}

// How surely the probe sees the point at offset from it. Tiles keep the bake's axes, with z up.
float rtgiVisibility(int volume, int probe, vec3 offset) {
  int tile = rtgiTile[volume].x;
  vec2 position = rtgi_tile_position(vec3(offset.x, -offset.z, offset.y), tile, rtgiCentre[volume].w);
  ivec2 low = clamp(ivec2(position), ivec2(0), ivec2(tile));
  vec2 f = position - vec2(low);
  int texel = rtgiTile[volume].y + (probe * (tile + 2) + low.y) * (tile + 1) + low.x;
  vec4 row = mix(rtgiMoments(texel, rtgiDistanceStep[volume]), rtgiMoments(texel + tile + 1, rtgiDistanceStep[volume]), f.y);
  return rtgi_seen_share(length(offset), mix(row.xy, row.zw, f.x));
}

// The probes' coordinates of a point at offset from the volume's centre.
vec3 rtgiLattice(int volume, vec3 offset) {
  return (rtgiLatticeFromOffset[volume] * vec4(offset, 1.0)).xyz;
}

// Adds a probe, whose place counts from origin, with its share in the light at offset; meant says that it does not stand in for others.
void rtgiAdd(int volume, int index, vec3 origin, float share, bool meant, vec3 offset, vec3 surfaceNormal, float basis[9],
    inout vec3 sum, inout float total) {
  ivec2 texel = rtgiTexel(rtgiResolution[volume].w + index, textureSize(rtgiProbes, 0).x / 9) * ivec2(9, 1);
  vec4 c0 = texelFetch(rtgiProbes, texel, 0);
  vec4 c1 = texelFetch(rtgiProbes, texel + ivec2(1, 0), 0);
  vec4 c2 = texelFetch(rtgiProbes, texel + ivec2(2, 0), 0);
  vec4 c3 = texelFetch(rtgiProbes, texel + ivec2(3, 0), 0);
  vec3 place = origin + vec3(c0.w, c1.w, c2.w);
  vec3 biased = offset + rtgiCentre[volume].w * surfaceNormal;
  float seen = rtgi_side_weight(place - offset, surfaceNormal) * rtgiVisibility(volume, index, biased - place);
  float weight = rtgi_probe_weight(share, seen, meant && c3.w != 0.0);
  total += weight;
  vec3 irradiance = basis[0] * c0.rgb + basis[1] * c1.rgb + basis[2] * c2.rgb + basis[3] * c3.rgb;
  for (int i = 4; i < 9; i++) {
    irradiance += basis[i] * texelFetch(rtgiProbes, texel + ivec2(i, 0), 0).rgb;
  }
  sum += weight * irradiance;
}

// Irradiance from one volume at offset from its centre.
vec3 rtgiVolumeIrradiance(int volume, vec3 offset, vec3 surfaceNormal, float basis[9]) {
  vec3 lattice = rtgiLattice(volume, rtgi_lifted(offset, surfaceNormal, rtgiCentre[volume].w));
  ivec3 last = rtgiResolution[volume].xyz - 1;
  vec3 position = clamp(lattice, vec3(0.0), vec3(last));
  ivec3 low = min(ivec3(position), max(last - 1, ivec3(0)));
  vec3 f = position - vec3(low);
  vec3 sum = vec3(0.0);
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
#ifdef RTGI_SCATTERED
    if (rtgiNodes[volume].y != 0) {
      vec4 words = texelFetch(rtgiWords, rtgiTexel(rtgiNodes[volume].x + index, textureSize(rtgiWords, 0).x), 0);
      for (int slot = 0; slot < 4; slot++) {
        float word = words[slot];
        if (word != 0.0) {
          rtgiAdd(volume, rtgi_word_probe(word), vec3(0.0), trilinear * rtgi_word_share(word), word > 0.0, offset, surfaceNormal,
            basis, sum, total);
        }
      }
      continue;
    }
#endif
    rtgiAdd(volume, index, (rtgiOffsetFromLattice[volume] * vec4(cell, 1.0)).xyz, trilinear, true, offset, surfaceNormal, basis,
      sum, total);
  }
  return max(sum / total, 0.0);
}

// Irradiance at a point of the probes' space on a surface whose geometry faces surfaceNormal and whose shading faces normal.
vec3 rtgiIrradiance(vec3 position, vec3 normal, vec3 surfaceNormal) {
  vec4 first, second;
  float ninth;
  rtgi_cosine_basis(normal, first, second, ninth);
  float basis[9] = float[9](first.x, first.y, first.z, first.w, second.x, second.y, second.z, second.w, ninth);
  float share[RTGI_VOLUMES];
  float total = 0.0;
  float left = 1.0;
  int nearest = 0;
  float nearestDistance = 3.402823e38;
  for (int volume = 0; volume < RTGI_VOLUMES; volume++) {
    vec3 lattice = rtgiLattice(volume, position - rtgiCentre[volume].xyz);
    vec3 resolution = vec3(rtgiResolution[volume].xyz);
    float covered = rtgi_coverage(lattice, resolution);
    share[volume] = left * covered;
    left *= 1.0 - covered;
    total += share[volume];
    float distance = length(mat3(rtgiOffsetFromLattice[volume]) * rtgi_to_box(lattice, resolution));
    nearest = distance < nearestDistance ? volume : nearest;
    nearestDistance = min(distance, nearestDistance);
  }
  if (total == 0.0) {
    share[nearest] = total = 1.0;
  }
  vec3 sum = vec3(0.0);
  for (int volume = 0; volume < RTGI_VOLUMES; volume++) {
    if (share[volume] > 0.0) {
      sum += share[volume] * rtgiVolumeIrradiance(volume, position - rtgiCentre[volume].xyz, surfaceNormal, basis);
    }
  }
  return sum / total;
}

// From view space to the probes'; those are turned and scaled alike along all axes, so that no inverse is needed.
vec3 rtgiNormal(vec3 normal) {
  return normalize(mat3(rtgiFromWorld) * (vec4(normal, 0.0) * viewMatrix).xyz);
}
`;

// A physical material takes the probes as it takes an environment: diffuse, and for its specular lobe where the scene has no
// environment map. The diffuse light of such a map is left out, as the probes hold the sky already.
const fragmentMain = /* glsl */ `
#if defined(RE_IndirectDiffuse)
  vec3 rtgiLight = rtgiIntensity * rtgiIrradiance(vRTGIPosition, rtgiNormal(normal), rtgiNormal(nonPerturbedNormal));
  #if defined(RE_IndirectSpecular)
    iblIrradiance = rtgiLight;
    #ifndef USE_ENVMAP
      radiance += rtgiLight * RECIPROCAL_PI;
      #ifdef USE_CLEARCOAT
        clearcoatRadiance += rtgiLight * RECIPROCAL_PI;
      #endif
    #endif
  #else
    iblIrradiance = vec3(0.0);
    irradiance += rtgiLight;
  #endif
#endif
`;

// What is spliced in: [shader, include of three's, before it, after it]. Light probes hold the same light for objects without the
// hook, so hooked materials leave them out.
const splices = [
  ['vertexShader', 'common', '', vertexPars],
  ['vertexShader', 'project_vertex', '', vertexMain],
  ['fragmentShader', 'lights_pars_begin', '', fragmentPars + DECLARED],
  ['fragmentShader', 'lights_fragment_begin', '#undef USE_LIGHT_PROBES\n', ''],
  ['fragmentShader', 'lights_fragment_maps', '', fragmentMain + LIT],
];

// Splice the look-up of `volumes` into `shader`, as onBeforeCompile receives it. `name` is the material's, for errors.
export function spliceProbes(shader, volumes, name) {
  const scattered = volumes.some(({ probes }) => probes !== undefined) ? '#define RTGI_SCATTERED\n' : '';
  for (const [stage, chunk, before, after] of splices) {
    const include = `#include <${chunk}>`;
    if (!shader[stage].includes(include)) {
      throw new Error(`RTGI: the ${stage} of material "${name}" has no ${include}, after which the probes are read: ` +
        'use a built-in lit material of three 0.160 or later, and apply the probes before other changes of its shader');
    }
    const define = chunk === 'lights_pars_begin' ? `#define RTGI_VOLUMES ${volumes.length}\n${scattered}` : '';
    shader[stage] = shader[stage].replace(include, () => `${before}${include}\n${define}${after}`);
  }
}
