// The light atlas baked by RTGI: light at the texels of objects' UV maps, in place of the probes' for those objects.
//
//   probes.addAtlas(await loadAtlas('rtgi/atlas.json'));   // before probes.apply(model)
//
// WebGLRenderer's materials read it by the probes' hook; objects in the atlas, found by their names in the glTF, get materials of
// their own. `irradiance` is the same for scripts. RTGIProbeLight (WebGPU) does not read it. An atlas that was baked beside transfer
// follows light with the probes: RTGIRelight calls `relight`.

import {
  ClampToEdgeWrapping, DataArrayTexture, DataTexture, DataUtils, FileLoader, FloatType, GLSL3, HalfFloatType, LoaderUtils, Mesh,
  NearestFilter, NoBlending, OrthographicCamera, PlaneGeometry, RawShaderMaterial, RGBAFormat, Scene, Vector3, WebGLArrayRenderTarget,
} from 'three';
import { DECLARED } from './shader.js';

export const ATLAS_FORMAT = 'rtgi-three-atlas/2';

// Load the light atlas of an export.
export async function loadAtlas(url) {
  const description = JSON.parse(await new FileLoader().loadAsync(url));
  const loader = new FileLoader().setResponseType('arraybuffer');
  const folder = LoaderUtils.extractUrlBase(url), tables = description.transfer?.data.file;
  return new RTGIAtlas(description, await loader.loadAsync(folder + description.data.file),
    tables ? await loader.loadAsync(folder + tables) : null);
}

// Numbers of an entry of what shines (RTGIRelight.js), in texels, and parts of a column of the tables.
const ENTRY = 3, PARTS = 4;

export class RTGIAtlas {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin, `tables` that of the transfer's, if there is one: without
  // it the atlas keeps the light of the bake.
  constructor(description, buffer, tables = null) {
    if (description.format !== ATLAS_FORMAT || buffer.byteLength !== description.data.bytes ||
        (tables && tables.byteLength !== description.transfer.data.bytes)) {
      throw new Error('RTGI: this is no light atlas of this version, or its file is cut short: export again');
    }
    this.parts = new Map(description.parts.map((part) => [part.name, part]));
    this.glsl = description.glsl;
    [this._width, this._height] = description.size;
    this._halves = new Uint16Array(buffer);
    this._tables = tables && new Uint16Array(tables);
    // What the tables' columns are, or null; and what shines, null: the light of the bake.
    this.transfer = tables && description.transfer;
    this._rows = null;
    this._gpu = null;
    this._baked = this._array(this._halves, 3);
    this.uniforms = { rtgiAtlas: { value: this._baked } };
  }

  _array(halves, depth) {
    return as(new DataArrayTexture(halves, this._width, this._height, depth), HalfFloatType);
  }

  // Follow what shines, `rows` as RTGIRelight has them for this atlas's tables (null: the light of the bake again): for `irradiance`,
  // and with `renderer`, a WebGLRenderer, for materials.
  relight(rows, renderer = null) {
    this._rows = rows;
    if (rows === null || renderer === null) {
      this.uniforms.rtgiAtlas.value = rows === null ? this._baked : this.uniforms.rtgiAtlas.value;
      return;
    }
    const { entries, target, scene, camera, material } = this._gpu ??= this._prepare(renderer);
    entries.image.data.fill(0);
    entries.image.data.set(rows);
    entries.needsUpdate = true;
    material.uniforms.count.value = rows.length / (4 * ENTRY);
    const before = renderer.getRenderTarget(), shadows = renderer.shadowMap.autoUpdate;
    renderer.shadowMap.autoUpdate = false;
    for (let channel = 0; channel < 3; channel++) {
      material.uniforms.channel.value = channel;
      renderer.setRenderTarget(target, channel);
      renderer.render(scene, camera);
    }
    renderer.setRenderTarget(before);
    renderer.shadowMap.autoUpdate = shadows;
    this.uniforms.rtgiAtlas.value = target.texture;
  }

  _prepare(renderer) {
    const columns = this.transfer.scales.length, gl = renderer.getContext(), most = gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS);
    if (PARTS * columns > most) {
      throw new Error(`RTGI: relighting the light atlas takes a texture of ${PARTS * columns} layers, this device has ${most}: bake ` +
        'it with fewer Sun Directions (--set atlas.suns), or load it without its tables');
    }
    const table = this._array(this._tables, PARTS * columns);
    const entries = as(new DataTexture(new Float32Array(4 * ENTRY * columns), ENTRY, columns), FloatType);
    const target = new WebGLArrayRenderTarget(this._width, this._height, 3);
    as(target.texture, HalfFloatType).needsUpdate = false;
    target.depthBuffer = false;
    const material = new RawShaderMaterial({
      glslVersion: GLSL3, depthTest: false, depthWrite: false, blending: NoBlending,
      vertexShader: 'in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
      fragmentShader: relightShader(this.transfer.glsl),
      uniforms: { table: { value: table }, entries: { value: entries }, count: { value: 0 }, channel: { value: 0 } },
    });
    const geometry = new PlaneGeometry(2, 2), mesh = new Mesh(geometry, material), scene = new Scene();
    mesh.frustumCulled = false;
    scene.matrixWorldAutoUpdate = false;
    scene.add(mesh);
    return { table, entries, target, material, geometry, scene, camera: new OrthographicCamera() };
  }

  // The four coefficients of a channel of a texel, under what shines.
  _texel(channel, column, row) {
    const halves = (data, layer) => [0, 1, 2, 3].map((i) =>
      DataUtils.fromHalfFloat(data[4 * ((layer * this._height + row) * this._width + column) + i]));
    if (this._rows === null) {
      return halves(this._halves, channel);
    }
    const total = [0, 0, 0, 0], add = (share, layer) => share !== 0 &&
      halves(this._tables, layer).forEach((value, i) => { total[i] += share * value; });
    for (let at = 0; at < this._rows.length; at += 4 * ENTRY) {
      const first = PARTS * this._rows[at];
      add(this._rows[at + 1 + channel], first + channel);
      add(this._rows[at + 4 + channel], first + 3);
    }
    return total;
  }

  // The part of the atlas that `object` is, or undefined: by Blender's name of it, or of the group that its pieces are in.
  partOf(object) {
    const named = ({ userData, name }) => this.parts.get(userData.name ?? name);
    return named(object) ?? (object.parent?.isGroup ? named(object.parent) : undefined);
  }

  // Give `mesh` materials of its own, marked as those of its part, and the part's map as the attribute rtgiSt. Returns whether it is
  // in the atlas and has the map.
  prepare(mesh) {
    const part = this.partOf(mesh);
    const map = part && mesh.geometry.getAttribute(part.texcoord === 0 ? 'uv' : `uv${part.texcoord}`);
    if (!map) {
      return false;
    }
    const own = (material) => {
      if (material.userData.rtgiAtlas === part) {
        return material;
      }
      const copy = material.clone();
      copy.userData = { ...material.userData, rtgiAtlas: part };
      return copy;
    };
    mesh.geometry = mesh.geometry.getAttribute('rtgiSt') === map ? mesh.geometry : mesh.geometry.clone();
    mesh.geometry.setAttribute('rtgiSt', mesh.geometry.getAttribute(part.texcoord === 0 ? 'uv' : `uv${part.texcoord}`));
    mesh.material = Array.isArray(mesh.material) ? mesh.material.map(own) : own(mesh.material);
    return true;
  }

  // Irradiance [W/m2] of the part called `name` at its map's coordinates, v down, under a unit normal of the probes' own space.
  irradiance(name, [s, t], [x, y, z]) {
    const { scale, offset } = this.parts.get(name);
    const place = [s * scale + offset[0] - 0.5, t * scale + offset[1] - 0.5], low = place.map(Math.floor);
    const f = place.map((value, axis) => value - low[axis]), last = [this._width - 1, this._height - 1];
    const within = (value, axis) => Math.min(Math.max(value, 0), last[axis]);
    const [first, second] = [low.map(within), low.map((value, axis) => within(value + 1, axis))];
    const basis = [0.8862269, 1.0233267 * y, 1.0233267 * z, 1.0233267 * x];
    return [0, 1, 2].map((channel) => {
      const texel = (column, row) => this._texel(channel, column, row).reduce((sum, value, i) => sum + value * basis[i], 0);
      const above = texel(first[0], first[1]) * (1 - f[0]) + texel(second[0], first[1]) * f[0];
      const below = texel(first[0], second[1]) * (1 - f[0]) + texel(second[0], second[1]) * f[0];
      return Math.max(above * (1 - f[1]) + below * f[1], 0);
    });
  }

  // Have `shader`, into which the probes' look-up is spliced, read the atlas at `part` in their place.
  splice(shader, part) {
    shader.vertexShader = shader.vertexShader.replace('void main() {',
      () => 'attribute vec2 rtgiSt;\nvarying vec2 vRTGISt;\nvoid main() {\nvRTGISt = rtgiSt;');
    shader.fragmentShader = shader.fragmentShader.replace(DECLARED, () => `${this.declared}\n${DECLARED}`).replace(BY_PROBES, BY_ATLAS);
    Object.assign(shader.uniforms, this.uniforms, { rtgiAtlasPlace: { value: new Vector3(part.scale, ...part.offset) } });
  }

  // GLSL of `rtgi_atlas_irradiance`, for shaders of your own with `uniforms`.
  get declared() {
    return `${fragmentPars}${this.glsl}`;
  }

  // Free the textures.
  dispose() {
    this._baked.dispose();
    if (this._gpu) {
      ['target', 'table', 'entries', 'material', 'geometry'].forEach((name) => this._gpu[name].dispose());
      this._gpu = null;
    }
  }
}

function as(texture, type) {
  return Object.assign(texture, { format: RGBAFormat, type, magFilter: NearestFilter, minFilter: NearestFilter,
    wrapS: ClampToEdgeWrapping, wrapT: ClampToEdgeWrapping, generateMipmaps: false, needsUpdate: true });
}

const BY_PROBES = 'rtgiIrradiance(vRTGIPosition, rtgiNormal(normal), rtgiNormal(nonPerturbedNormal))';
const BY_ATLAS = 'rtgi_atlas_irradiance(vRTGISt * rtgiAtlasPlace.x + rtgiAtlasPlace.yz, rtgiNormal(normal))';
const fragmentPars = /* glsl */ `
uniform highp sampler2DArray rtgiAtlas;
uniform vec3 rtgiAtlasPlace;
varying vec2 vRTGISt;
#define RTGI_ATLAS_SIZE (textureSize(rtgiAtlas, 0).xy)

vec4 rtgi_atlas_texel(ivec2 texel, int channel) {
  return texelFetch(rtgiAtlas, ivec3(texel, channel), 0);
}

`;
const relightShader = (glsl) => /* glsl */ `
precision highp float;
precision highp int;
uniform highp sampler2DArray table;
uniform highp sampler2D entries;
uniform int count;
uniform int channel;
out vec4 colour;
vec4 rtgi_atlas_column(int column, ivec2 texel, int part) {
  return texelFetch(table, ivec3(texel, ${PARTS} * column + part), 0);
}
vec4 rtgi_entry(int row, int texel) {
  return texelFetch(entries, ivec2(texel, row), 0);
}
${glsl}
void main() {
  colour = rtgi_atlas_relit(ivec2(gl_FragCoord.xy), channel, count);
}
`;
