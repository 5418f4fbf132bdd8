// Sphere probes baked by RTGI, for mirrors in three.js: what materials lit by the probes of a bake reflect.
//
//   probes.addMirrors(await loadSpheres('rtgi/spheres.json'));   // before probes.apply(model)
//
// WebGLRenderer's materials mirror them by a hook; `mirrored` is the same for scripts. Where they know nothing a material shows the
// probes' light, as before. RTGIProbeLight (WebGPU) does not read them.

import {
  ClampToEdgeWrapping, DataArrayTexture, DataTexture, DataUtils, FileLoader, FloatType, HalfFloatType, LoaderUtils, NearestFilter,
  RGBAFormat,
} from 'three';
import { DECLARED, LIT } from './shader.js';

export const SPHERES_FORMAT = 'rtgi-three-spheres/1';
const ROWS = 8;

// Load the sphere probes of an export.
export async function loadSpheres(url) {
  const description = JSON.parse(await new FileLoader().loadAsync(url));
  const loader = new FileLoader().setResponseType('arraybuffer');
  const folder = LoaderUtils.extractUrlBase(url);
  return new RTGISpheres(description, await loader.loadAsync(folder + description.data.file));
}

export class RTGISpheres {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin.
  constructor(description, buffer) {
    if (description.format !== SPHERES_FORMAT || buffer.byteLength !== description.data.bytes) {
      throw new Error('RTGI: these are no sphere probes of this version, or their file is cut short: export again');
    }
    this.names = description.names;
    this.count = description.names.length;
    this.sizes = { side: description.side, levels: description.levels, least: description.least };
    this.glsl = description.glsl;
    this._table = Float32Array.from(description.table);
    [this._width, this._height] = description.size;
    this._halves = new Uint16Array(buffer);
    const table = new DataTexture(this._table, ROWS, this.count, RGBAFormat, FloatType);
    const maps = new DataArrayTexture(this._halves, this._width, this._height, this.count);
    Object.assign(maps, { format: RGBAFormat, type: HalfFloatType });
    for (const texture of [table, maps]) {
      texture.magFilter = texture.minFilter = NearestFilter;
      texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
      texture.needsUpdate = true;
    }
    this.uniforms = { rtgiSphereTable: { value: table }, rtgiSphereMaps: { value: maps } };
  }

  // Radiance [W/(sr m2)] that a surface of that roughness mirrors from a unit direction at a point, times the share that the probes
  // know of it: [r, g, b, share], in the probes' own space.
  mirrored(position, direction, roughness) {
    const total = [0, 0, 0], { side, levels } = this.sizes;
    let left = 1;
    for (let probe = 0; probe < this.count; probe++) {
      const share = left * this._influence(probe, position);
      if (share > 0) {
        const [towards, alpha] = this._parallax(probe, position, direction, roughness * roughness);
        const level = Math.min(Math.max(Math.log2(Math.max(alpha, 1e-12) * 0.5 * side), 0), levels - 1);
        const low = Math.min(Math.trunc(level), levels - 2), part = level - low;
        const [below, above] = [this._level(probe, low, towards), this._level(probe, low + 1, towards)];
        total.forEach((_, c) => { total[c] += share * (below[c] * (1 - part) + above[c] * part); });
        left -= share;
      }
    }
    return [...total, 1 - left];
  }

  // Splice the look-up into `shader`, after that of the probes (shader.js), whose functions and whose light it takes.
  splice(shader) {
    for (const [mark, text] of [[DECLARED, fragmentPars + this.glsl], [LIT, fragmentMain]]) {
      shader.fragmentShader = shader.fragmentShader.replace(mark, () => `${text}\n${mark}`);
    }
    Object.assign(shader.uniforms, this.uniforms);
  }

  // Free the textures.
  dispose() {
    Object.values(this.uniforms).forEach(({ value }) => value.dispose());
  }

  _row(probe, row) {
    return this._table.subarray(4 * (probe * ROWS + row), 4 * (probe * ROWS + row) + 4);
  }

  _point(probe, first, [x, y, z], w) {
    return [0, 1, 2].map((axis) => {
      const row = this._row(probe, first + axis);
      return row[0] * x + row[1] * y + row[2] * z + row[3] * w;
    });
  }

  _influence(probe, position) {
    const unit = this._point(probe, 0, position, 1);
    const reach = this._row(probe, 7)[0] > 0.5 ? Math.max(...unit.map(Math.abs)) : Math.hypot(...unit);
    return Math.min(Math.max((1 - reach) * this._row(probe, 6)[3], 0), 1);
  }

  _parallax(probe, position, direction, alpha) {
    const start = this._point(probe, 3, position, 1), along = this._point(probe, 3, direction, 0);
    let reach = Infinity, met = true;
    if (this._row(probe, 7)[1] > 0.5) {
      let near = -Infinity;
      for (let axis = 0; axis < 3; axis++) {
        if (along[axis] === 0) {
          met &&= Math.abs(start[axis]) <= 1;
        } else {
          const ends = [-1, 1].map((side) => (side - start[axis]) / along[axis]);
          near = Math.max(near, Math.min(...ends));
          reach = Math.min(reach, Math.max(...ends));
        }
      }
      met &&= near <= reach && reach > 0;
    } else {
      const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
      const a = dot(along, along), b = dot(start, along), root = b * b - a * (dot(start, start) - 1);
      reach = (Math.sqrt(Math.max(root, 0)) - b) / a;
      met = root > 0 && reach > 0;
    }
    if (!met) {
      return [direction, alpha];
    }
    const centre = this._row(probe, 6), towards = position.map((value, axis) => value + direction[axis] * reach - centre[axis]);
    const away = Math.hypot(...towards);
    return [away > 1e-12 ? towards : direction, Math.min(alpha * reach / Math.max(away, 1e-12), 1)];
  }

  _levelSide(level) {
    return Math.max(this.sizes.side >> Math.max(level - 2, Math.min(level, 1)), this.sizes.least);
  }

  _level(probe, level, [x, y, z]) {
    let row = 0;
    for (let below = 0; below < level; below++) {
      row += this._levelSide(below) + 2;
    }
    // Maps keep Blender's axes.
    const side = this._levelSide(level), d = [x, -z, y], sum = Math.abs(x) + Math.abs(y) + Math.abs(z);
    let [u, v] = [d[0] / sum, d[1] / sum];
    if (d[2] < 0) {
      [u, v] = [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
    }
    const place = [u, v].map((value) => (value + 1) * 0.5 * side + 0.5);
    const low = place.map((value) => Math.min(Math.max(Math.trunc(value), 0), side)), f = place.map((value, i) => value - low[i]);
    const texel = (column, line) => {
      const first = 4 * ((probe * this._height + row + line) * this._width + column);
      return [0, 1, 2].map((c) => DataUtils.fromHalfFloat(this._halves[first + c]));
    };
    const [a, b, c, e] = [texel(low[0], low[1]), texel(low[0] + 1, low[1]), texel(low[0], low[1] + 1), texel(low[0] + 1, low[1] + 1)];
    return [0, 1, 2].map((i) => (a[i] * (1 - f[0]) + b[i] * f[0]) * (1 - f[1]) + (c[i] * (1 - f[0]) + e[i] * f[0]) * f[1]);
  }
}

// What materials mirror, after the probes' own light in shader.js.
const fragmentPars = /* glsl */ `
uniform highp sampler2D rtgiSphereTable;
uniform highp sampler2DArray rtgiSphereMaps;

vec4 rtgi_sphere_row(int probe, int row) {
  return texelFetch(rtgiSphereTable, ivec2(row, probe), 0);
}

vec3 rtgi_sphere_texel(int probe, ivec2 texel) {
  return texelFetch(rtgiSphereMaps, ivec3(texel, probe), 0).rgb;
}

`;
const fragmentMain = /* glsl */ `
#if defined(RE_IndirectSpecular)
  vec4 rtgiMirrored = rtgi_spheres(vRTGIPosition, rtgiNormal(reflect(-geometryViewDir, normal)),
    material.roughness * material.roughness);
  radiance = radiance * (1.0 - rtgiMirrored.a) + rtgiIntensity * rtgiMirrored.rgb;
#endif
`;
