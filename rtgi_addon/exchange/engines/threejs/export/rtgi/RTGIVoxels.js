// A scene as lit voxels, baked by RTGI: materials trace cones through them, pixel by pixel, without probes.
//
//   const voxels = await loadVoxels('rtgi/voxels.json');
//   voxels.apply(model);
//
// voxels.irradiance(point, normal) and voxels.mirrored(point, normal, direction, roughness) ask them on the CPU, for a few points.
// WebGLRenderer's standard, physical, Lambert, Phong and toon materials take it as they take ambient light. `declared` and `uniforms`
// are for shaders of your own: rtgi_voxels_irradiance(point, normal) and rtgi_voxels_mirrored(point, normal, direction, roughness).

import {
  ClampToEdgeWrapping, DataArrayTexture, DataUtils, FileLoader, FloatType, HalfFloatType, LoaderUtils, Matrix4, NearestFilter, RGBAFormat,
  RedFormat, Vector3,
} from 'three';

import { VoxelLookup } from './voxel_lookup.js';

export const VOXELS_FORMAT = 'rtgi-three-voxels/1';
const TYPES = { rows: [Float32Array, RedFormat, FloatType], cells: [Uint16Array, RGBAFormat, HalfFloatType],
  light: [Uint16Array, RGBAFormat, HalfFloatType] };

// Load the voxels of an export.
export async function loadVoxels(url) {
  const description = JSON.parse(await new FileLoader().loadAsync(url));
  const loader = new FileLoader().setResponseType('arraybuffer');
  const folder = LoaderUtils.extractUrlBase(url);
  return new RTGIVoxels(description, await loader.loadAsync(folder + description.data.file));
}

export class RTGIVoxels {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin.
  constructor(description, buffer) {
    if (description.format !== VOXELS_FORMAT || buffer.byteLength !== description.data.bytes) {
      throw new Error('RTGI: these are no voxels of this version, or their file is cut short: export again');
    }
    this.cones = description.cones;
    this.declared = `${uniformPars}${description.glsl}${functions}`;
    this.uniforms = { rtgiVoxelsCellsFromWorld: { value: new Matrix4().fromArray(description.cellsFromWorld) },
      rtgiVoxelsIntensity: { value: 1 } };
    this.cascades = description.cascades;
    this.lookup = description.lookup;
    let begin = 0;
    for (const [name, [Values, format, type]] of Object.entries(TYPES)) {
      const [width, height, depth] = description.lists[name].size, count = width * height * depth * (format === RedFormat ? 1 : 4);
      const texture = new DataArrayTexture(new Values(buffer.slice(begin, begin + count * Values.BYTES_PER_ELEMENT)), width, height,
        depth);
      begin += count * Values.BYTES_PER_ELEMENT;
      Object.assign(texture, { format, type, magFilter: NearestFilter, minFilter: NearestFilter, wrapS: ClampToEdgeWrapping,
        wrapT: ClampToEdgeWrapping, unpackAlignment: 1, needsUpdate: true });
      this.uniforms[`rtgi_voxel_${name}`] = { value: texture };
    }
  }

  // Irradiance [W/m2] as [r, g, b] at a point of a surface under a unit normal, [x, y, z] each: what materials find there.
  irradiance(point, normal) {
    return this.cpu().irradiance(this.cellsOf(point), this.turned(normal));
  }

  // Radiance [W/(sr m2)] as [r, g, b] that a surface of that roughness mirrors from a direction.
  mirrored(point, normal, direction, roughness) {
    const alpha = Math.min(roughness * roughness, 0.5);
    return this.cpu().seen(this.cellsOf(point), this.turned(direction), this.turned(normal), 2 * alpha / (1 - alpha * alpha));
  }

  // The lists as numbers, read when they are first asked for.
  cpu() {
    if (!(this.lookup instanceof VoxelLookup)) {
      const [rows, cells, light] = ['rows', 'cells', 'light'].map((name) => this.uniforms[`rtgi_voxel_${name}`].value.image.data);
      const [ofCells, ofLight] = [cells, light].map((halves) => Float32Array.from(halves, DataUtils.fromHalfFloat));
      this.lookup = new VoxelLookup(this.lookup, rows, ofCells, ofLight);
    }
    return this.lookup;
  }

  cellsOf(point) {
    return new Vector3(...point).applyMatrix4(this.uniforms.rtgiVoxelsCellsFromWorld.value).toArray();
  }

  turned(direction) {
    return new Vector3(...direction).transformDirection(this.uniforms.rtgiVoxelsCellsFromWorld.value).toArray();
  }

  // Have the materials of `object`, a material or what has some, lit by cones, and return this. Ambient light adds to it.
  apply(object) {
    const materials = new Set();
    if (object.isMaterial) {
      materials.add(object);
    } else {
      object.traverse((child) => [child.material ?? []].flat().forEach((material) => materials.add(material)));
    }
    for (const material of materials) {
      const { onBeforeCompile, customProgramCacheKey } = material, key = customProgramCacheKey.bind(material);
      if (material.userData.rtgiVoxels !== this) {
        material.userData.rtgiVoxels = this;
        material.onBeforeCompile = (shader, renderer) => {
          onBeforeCompile.call(material, shader, renderer);
          this.splice(shader);
        };
        material.customProgramCacheKey = () => `rtgi voxels ${onBeforeCompile} ${key()}`;
        material.needsUpdate = true;
      }
    }
    return this;
  }

  // Splice cones into `shader`, as onBeforeCompile receives it.
  splice(shader) {
    for (const [stage, chunk, text] of [['vertexShader', 'common', 'varying vec3 vRTGIVoxelPosition;\n'],
      ['vertexShader', 'project_vertex', vertexMain], ['fragmentShader', 'lights_pars_begin',
        `varying vec3 vRTGIVoxelPosition;\nuniform float rtgiVoxelsIntensity;\n${this.declared}`],
      ['fragmentShader', 'lights_fragment_begin', fragmentMain]]) {
      const include = `#include <${chunk}>`;
      if (!shader[stage].includes(include)) {
        throw new Error(`RTGI: this material of three's has no ${include}, so cones cannot light it`);
      }
      shader[stage] = shader[stage].replace(include, () => `${include}\n${text}`);
    }
    Object.assign(shader.uniforms, this.uniforms);
  }

  // Free the textures.
  dispose() {
    Object.keys(TYPES).forEach((name) => this.uniforms[`rtgi_voxel_${name}`].value.dispose());
  }
}

const uniformPars = /* glsl */ `
precision highp sampler2DArray;
uniform highp sampler2DArray rtgi_voxel_rows;
uniform highp sampler2DArray rtgi_voxel_cells;
uniform highp sampler2DArray rtgi_voxel_light;
uniform mat4 rtgiVoxelsCellsFromWorld;

vec4 rtgi_list_texel(highp sampler2DArray list, int item, int parts, int part) {
  ivec3 size = textureSize(list, 0);
  int line = item / (size.x / parts);
  return texelFetch(list, ivec3(item % (size.x / parts) * parts + part, line % size.y, line / size.y), 0);
}

`;
const functions = /* glsl */ `
// Irradiance [W/m2] at a point of a surface under a unit normal.
vec3 rtgi_voxels_irradiance(vec3 point, vec3 normal) {
  return rtgi_voxel_irradiance((rtgiVoxelsCellsFromWorld * vec4(point, 1.0)).xyz, normalize(mat3(rtgiVoxelsCellsFromWorld) * normal));
}

// Radiance [W/(sr m2)] that a surface of that roughness mirrors from a direction: one cone around the middle half of its lobe.
vec3 rtgi_voxels_mirrored(vec3 point, vec3 normal, vec3 direction, float roughness) {
  float alpha = min(roughness * roughness, 0.5);
  return rtgi_voxel_seen((rtgiVoxelsCellsFromWorld * vec4(point, 1.0)).xyz, normalize(mat3(rtgiVoxelsCellsFromWorld) * direction),
    normalize(mat3(rtgiVoxelsCellsFromWorld) * normal), true, 2.0 * alpha / (1.0 - alpha * alpha));
}
`;
const vertexMain = /* glsl */ `
vec4 rtgiVoxelPlace = vec4(transformed, 1.0);
#ifdef USE_INSTANCING
  rtgiVoxelPlace = instanceMatrix * rtgiVoxelPlace;
#endif
vRTGIVoxelPosition = (modelMatrix * rtgiVoxelPlace).xyz;
`;
const fragmentMain = /* glsl */ `
#if defined(RE_IndirectDiffuse)
  irradiance += rtgiVoxelsIntensity * rtgi_voxels_irradiance(vRTGIVoxelPosition, normalize((vec4(normal, 0.0) * viewMatrix).xyz));
#endif
`;
