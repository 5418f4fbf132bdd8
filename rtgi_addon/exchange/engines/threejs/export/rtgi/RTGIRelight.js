// Other light on probes that were baked with their transfer: suns, skies and groups of lights, without a new bake.
//
//   const relight = await loadRelight('rtgi/transfer.json', probes);
//   relight.suns = [{ towards: new Vector3(0.3, 0.8, 0.5), irradiance: new Color(3, 2.9, 2.7) }];
//   relight.factors.Lamps = new Color(0, 0, 0);
//   relight.update(renderer);            // every frame: relights some of the probes, until all have followed
//
// Suns are what surfaces reflect of them: add a DirectionalLight for what they light directly. Probes that hang below a turned or
// moved RTGIProbeVolumes take directions of the world.

import {
  DataTexture, DataUtils, FileLoader, FloatType, GLSL3, HalfFloatType, LoaderUtils, Mesh, NearestFilter, NoBlending,
  OrthographicCamera, PlaneGeometry, RawShaderMaterial, RGBAFormat, Scene, Vector3, Vector4, WebGLRenderTarget,
} from 'three';
import { COEFFICIENTS, COSINE_0, COSINE_1, COSINE_2, COSINE_2_ZONAL, harmonics } from './lookup.js';
import { numbers, relit } from './relit.js';

export const FORMAT = 'rtgi-three-transfer/2';
const NUMBERS = 28, TEXELS = 7;
// Texels of an entry of what shines, see relit.js.
const ENTRY = 3;
const MAX_SIDE = 4096;
// How much closer the directions of suns are near the horizon.
const POWER = 1.5;

const vertexShader = /* glsl */ `
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }
`;

const fragmentShader = /* glsl */ `
precision highp float;
precision highp int;
uniform highp sampler2D table;
uniform highp sampler2D entries;
uniform highp sampler2D baked;
uniform int count;
uniform int probes;
out vec4 colour;
${numbers}
vec4 rtgi_table(int column, ivec3 probe, int texel) {
  int index = (column * probes + probe.x) * ${TEXELS} + texel;
  int width = textureSize(table, 0).x;
  return texelFetch(table, ivec2(index % width, index / width), 0);
}
vec4 rtgi_entry(int row, int texel) {
  return texelFetch(entries, ivec2(texel, row), 0);
}
${relit}
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  int perRow = textureSize(baked, 0).x / 9;
  int probe = texel.y * perRow + texel.x / 9;
  // What is no coefficient, the probe's place, stays.
  float place = texelFetch(baked, texel, 0).w;
  if (probe >= probes) {
    colour = vec4(0.0);
    return;
  }
  vec3 c0, c1, c2, c3, c4, c5, c6, c7, c8;
  rtgi_relit(ivec3(probe, 0, 0), count, c0, c1, c2, c3, c4, c5, c6, c7, c8);
  vec3 all[9] = vec3[9](c0, c1, c2, c3, c4, c5, c6, c7, c8);
  colour = vec4(all[texel.x % 9], place);
}
`;

// The .json of an export's transfer and its .bin, for the `probes` (RTGIProbeVolumes) of the same export.
export async function loadRelight(url, probes) {
  const description = await new FileLoader().setResponseType('json').loadAsync(url);
  check(description);
  const binary = LoaderUtils.resolveURL(description.data.file, LoaderUtils.extractUrlBase(url));
  return new RTGIRelight(description, await new FileLoader().setResponseType('arraybuffer').loadAsync(binary), probes);
}

function check(description) {
  if (description?.format !== FORMAT) {
    throw new Error(`RTGI: the .json is of format ${JSON.stringify(description?.format)}, this loader reads "${FORMAT}": ` +
      'take the rtgi folder and the transfer from one export');
  }
}

export class RTGIRelight {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin.
  constructor(description, buffer, probes) {
    check(description);
    const total = probes.volumes.reduce((sum, volume) => sum + volume.count, 0);
    if (description.probes !== total || buffer.byteLength !== description.data.bytes) {
      throw new Error('RTGI: the transfer is not that of these probes: copy all files of one export');
    }
    this.probes = probes;
    // The lights of the bake by name, `world` and `suns` among them: a Color or a number each, 1 as they were baked.
    this.factors = {};
    // Suns in place of the file's (null: those of the file), { towards: Vector3, irradiance: Color } each, irradiance in W/m2.
    this.suns = null;
    // A sky in place of the world's (null: the baked one), { harmonics: [[r, g, b], ...], suns: [[r, g, b], ...] }: `skyFrom` makes it.
    this.sky = null;
    // How many updates it takes until all probes have followed.
    this.parts = 8;
    // Also follow on the CPU, for `probes.irradiance`, `probes.radiance` and light probes. Without WebGLRenderer that is all there is.
    this.onCPU = false;
    this.lights = description.lights;
    this._description = description;
    this._count = total;
    this._columns = description.scales.length;
    this._suns = nodes(description.sunSide, description.sunBelow);
    this._table = new Uint16Array(buffer);
    this._shown = null;
    this._entries = null;
    this._row = 0;
    this._gpu = null;
    this._stored = null;
  }

  // Replace the file's suns by one, `azimuth` degrees from north (-Z, Blender's +Y) towards east (+X), `elevation` above the horizon.
  setSun(azimuth, elevation, irradiance) {
    this.suns = [{ towards: sunTowards(azimuth, elevation), irradiance }];
    return this;
  }

  // Relight the next of the probes for what shines now; `renderer` is the WebGLRenderer that draws them, if there is one. Returns
  // whether all have followed.
  update(renderer = null) {
    const entries = this._entriesNow();
    if (this._entries === null) {
      if (this._shown !== null && same(entries, this._shown)) {
        return true;
      }
      // What shines is taken once for all parts, so that all of them fit together.
      this._entries = entries;
      this._row = 0;
      this._followAtlas(renderer?.isWebGLRenderer === true ? renderer : null);
    }
    const { width, height } = this.probes.uniforms.rtgiProbes.value.image;
    const last = Math.min(height, this._row + Math.ceil(height / Math.max(1, this.parts)));
    const drawn = renderer?.isWebGLRenderer === true;
    if (drawn) {
      this._draw(renderer, this._row, last);
    }
    if (!drawn || this.onCPU) {
      const perRow = width / COEFFICIENTS;
      this._compute(this._row * perRow, Math.min(last * perRow, this._count), !drawn);
    }
    this._row = last;
    if (last === height) {
      this._shown = this._entries;
      this._entries = null;
    }
    return last === height;
  }

  // All probes at once.
  finish(renderer = null) {
    const { parts } = this;
    this.parts = 1;
    this._entries = null;
    this.update(renderer);
    this.parts = parts;
    return this;
  }

  // A sky for `sky` from an equirectangular image as three's backgrounds are, `data` r, g, b (or r, g, b, a) floats in rows from the
  // top, turned by `turn` degrees counterclockwise from above; what its harmonics leave goes by suns, as in the bake.
  skyFrom(data, width, height, turn = 0) {
    return skyFrom(this._description, this._suns, data, width, height, turn);
  }

  // Free the textures; the probes hold the baked light again.
  dispose() {
    this.probes.atlas?.relight?.(null);
    this._stored?.forEach((value, i) => { this.probes.lookup.probes[i] = value; });
    if (this._gpu) {
      this.probes.uniforms.rtgiProbes.value = this._gpu.baked;
      ['target', 'table', 'entries', 'material', 'geometry'].forEach((name) => this._gpu[name].dispose());
      this._gpu = null;
    }
  }

  // What shines, for the probes' tables.
  _entriesNow() {
    const { lights, sky: skyCount } = this._description;
    for (const name of Object.keys(this.factors)) {
      if (!lights.some((light) => light.name === name)) {
        throw new Error(`RTGI: there is no light "${name}": choose one of ${lights.map((light) => light.name).join(', ')}`);
      }
    }
    if (this.sky !== null && (this.sky.harmonics.length !== skyCount || this.sky.suns.length !== this._suns.length)) {
      throw new Error(`RTGI: the sky has ${this.sky.harmonics.length} harmonics and ${this.sky.suns.length} suns, the bake's ` +
        `${skyCount} and ${this._suns.length}: make it with skyFrom`);
    }
    return entriesOf(this._description, this._suns, this, this.sky);
  }

  // Have the probes' light atlas follow as well, all of it, if it knows what its texels make of any light.
  _followAtlas(renderer) {
    const { atlas } = this.probes, tables = atlas?.transfer;
    if (tables) {
      const suns = nodes(tables.sunSide, tables.sunBelow);
      const sky = this.sky && { harmonics: this.sky.harmonics, suns: shared(this.sky.suns, this._suns, suns, tables) };
      atlas.relight(entriesOf(tables, suns, this, sky), renderer);
    }
  }

  _draw(renderer, first, last) {
    const gpu = this._gpu ??= this._prepare(renderer);
    const { entries, target, scene, camera, material } = gpu;
    entries.image.data.fill(0);
    entries.image.data.set(this._entries);
    entries.needsUpdate = true;
    material.uniforms.count.value = this._entries.length / (4 * ENTRY);
    const before = renderer.getRenderTarget(), { autoClear } = renderer;
    const shadows = renderer.shadowMap.autoUpdate;
    renderer.shadowMap.autoUpdate = false;
    renderer.autoClear = false;
    target.viewport = new Vector4(0, 0, target.width, target.height);
    target.scissor = new Vector4(0, first, target.width, last - first);
    target.scissorTest = true;
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(before);
    renderer.autoClear = autoClear;
    renderer.shadowMap.autoUpdate = shadows;
    // Until all of it has been drawn once, the baked light stays.
    if (this._shown !== null || last === target.height) {
      this.probes.uniforms.rtgiProbes.value = target.texture;
    }
  }

  _prepare(renderer) {
    const baked = this.probes.uniforms.rtgiProbes.value, { width, height } = baked.image;
    const texels = this._columns * this._count * TEXELS;
    const side = Math.min(MAX_SIDE, renderer.capabilities.maxTextureSize);
    const across = Math.min(side, texels), down = Math.ceil(texels / across);
    if (down > renderer.capabilities.maxTextureSize) {
      throw new Error(`RTGI: the transfer fills a texture of ${across} x ${down}, this device takes ` +
        `${renderer.capabilities.maxTextureSize} at most: bake with fewer probes or a smaller sun_side`);
    }
    const padded = new Uint16Array(4 * across * down);
    padded.set(this._table);
    const table = texture(padded, across, down, HalfFloatType);
    const entries = texture(new Float32Array(4 * ENTRY * this._columns), ENTRY, this._columns, FloatType);
    const target = new WebGLRenderTarget(width, height,
      { type: HalfFloatType, magFilter: NearestFilter, minFilter: NearestFilter, depthBuffer: false, generateMipmaps: false });
    const material = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader, fragmentShader, depthTest: false, depthWrite: false, blending: NoBlending,
      uniforms: { table: { value: table }, entries: { value: entries }, baked: { value: baked }, count: { value: 0 },
        probes: { value: this._count } },
    });
    const geometry = new PlaneGeometry(2, 2), mesh = new Mesh(geometry, material), scene = new Scene();
    mesh.frustumCulled = false;
    scene.matrixWorldAutoUpdate = false;
    scene.add(mesh);
    return { baked, table, entries, target, material, geometry, scene, camera: new OrthographicCamera() };
  }

  // The probes from `first` to `last` on the CPU, and their texture if it is the one that is drawn with.
  _compute(first, last, shown) {
    const stored = this.probes.lookup.probes, { data: halves } = this.probes.uniforms.rtgiProbes.value.image;
    this._stored ??= stored.slice();
    const sum = new Float64Array(3 * COEFFICIENTS);
    for (let probe = first; probe < last; probe++) {
      relitProbe(this._table, this._count, probe, this._entries, sum);
      for (let i = 0; i < COEFFICIENTS; i++) {
        for (let channel = 0; channel < 3; channel++) {
          const at = 4 * (COEFFICIENTS * probe + i) + channel;
          stored[at] = sum[3 * i + channel];
          if (shown && halves) {
            halves[at] = toHalf(stored[at]);
          }
        }
      }
    }
    if (shown && halves) {
      this.probes.uniforms.rtgiProbes.value.needsUpdate = true;
    }
  }
}

// Towards a sun at `azimuth` degrees from north (-Z) towards east (+X), `elevation` above the horizon.
export function sunTowards(azimuth, elevation, target = new Vector3()) {
  const a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
  return target.set(Math.sin(a) * Math.cos(e), Math.sin(e), -Math.cos(a) * Math.cos(e));
}

// Towards the sun at the solar time `hour` of a `day` of the year at a `latitude` [degrees]; below the horizon at night. As the
// sliders in Blender have it: right to a degree.
export function sunAt(hour, latitude = 50, day = 172, target = new Vector3()) {
  const declination = Math.asin(Math.sin(23.44 * Math.PI / 180) * Math.sin(2 * Math.PI * (day - 80) / 365));
  const angle = (hour - 12) * Math.PI / 12, north = latitude * Math.PI / 180;
  const [sd, cd, sn, cn] = [Math.sin(declination), Math.cos(declination), Math.sin(north), Math.cos(north)];
  return target.set(-cd * Math.sin(angle), sd * sn + cd * Math.cos(angle) * cn, -(sd * cn - cd * Math.cos(angle) * sn));
}

// What shines as rows of 12 numbers for the tables of `description`, whose dome has the directions `directions`: column, its light;
// what is seen of it as a sun; towards where.
function entriesOf({ lights, scales, sky: skyCount, sunSide, sunBelow }, directions, { factors, suns, probes }, sky) {
  const light = Array.from(scales, () => [0, 0, 0]), seen = new Map(), firstSun = lights.length + skyCount;
  lights.forEach(({ name, kind }, column) => {
    const replaced = (kind === 'world' && sky !== null) || (kind === 'suns' && suns !== null);
    light[column] = replaced ? [0, 0, 0] : colour(factors[name] ?? 1);
  });
  if (sky !== null) {
    sky.harmonics.forEach((value, i) => { light[lights.length + i] = [...value]; });
    sky.suns.forEach((value, k) => {
      light[firstSun + k] = [...value];
      seen.set(firstSun + k, [value, directions[k]]);
    });
  }
  const towards = new Vector3();
  for (const sun of suns ?? []) {
    towards.copy(sun.towards).transformDirection(probes.uniforms.rtgiFromWorld.value);
    const irradiance = colour(sun.irradiance);
    for (const [k, share] of shares(towards, sunSide, sunBelow)) {
      irradiance.forEach((value, channel) => { light[firstSun + k][channel] += share * value; });
    }
  }
  const rows = [];
  light.forEach((value, column) => {
    if (value.some((part) => part !== 0) || seen.has(column)) {
      const [sun, direction] = seen.get(column) ?? [[0, 0, 0], [0, 1, 0]];
      rows.push(column, ...[...value, ...sun].map((part) => part * scales[column]), 0, ...direction, 0);
    }
  });
  return Float32Array.from(rows);
}

// The irradiances `values` of suns from `directions` as those of another dome's, which has the directions `others`.
function shared(values, directions, others, { sunSide, sunBelow }) {
  const result = others.map(() => [0, 0, 0]);
  values.forEach((value, k) => {
    const [x, y, z] = directions[k];
    for (const [node, share] of shares({ x, y, z }, sunSide, sunBelow)) {
      value.forEach((part, channel) => { result[node][channel] += share * part; });
    }
  });
  return result;
}

const colour = (value) => value.isColor ? [value.r, value.g, value.b] : Array.isArray(value) ? [...value] : [value, value, value];
const same = (a, b) => a.length === b.length && a.every((value, i) => value === b[i]);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

function texture(data, width, height, type) {
  const result = new DataTexture(data, width, height, RGBAFormat, type);
  result.magFilter = result.minFilter = NearestFilter;
  result.needsUpdate = true;
  return result;
}

// Directions (x, y, z), Y up, of the nodes of the dome of suns (numerics/dome.py, whose axes are Blender's).
function nodes(side, below) {
  const upper = [];
  for (let row = 0; row < side; row++) {
    for (let column = 0; column < side; column++) {
      const u = 2 * column / (side - 1) - 1, v = 2 * row / (side - 1) - 1;
      const away = Math.abs(u + v) / 2 + Math.abs(u - v) / 2, z = Math.max(1 - away, 0) ** POWER;
      const scale = 0.5 * (1 - z) / Math.max(away, 1e-30), x = scale * (u + v), y = scale * (u - v), length = Math.hypot(x, y, z);
      upper.push([x / length, z / length, -y / length]);
    }
  }
  return below ? [...upper, ...upper.map(([x, y, z]) => [x, -y, z])] : upper;
}

// The nodes about a direction, [index, share] each.
function shares({ x, y, z }, side, below) {
  if (side < 2 || (y < 0 && !below)) {
    return [];
  }
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z), away = Math.max(Math.abs(x) + Math.abs(z), 1e-30);
  const scale = (1 - (Math.abs(y) / sum) ** (1 / POWER)) / away, px = scale * x, py = -scale * z;
  const at = [px + py, px - py].map((value) => (clamp(value, -1, 1) + 1) * 0.5 * (side - 1));
  const [column, row] = at.map((value) => Math.min(Math.floor(value), side - 2));
  const fu = at[0] - column, fv = at[1] - row;
  const node = row * side + column + (y < 0 ? side * side : 0);
  return [[node, (1 - fu) * (1 - fv)], [node + 1, fu * (1 - fv)], [node + side, (1 - fu) * fv], [node + side + 1, fu * fv]];
}

function skyFrom({ sky: count, sunSide, sunBelow }, suns, data, width, height, turn) {
  if (count !== COEFFICIENTS) {
    throw new Error(`RTGI: skies of ${count} harmonics are not made here: bake with sky_order 2`);
  }
  // Harmonics differ within texels of small pictures.
  const channels = data.length / (width * height), finer = Math.ceil(64 / height);
  const coefficients = Array.from({ length: count }, () => [0, 0, 0]);
  const visit = (use) => {
    for (let row = 0; row < finer * height; row++) {
      const [top, bottom] = [row, row + 1].map((edge) => Math.cos(Math.PI * edge / (finer * height)));
      const up = 0.5 * (top + bottom), ring = Math.sqrt(1 - up * up), solid = (top - bottom) * 2 * Math.PI / (finer * width);
      for (let column = 0; column < finer * width; column++) {
        const angle = 2 * Math.PI * ((column + 0.5) / (finer * width) - 0.5) - turn * Math.PI / 180;
        const texel = Math.floor(row / finer) * width + Math.floor(column / finer);
        use([ring * Math.cos(angle), up, ring * Math.sin(angle)], channels * texel, solid);
      }
    }
  };
  visit((direction, at, solid) => harmonics(...direction).forEach((basis, i) => {
    for (let channel = 0; channel < 3; channel++) {
      coefficients[i][channel] += basis * solid * data[at + channel];
    }
  }));
  const left = suns.map(() => [0, 0, 0]);
  visit((direction, at, solid) => {
    const basis = harmonics(...direction), [x, y, z] = direction;
    const rest = [0, 1, 2].map((channel) => solid * (data[at + channel] -
      basis.reduce((sum, value, i) => sum + value * coefficients[i][channel], 0)));
    for (const [node, share] of shares({ x, y, z }, sunSide, sunBelow)) {
      rest.forEach((value, channel) => { left[node][channel] += share * value; });
    }
  });
  return { harmonics: coefficients, suns: left };
}

// A half float next to `value`; three's own conversion cuts.
const bits = new Uint32Array(1), real = new Float32Array(bits.buffer);
function toHalf(value) {
  real[0] = value;
  bits[0] += 0x1000;
  return DataUtils.toHalfFloat(clamp(real[0], -65504, 65504));
}

// What follows is relit.js (relight.glsl of the export) on the CPU.

// The coefficients (27) of a probe, deringed, into `sum`.
function relitProbe(table, probes, probe, entries, sum) {
  sum.fill(0);
  for (let row = 0; row < entries.length; row += 4 * ENTRY) {
    const first = NUMBERS * (entries[row] * probes + probe);
    for (let number = 0; number < 27; number++) {
      sum[number] += entries[row + 1 + number % 3] * DataUtils.fromHalfFloat(table[first + number]);
    }
    const [r, g, b] = [entries[row + 4], entries[row + 5], entries[row + 6]];
    if (r !== 0 || g !== 0 || b !== 0) {
      const seen = DataUtils.fromHalfFloat(table[first + 27]);
      harmonics(entries[row + 8], entries[row + 9], entries[row + 10]).forEach((basis, i) => {
        sum[3 * i] += seen * basis * r;
        sum[3 * i + 1] += seen * basis * g;
        sum[3 * i + 2] += seen * basis * b;
      });
    }
  }
  dering(sum);
}

function dering(c) {
  const colours = [];
  let doubtful = false;
  for (let channel = 0; channel < 3; channel++) {
    const of = (i) => c[3 * i + channel];
    if (!(of(0) > 0)) {
      for (let i = 1; i < COEFFICIENTS; i++) {
        c[3 * i + channel] = 0;
      }
      continue;
    }
    const norm = (...bands) => Math.hypot(...bands.map(of));
    const mean = COSINE_0 * of(0);
    doubtful ||= COSINE_1 * norm(1, 2, 3) + 2 * COSINE_2_ZONAL * norm(4, 5, 6, 7, 8) > mean;
    colours.push([mean, of]);
  }
  if (!doubtful) {
    return;
  }
  const shapes = colours.map(([mean, of]) => ({ mean, ...axes(of) }));
  if (border([1, 1], shapes)[0] >= 1) {
    return;
  }
  const power = [0, 0];
  for (let i = 3; i < 27; i++) {
    power[i < 12 ? 0 : 1] += (i < 12 ? 4 / 9 : 1 / 16) * c[i] * c[i];
  }
  const some = 1e-6 * (power[0] + power[1]);
  power[0] += some;
  power[1] += some;
  let low = 0, high = 1, shares = [0, 0];
  for (let bisection = 0; bisection < 21; bisection++) {
    const turn = 0.5 * (low + high), ray = [1 - turn, turn];
    const [served, first, second] = border(ray, shapes);
    const nearest = (power[0] * ray[0] + power[1] * ray[1]) / (power[0] * ray[0] * ray[0] + power[1] * ray[1] * ray[1]);
    const edge = 1 / Math.max(...ray), reach = Math.min(served, nearest, edge);
    shares = [reach * ray[0], reach * ray[1]];
    let grows = [first / Math.max(ray[0], 1e-30), second / Math.max(ray[1], 1e-30)];
    if (reach < served) {
      grows = reach < edge ? [-ray[0], -ray[1]] : turn < 0.5 ? [-1, 0] : [0, -1];
    }
    const up = power[0] * (1 - shares[0]) * grows[1] > power[1] * (1 - shares[1]) * grows[0];
    [low, high] = up ? [turn, high] : [low, turn];
  }
  for (let i = 3; i < 27; i++) {
    c[i] *= shares[i < 12 ? 0 : 1];
  }
}

function border(ray, shapes) {
  let result = [1e30, 0, 0];
  for (const { mean, linear, values } of shapes) {
    const [first, all] = least(linear.map((value) => ray[0] * value), values.map((value) => ray[1] * value));
    const reach = all < 0 ? mean / -all : 1e30;
    if (reach < result[0]) {
      result = [reach, first, all - first];
    }
  }
  return result;
}

function axes(of) {
  const zonal = COSINE_2_ZONAL * of(6), across = 0.5 * COSINE_2 * of(8), half = 0.5 * COSINE_2;
  const m = [[across - zonal, half * of(4), half * of(7)], [half * of(4), -across - zonal, half * of(5)],
    [half * of(7), half * of(5), 2 * zonal]];
  const linear = [COSINE_1 * of(3), COSINE_1 * of(1), COSINE_1 * of(2)];
  for (let sweep = 0; sweep < 4; sweep++) {
    for (const [p, q, r] of [[0, 1, 2], [0, 2, 1], [1, 2, 0]]) {
      if (Math.abs(m[p][q]) <= 1e-12 * (Math.abs(m[p][p]) + Math.abs(m[q][q]))) {
        continue;
      }
      const ratio = (m[q][q] - m[p][p]) / (2 * m[p][q]);
      const t = (ratio < 0 ? -1 : 1) / (Math.abs(ratio) + Math.sqrt(ratio * ratio + 1)), c = 1 / Math.sqrt(t * t + 1), s = t * c;
      m[p][p] -= t * m[p][q];
      m[q][q] += t * m[p][q];
      m[p][q] = m[q][p] = 0;
      [m[r][p], m[r][q]] = [c * m[r][p] - s * m[r][q], s * m[r][p] + c * m[r][q]];
      [m[p][r], m[q][r]] = [m[r][p], m[r][q]];
      [linear[p], linear[q]] = [c * linear[p] - s * linear[q], s * linear[p] + c * linear[q]];
    }
  }
  return { linear, values: [m[0][0], m[1][1], m[2][2]] };
}

function least(linear, values) {
  const low = Math.max(...linear.map((value, i) => 0.5 * Math.abs(value) - values[i]));
  const part = (shift, i) => 0.5 * linear[i] / Math.max(values[i] + shift, 1e-30);
  let shift = low;
  for (let step = 0; step < 8; step++) {
    let square = 0, slope = 0;
    for (let i = 0; i < 3; i++) {
      const p = part(shift, i) ** 2;
      square += p;
      slope += p / Math.max(values[i] + shift, 1e-30);
    }
    if (slope > 0) {
      shift = Math.max(low, shift + (Math.sqrt(square) - 1) * square / slope);
    }
  }
  const first = -(linear[0] * part(shift, 0) + linear[1] * part(shift, 1) + linear[2] * part(shift, 2));
  return [first, 0.5 * first - shift];
}
