// The probes as a light for WebGPURenderer (three r187 or later) and its WebGL 2 backend: shader.js once more, in three's own
// shading language, with the numbers of lookup.js. As every light it lights all materials of its scene, so nothing is applied to them:
//
//   scene.add(probes, new RTGIProbeLight(probes));

import {
  AnalyticLightNode, DataTexture, FloatType, Light, NearestFilter, NodeUpdateType, PhysicalLightingModel, RGBAFormat, Vector4,
} from 'three/webgpu';
import {
  Fn, If, Loop, array, bool, float, frontFacing, int, ivec2, ivec3, length, mat4, max, min, mix, normalWorld, normalWorldGeometry,
  normalize, positionWorld, renderGroup, select, sqrt, texture, uniform, uniformArray, vec2, vec3, vec4,
} from 'three/tsl';
import {
  AT_PROBE, COEFFICIENTS, COSINE_0, COSINE_1, COSINE_2, COSINE_2_ZONAL, CRUSH_BELOW, DILATED_FLOOR, LIFT, SHARES, SIDE_FLOOR,
  TINY, UNSEEN_FLOOR, WORD,
} from './lookup.js';

const VOLUME_VECTORS = 12;

// Light from the probes on everything in the scene. Light that comes from `scene.environment` is added to it: leave that out, or
// lower `scene.environmentIntensity`, where the probes hold the sky.
export class RTGIProbeLight extends Light {
  constructor(probes) {
    if (!Light.registerNode) {
      throw new Error('RTGI: RTGIProbeLight needs three r187 or later; WebGLRenderer does with probes.apply(model)');
    }
    super();
    this.isRTGIProbeLight = true;
    this.type = 'RTGIProbeLight';
    this.probes = probes;
    const { data, width, height } = probes.uniforms.rtgiDistances.value.image;
    // The nodes read no textures of 16-bit integers.
    this.distances = new DataTexture(Float32Array.from(data), width, height, RGBAFormat, FloatType);
    this.distances.magFilter = this.distances.minFilter = NearestFilter;
    this.distances.needsUpdate = true;
  }

  clone(recursive) {
    return new RTGIProbeLight(this.probes).copy(this, recursive);
  }

  // Free this light's texture; the probes free theirs.
  dispose() {
    super.dispose();
    this.distances.dispose();
  }
}

// A volume as vectors. A float holds no more than 24 bits of a whole number, so the first texel is split.
function volumeVectors(volume) {
  const values = [...volume.latticeFromOffset, ...volume.offsetFromLattice, ...volume.centre, volume.normalBias,
    ...volume.resolution, volume.firstProbe, volume.tile, volume.firstTexel >> 12, volume.firstTexel & 4095, volume.distanceStep,
    volume.firstNode, volume.probes === undefined ? 0 : 1, 0, 0];
  return Array.from({ length: VOLUME_VECTORS }, (_, i) => new Vector4().fromArray(values, 4 * i));
}

// What volumeVectors stored of the volume at `index`.
function readVolume({ volumes }, index) {
  const vector = (i) => volumes.element(index.mul(VOLUME_VECTORS).add(i));
  const matrix = (i) => mat4(vector(i), vector(i + 1), vector(i + 2), vector(i + 3)).toVar();
  const [centre, resolution, tile, nodes] = [8, 9, 10, 11].map((i) => vector(i).toVar());
  return { latticeFromOffset: matrix(0), offsetFromLattice: matrix(4), centre: centre.xyz, normalBias: centre.w,
    resolution: ivec3(resolution.xyz).toVar(), firstProbe: int(resolution.w), tile: int(tile.x),
    firstTexel: int(tile.y).mul(4096).add(int(tile.z)), distanceStep: tile.w,
    firstNode: int(nodes.x), scattered: nodes.y };
}

const latticeOf = (volume, offset) => volume.latticeFromOffset.mul(vec4(offset, 1)).xyz.toVar();

// The square that directions are unfolded to, from -1 to 1. Tiles keep Blender's axes.
function octahedral(direction) {
  const d = vec3(direction.x, direction.z.negate(), direction.y).toVar();
  const xy = d.xy.div(d.x.abs().add(d.y.abs()).add(d.z.abs())).toVar();
  const folded = vec2(1).sub(xy.yx.abs()).mul(vec2(select(xy.x.lessThan(0), -1, 1), select(xy.y.lessThan(0), -1, 1)));
  return select(d.z.lessThan(0), folded, xy);
}

// How surely the probe sees the point at `offset` from it.
function visibility(read, volume, probe, offset) {
  const distance = length(offset).toVar();
  const direction = select(distance.lessThanEqual(volume.normalBias.mul(AT_PROBE)), vec3(0, 1, 0), offset);
  const position = octahedral(direction).add(1).mul(float(volume.tile).mul(0.5)).add(0.5).toVar();
  const low = ivec2(position).clamp(ivec2(0), ivec2(volume.tile)).toVar();
  const f = position.sub(vec2(low)).toVar();
  const row = volume.tile.add(1);
  const texel = probe.mul(volume.tile.add(2)).add(low.y).mul(row).add(low.x).add(volume.firstTexel).toVar();
  const moments = (index) => {
    const pair = read.distances(index).mul(volume.distanceStep).toVar();
    return vec4(pair.x, pair.x.mul(pair.x).add(pair.y.mul(pair.y)), pair.z, pair.z.mul(pair.z).add(pair.w.mul(pair.w)));
  };
  const rows = mix(moments(texel), moments(texel.add(row)), f.y).toVar();
  return seenShare(distance, mix(rows.xy, rows.zw, f.x).toVar());
}

function seenShare(distance, moments) {
  const behind = distance.sub(moments.x).toVar();
  const variance = moments.y.sub(moments.x.mul(moments.x)).abs().toVar();
  const share = float(0.5).sub(behind.mul(0.5).div(sqrt(max(variance.add(behind.mul(behind)), TINY)))).toVar();
  return share.mul(share);
}

function sideWeight(towards, surfaceNormal) {
  const distance = length(towards).toVar();
  const cosine = select(distance.greaterThan(0), towards.dot(surfaceNormal).div(max(distance, TINY)), 1);
  const wrapped = cosine.add(1).mul(0.5).toVar();
  return wrapped.mul(wrapped).add(SIDE_FLOOR);
}

function probeWeight(trilinear, seen, live) {
  const crushed = select(seen.lessThan(CRUSH_BELOW), seen.mul(seen).mul(seen).div(CRUSH_BELOW ** 2), seen);
  return trilinear.mul(select(live, crushed.add(UNSEEN_FLOOR), 0).add(DILATED_FLOOR));
}

// Adds a probe, whose place counts from `origin`, with its share in the light at `offset`; `meant`: it does not stand in for others.
function addProbe(read, volume, index, origin, share, meant, offset, surfaceNormal, basis, sum, total) {
  const biased = offset.add(surfaceNormal.mul(volume.normalBias)).toVar();
  const c = read.probe(index.add(volume.firstProbe));
  const place = origin.add(vec3(c[0].w, c[1].w, c[2].w)).toVar();
  const seen = sideWeight(place.sub(offset).toVar(), surfaceNormal).mul(visibility(read, volume, index, biased.sub(place))).toVar();
  const weight = probeWeight(share, seen, c[3].w.notEqual(0).and(meant)).toVar();
  total.addAssign(weight);
  sum.addAssign(c.map(({ rgb }, k) => rgb.mul(basis[k])).reduce((a, b) => a.add(b)).mul(weight));
}

// Irradiance from one volume.
function volumeIrradiance(read, volume, position, surfaceNormal, basis) {
  const offset = position.sub(volume.centre).toVar();
  const lattice = latticeOf(volume, offset.add(surfaceNormal.mul(volume.normalBias.mul(LIFT))));
  const last = volume.resolution.sub(1).toVar();
  const clamped = lattice.clamp(vec3(0), vec3(last)).toVar();
  const low = min(ivec3(clamped), max(last.sub(1), ivec3(0))).toVar();
  const f = clamped.sub(vec3(low)).toVar();
  const sum = vec3(0).toVar(), total = float(0).toVar();
  Loop(8, ({ i }) => {
    const corner = int(i);
    const step = ivec3(corner.bitAnd(1), corner.shiftRight(1).bitAnd(1), corner.shiftRight(2)).toVar();
    const cell = min(low.add(step), last).toVar();
    const along = mix(vec3(1).sub(f), f, vec3(step)).toVar();
    const trilinear = along.x.mul(along.y).mul(along.z).toVar();
    If(trilinear.greaterThan(0), () => {
      const index = cell.z.mul(volume.resolution.y).add(cell.y).mul(volume.resolution.x).add(cell.x).toVar();
      const add = (probe, origin, share, meant) => addProbe(read, volume, probe, origin, share, meant, offset, surfaceNormal, basis,
        sum, total);
      if (!read.words) {
        add(index, volume.offsetFromLattice.mul(vec4(vec3(cell), 1)).xyz, trilinear, bool(true));
        return;
      }
      const scattered = volume.scattered.notEqual(0).toVar();
      const words = read.words(index.add(volume.firstNode)).toVar();
      const origin = select(scattered, vec3(0), volume.offsetFromLattice.mul(vec4(vec3(cell), 1)).xyz).toVar();
      Loop(select(scattered, int(4), int(1)), ({ i: slot }) => {
        const word = select(scattered, words.element(slot), float(SHARES)).toVar();
        const named = int(word.abs()).toVar();
        If(word.notEqual(0), () => {
          add(select(scattered, named.div(WORD), index).toVar(), origin, trilinear.mul(float(named.mod(WORD)).div(SHARES)).toVar(),
            word.greaterThan(0));
        });
      });
    });
  });
  return max(sum.div(total), 0);
}

// Irradiance at a point of the probes' space on a surface whose geometry faces surfaceNormal and whose shading faces normal.
function irradiance(read, count, position, normal, surfaceNormal) {
  const { x, y, z } = normal;
  const basis = [float(COSINE_0), y.mul(COSINE_1), z.mul(COSINE_1), x.mul(COSINE_1), x.mul(y).mul(COSINE_2), y.mul(z).mul(COSINE_2),
    z.mul(z).mul(3).sub(1).mul(COSINE_2_ZONAL), x.mul(z).mul(COSINE_2), x.add(y).mul(x.sub(y)).mul(0.5 * COSINE_2)]
    .map((value) => value.toVar());
  const shares = array('float', count).toVar();
  const total = float(0).toVar(), left = float(1).toVar(), nearest = int(0).toVar(), nearestDistance = float(3.402823e38).toVar();
  Loop(count, ({ i }) => {
    const volume = readVolume(read, int(i));
    const lattice = latticeOf(volume, position.sub(volume.centre));
    const resolution = vec3(volume.resolution).toVar();
    const depth = min(lattice.add(0.5), resolution.sub(0.5).sub(lattice)).div(min(resolution.mul(0.5), vec3(1))).toVar();
    const covered = min(depth.x, min(depth.y, depth.z)).clamp(0, 1).toVar();
    shares.element(i).assign(left.mul(covered));
    total.addAssign(left.mul(covered));
    left.mulAssign(covered.oneMinus());
    const outside = lattice.clamp(vec3(-0.5), resolution.sub(0.5)).sub(lattice);
    const distance = length(volume.offsetFromLattice.mul(vec4(outside, 0)).xyz).toVar();
    If(distance.lessThan(nearestDistance), () => {
      nearest.assign(int(i));
      nearestDistance.assign(distance);
    });
  });
  If(total.equal(0), () => {
    shares.element(nearest).assign(1);
    total.assign(1);
  });
  const sum = vec3(0).toVar();
  Loop(count, ({ i }) => {
    If(shares.element(i).greaterThan(0), () => {
      const volume = readVolume(read, int(i));
      sum.addAssign(volumeIrradiance(read, volume, position, surfaceNormal, basis).mul(shares.element(i)));
    });
  });
  return sum.div(total);
}

// How the shader reads the arrays of `light`.
function reader({ probes, distances }) {
  const { value } = probes.uniforms.rtgiProbes, wordsNode = probes.uniforms.rtgiWords && texture(probes.uniforms.rtgiWords.value);
  const [probesNode, distancesNode] = [texture(value), texture(distances)];
  const perRow = int(value.image.width / COEFFICIENTS), width = int(distances.image.width);
  return {
    words: wordsNode && ((index) => {
      const across = int(probes.uniforms.rtgiWords.value.image.width);
      return wordsNode.load(ivec2(index.mod(across), index.div(across)));
    }),
    volumes: uniformArray(probes.volumes.flatMap(volumeVectors)),
    distances: (index) => distancesNode.load(ivec2(index.mod(width), index.div(width))),
    probe: (index) => {
      const texel = ivec2(index.mod(perRow).mul(COEFFICIENTS), index.div(perRow)).toVar();
      return Array.from({ length: COEFFICIENTS }, (_, i) => probesNode.load(texel.add(ivec2(i, 0))).toVar());
    },
  };
}

class RTGIProbeLightNode extends AnalyticLightNode {
  static get type() {
    return 'RTGIProbeLightNode';
  }

  constructor(light = null) {
    super(light);
    this._fromWorld = uniform(light.probes.uniforms.rtgiFromWorld.value).setGroup(renderGroup);
    this._intensity = uniform(1).setGroup(renderGroup);
    this.updateType = NodeUpdateType.RENDER;
  }

  update() {
    this._intensity.value = this.light.intensity * this.light.probes.intensity;
  }

  setup({ context }) {
    const { probes } = this.light;
    const read = reader(this.light);
    const direction = (normal) => normalize(this._fromWorld.mul(vec4(normal, 0)).xyz).toVar();
    const light = Fn(() => {
      // The geometry's normal does not turn with the side that is seen; the shading's does.
      const side = select(frontFacing, 1, -1);
      const position = this._fromWorld.mul(vec4(positionWorld, 1)).xyz.toVar();
      return irradiance(read, probes.volumes.length, position, direction(normalWorld), direction(normalWorldGeometry.mul(side)));
    })().mul(this._intensity).toVar();
    // A physical material takes the probes as it takes an environment, its specular lobe included.
    if (context.lightingModel instanceof PhysicalLightingModel) {
      context.iblIrradiance.addAssign(light);
      context.radiance.addAssign(light.div(Math.PI));
      context.lightingModel.clearcoatRadiance?.addAssign(light.div(Math.PI));
    } else {
      context.irradiance.addAssign(light);
    }
  }
}

Light.registerNode?.call(RTGIProbeLight, RTGIProbeLightNode);
