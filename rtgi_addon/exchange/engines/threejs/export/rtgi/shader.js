// The look-up on the GPU, as it is spliced into three's own materials. lookup.js is the same on the CPU and says what it does.

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
varying vec3 vRTGIPosition;

#define RTGI_TINY 1.1754944e-38

ivec2 rtgiTexel(int index, int width) {
  return ivec2(index % width, index / width);
}

// The square that directions are unfolded to, from -1 to 1. Tiles keep Blender's axes.
vec2 rtgiOctahedral(vec3 direction) {
  vec3 d = vec3(direction.x, -direction.z, direction.y);
  vec2 xy = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
  vec2 folded = (1.0 - abs(xy.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(xy, vec2(0.0)));
  return d.z < 0.0 ? folded : xy;
}

// Distance and its square in two neighbouring texels of a row, (mean, mean square) each.
vec4 rtgiMoments(int texel, float distanceStep) {
  vec4 pair = distanceStep * vec4(texelFetch(rtgiDistances, rtgiTexel(texel, textureSize(rtgiDistances, 0).x), 0));
  vec2 squared = pair.xz * pair.xz + pair.yw * pair.yw;
  return vec4(pair.x, squared.x, pair.z, squared.y);
}

// How surely the probe sees the point at offset from it: one-sided Chebyshev, cubed.
float rtgiVisibility(int volume, int probe, vec3 offset) {
  float distance = length(offset);
  if (distance <= 1e-6 * rtgiCentre[volume].w) {
    offset = vec3(0.0, 1.0, 0.0);
  }
  int tile = rtgiTile[volume].x;
  vec2 position = (rtgiOctahedral(offset) + 1.0) * (0.5 * float(tile)) + 0.5;
  ivec2 low = clamp(ivec2(position), ivec2(0), ivec2(tile));
  vec2 f = position - vec2(low);
  int texel = rtgiTile[volume].y + (probe * (tile + 2) + low.y) * (tile + 1) + low.x;
  vec4 lower = rtgiMoments(texel, rtgiDistanceStep[volume]);
  vec4 upper = rtgiMoments(texel + tile + 1, rtgiDistanceStep[volume]);
  vec4 row = mix(lower, upper, f.y);
  vec2 moments = mix(row.xy, row.zw, f.x);
  float behind = max(distance - moments.x, 0.0);
  float variance = abs(moments.y - moments.x * moments.x);
  float bound = variance / max(variance + behind * behind, RTGI_TINY);
  return behind > 0.0 ? bound * bound * bound : 1.0;
}

// Irradiance from one volume at offset from its centre, where its probes' coordinates are lattice.
vec3 rtgiVolumeIrradiance(int volume, vec3 offset, vec3 lattice, vec3 normal, vec3 surfaceNormal, float basis[9]) {
  ivec3 last = rtgiResolution[volume].xyz - 1;
  vec3 position = clamp(lattice, vec3(0.0), vec3(last));
  ivec3 low = min(ivec3(position), max(last - 1, ivec3(0)));
  vec3 f = position - vec3(low);
  vec3 biased = offset + rtgiCentre[volume].w * surfaceNormal;
  int perRow = textureSize(rtgiProbes, 0).x / 9;
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
    ivec2 texel = rtgiTexel(rtgiResolution[volume].w + index, perRow) * ivec2(9, 1);
    vec4 c0 = texelFetch(rtgiProbes, texel, 0);
    vec4 c1 = texelFetch(rtgiProbes, texel + ivec2(1, 0), 0);
    vec4 c2 = texelFetch(rtgiProbes, texel + ivec2(2, 0), 0);
    vec4 c3 = texelFetch(rtgiProbes, texel + ivec2(3, 0), 0);
    vec3 place = (rtgiOffsetFromLattice[volume] * vec4(cell, 1.0)).xyz + vec3(c0.w, c1.w, c2.w);
    vec3 towards = place - offset;
    float distance = length(towards);
    float cosine = distance > 0.0 ? dot(towards, normal) / max(distance, RTGI_TINY) : 1.0;
    float wrapped = 0.5 * (cosine + 1.0);
    float seen = (wrapped * wrapped + 0.2) * rtgiVisibility(volume, index, biased - place);
    seen = seen < 0.2 ? seen * seen * seen / 0.04 : seen;
    float weight = trilinear * ((c3.w != 0.0 ? seen + 1e-4 : 0.0) + 1e-12);
    total += weight;
    vec3 irradiance = basis[0] * c0.rgb + basis[1] * c1.rgb + basis[2] * c2.rgb + basis[3] * c3.rgb;
    for (int i = 4; i < 9; i++) {
      irradiance += basis[i] * texelFetch(rtgiProbes, texel + ivec2(i, 0), 0).rgb;
    }
    sum += weight * irradiance;
  }
  return max(sum / total, 0.0);
}

// 1 inside the volume, falling to 0 over its outermost cell.
float rtgiCoverage(int volume, vec3 lattice) {
  vec3 resolution = vec3(rtgiResolution[volume].xyz);
  vec3 depth = min(lattice + 0.5, resolution - 0.5 - lattice) / min(0.5 * resolution, 1.0);
  return clamp(min(depth.x, min(depth.y, depth.z)), 0.0, 1.0);
}

// Irradiance at a point of the probes' space on a surface whose geometry faces surfaceNormal and whose shading faces normal.
vec3 rtgiIrradiance(vec3 position, vec3 normal, vec3 surfaceNormal) {
  // The harmonics, convolved with the cosine lobe.
  float basis[9];
  basis[0] = 0.88622693;
  basis[1] = 1.02332671 * normal.y;
  basis[2] = 1.02332671 * normal.z;
  basis[3] = 1.02332671 * normal.x;
  basis[4] = 0.85808553 * normal.x * normal.y;
  basis[5] = 0.85808553 * normal.y * normal.z;
  basis[6] = 0.74312386 * normal.z * normal.z - 0.24770796;
  basis[7] = 0.85808553 * normal.x * normal.z;
  basis[8] = 0.42904277 * (normal.x + normal.y) * (normal.x - normal.y);
  float share[RTGI_VOLUMES];
  float total = 0.0;
  float left = 1.0;
  int nearest = 0;
  float nearestDistance = 3.402823e38;
  for (int volume = 0; volume < RTGI_VOLUMES; volume++) {
    vec3 lattice = (rtgiLatticeFromOffset[volume] * vec4(position - rtgiCentre[volume].xyz, 1.0)).xyz;
    float covered = rtgiCoverage(volume, lattice);
    share[volume] = left * covered;
    left *= 1.0 - covered;
    total += share[volume];
    vec3 inside = clamp(lattice, vec3(-0.5), vec3(rtgiResolution[volume].xyz) - 0.5);
    float distance = length(mat3(rtgiOffsetFromLattice[volume]) * (inside - lattice));
    nearest = distance < nearestDistance ? volume : nearest;
    nearestDistance = min(distance, nearestDistance);
  }
  if (total == 0.0) {
    share[nearest] = total = 1.0;
  }
  vec3 sum = vec3(0.0);
  for (int volume = 0; volume < RTGI_VOLUMES; volume++) {
    if (share[volume] > 0.0) {
      vec3 offset = position - rtgiCentre[volume].xyz;
      vec3 lattice = (rtgiLatticeFromOffset[volume] * vec4(offset, 1.0)).xyz;
      sum += share[volume] * rtgiVolumeIrradiance(volume, offset, lattice, normal, surfaceNormal, basis);
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
  ['fragmentShader', 'lights_pars_begin', '', fragmentPars],
  ['fragmentShader', 'lights_fragment_begin', '#undef USE_LIGHT_PROBES\n', ''],
  ['fragmentShader', 'lights_fragment_maps', '', fragmentMain],
];

// Splice the look-up of `volumes` volumes into `shader`, as onBeforeCompile receives it. `name` is the material's, for errors.
export function spliceProbes(shader, volumes, name) {
  for (const [stage, chunk, before, after] of splices) {
    const include = `#include <${chunk}>`;
    if (!shader[stage].includes(include)) {
      throw new Error(`RTGI: the ${stage} of material "${name}" has no ${include}, after which the probes are read: ` +
        'use a built-in lit material of three 0.160 or later, and apply the probes before other changes of its shader');
    }
    const define = chunk === 'lights_pars_begin' ? `#define RTGI_VOLUMES ${volumes}\n` : '';
    shader[stage] = shader[stage].replace(include, () => `${before}${include}\n${define}${after}`);
  }
}
