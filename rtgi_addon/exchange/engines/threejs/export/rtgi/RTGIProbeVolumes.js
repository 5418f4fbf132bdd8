// Irradiance probe volumes baked by RTGI, for three.js (WebGLRenderer, r160 or later; no bundler needed).
//
//   const probes = await new RTGIProbeLoader().loadAsync('rtgi/probes.json');
//   scene.add(probes);
//   probes.apply(model);                 // every lit material in it
//
// Units are those of the bake: radiance [W/(sr m2)], irradiance [W/m2], scene-linear Rec. 709, Y up, metres.

import {
  Color, DataTexture, DataUtils, FileLoader, FloatType, HalfFloatType, LightProbe, Loader, LoaderUtils, Matrix3, Matrix4, NearestFilter,
  Object3D, RGBAFormat, RGBAIntegerFormat, REVISION, UnsignedShortType, Vector3,
} from 'three';
import { Hooks } from './hook.js';
import { COEFFICIENTS, ProbeLookup, harmonics } from './lookup.js';
import { spliceProbes } from './shader.js';

export const FORMAT = 'rtgi-three/1';
const OLDEST_THREE = 160;
// What the smallest WebGL 2 promises of uniforms leaves room for.
const MOST_VOLUMES = 16;

// Loads the JSON file of an export and the binary one that it names.
export class RTGIProbeLoader extends Loader {
  load(url, onLoad, onProgress, onError) {
    const report = (error) => {
      this.manager.itemError(url);
      if (onError) {
        onError(error);
      } else {
        console.error(error);
      }
    };
    const file = (name, responseType, then, hint) => {
      const loader = new FileLoader(this.manager);
      loader.setPath(responseType === 'json' ? this.path : '');
      loader.setResponseType(responseType);
      loader.setRequestHeader(this.requestHeader);
      loader.setWithCredentials(this.withCredentials);
      loader.load(name, (content) => {
        try {
          then(content);
        } catch (error) {
          report(error);
        }
      }, onProgress, (error) => report(new Error(`RTGI: ${name} could not be read. ${hint} (${error.message ?? error})`)));
    };
    const folder = this.resourcePath || LoaderUtils.extractUrlBase(LoaderUtils.resolveURL(url, this.path));
    file(url, 'json', (description) => {
      check(description);
      file(LoaderUtils.resolveURL(description.data.file, folder), 'arraybuffer',
        (buffer) => onLoad(this.parse(description, buffer)), 'It belongs beside the .json of the same export.');
    }, 'Give the path of the .json that the export wrote.');
  }

  // The probes of a parsed .json and the ArrayBuffer of its .bin.
  parse(description, buffer) {
    check(description);
    if (buffer.byteLength !== description.data.bytes) {
      throw new Error(`RTGI: ${description.data.file} holds ${buffer.byteLength} bytes, its .json says ${description.data.bytes}` +
        ': copy both files of one export');
    }
    return new RTGIProbeVolumes(description, buffer);
  }
}

function check(description) {
  if (Number.parseInt(REVISION) < OLDEST_THREE) {
    throw new Error(`RTGI: this is three r${REVISION}, and probes need r${OLDEST_THREE} or later`);
  }
  if (description?.format !== FORMAT) {
    throw new Error(`RTGI: the .json is of format ${JSON.stringify(description?.format)}, this loader reads "${FORMAT}": ` +
      'take the rtgi folder and the probes from one export');
  }
}

// Which material is lit by which probes, and what its own hooks were.
const hooks = new Hooks();

// The volumes of one bake. As an Object3D it may be moved, turned and scaled (alike along all axes) with the model it lights.
export class RTGIProbeVolumes extends Object3D {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin; RTGIProbeLoader checks both.
  constructor(description, buffer) {
    super();
    this._source = [description, buffer];
    this.isRTGIProbeVolumes = true;
    this.type = 'RTGIProbeVolumes';
    this.name = description.scene;
    // Whether the direct light of any lamp is in the probes; the scene's own lights add that of the others.
    this.includesDirect = description.includesDirect;
    // By Blender's names: what is baked of each lamp ('all', 'bounces' or 'none'), and which objects are 'dynamic'.
    this.lamps = description.lamps ?? {};
    this.objects = description.objects ?? {};
    this.volumes = prepare(description.volumes);
    if (this.volumes.length > MOST_VOLUMES) {
      throw new Error(`RTGI: ${this.volumes.length} volumes are more than the ${MOST_VOLUMES} that a shader has room for: ` +
        'bake fewer');
    }
    const { probes, distances, words } = unpack(this.volumes, buffer);
    this.lookup = new ProbeLookup(this.volumes, probes.numbers, distances, words);
    this.uniforms = makeUniforms(this.volumes, probes.halves, distances, words);
  }

  // A factor of the probes' light. 1 is the bake's own, in W/m2 where lamps are in W/sr.
  get intensity() {
    return this.uniforms.rtgiIntensity.value;
  }

  set intensity(value) {
    this.uniforms.rtgiIntensity.value = value;
  }

  // Whether the probes hold the direct light of `light`, which glTF's loader made, so that it must not shine as well.
  holdsDirect(light) {
    const known = Object.keys(this.lamps).length > 0;
    return known ? this.lamps[light.userData.name ?? light.name] === 'all' : this.includesDirect;
  }

  // Have materials mirror `mirrors` (RTGISpheres.js) from the next `apply` on, and return this.
  addMirrors(mirrors) {
    this.mirrors = mirrors;
    return this;
  }

  // Have the objects of `atlas` (RTGIAtlas.js) read it in place of the probes from the next `apply` on, and return this.
  addAtlas(atlas) {
    this.atlas = atlas;
    return this;
  }

  // Light `target`, a material or every lit material below an Object3D, and return this. Objects of a shared material share the
  // light; a clone of a material is applied anew.
  apply(target) {
    if (target.isMaterial) {
      if (!isLit(target)) {
        throw new Error(`RTGI: ${target.type} "${target.name}" cannot be lit by probes: use MeshStandardMaterial, ` +
          'MeshPhysicalMaterial, MeshLambertMaterial, MeshPhongMaterial or MeshToonMaterial with WebGLRenderer');
      }
      this._hook(target);
    } else {
      target.traverse((object) => {
        if (object.isMesh) {
          this.atlas?.prepare(object);
        }
        for (const material of [object.material ?? []].flat().filter(isLit)) {
          this._hook(material);
        }
      });
    }
    return this;
  }

  // Take the light of these probes from `target` again, a material or everything below an Object3D, and return this.
  release(target) {
    if (target.isMaterial) {
      hooks.remove(this, target);
    } else {
      target.traverse((object) => [object.material ?? []].flat().forEach((material) => hooks.remove(this, material)));
    }
    return this;
  }

  // Irradiance [W/m2] at a point of the world with a unit normal there, into a Color. Where that is the normal of a normal map,
  // `surfaceNormal` is the surface's own.
  irradiance(position, normal, target = new Color(), surfaceNormal = normal) {
    const [point, direction, surfaceDirection] = this._local(position, normal, surfaceNormal);
    const [r, g, b] = this.lookup.irradiance(point, direction, surfaceDirection);
    return target.setRGB(r * this.intensity, g * this.intensity, b * this.intensity);
  }

  // The radiance that arrives at a point of the world, into a SphericalHarmonics3 as LightProbe wants it.
  radiance(position, target) {
    const [point] = this._local(position);
    const coefficients = turned(this.lookup.radiance(point), this._rotation());
    target.coefficients.forEach((c, i) => c.fromArray(coefficients, 3 * i).multiplyScalar(this.intensity));
    return target;
  }

  // Call `visit(position, live, volume)` for every probe: where it is in the world, whether it holds light, and the volume's index.
  forEachProbe(visit) {
    const position = new Vector3();
    this.volumes.forEach((volume, number) => {
      for (let index = 0; index < volume.count; index++) {
        const { place, live } = this.lookup.probe(volume, index);
        position.fromArray(place.map((value, axis) => value + volume.centre[axis])).applyMatrix4(this.matrixWorld);
        visit(position, live, number);
      }
    });
  }

  updateMatrixWorld(...args) {
    super.updateMatrixWorld(...args);
    this._updateUniforms();
  }

  updateWorldMatrix(...args) {
    super.updateWorldMatrix(...args);
    this._updateUniforms();
  }

  // The same probes, which light no material yet.
  clone(recursive) {
    const copy = new RTGIProbeVolumes(...this._source).copy(this, recursive);
    copy.intensity = this.intensity;
    return copy;
  }

  // Free the textures, and give materials back as they were.
  dispose() {
    hooks.clear(this);
    this.uniforms.rtgiProbes.value.dispose();
    this.uniforms.rtgiDistances.value.dispose();
    this.uniforms.rtgiWords?.value.dispose();
  }

  _updateUniforms() {
    this.uniforms.rtgiFromWorld.value.copy(this.matrixWorld).invert();
  }

  _local(position, ...normals) {
    const fromWorld = this.uniforms.rtgiFromWorld.value;
    return [position.clone().applyMatrix4(fromWorld), ...normals.map((normal) => normal.clone().transformDirection(fromWorld))]
      .map((vector) => vector.toArray());
  }

  _rotation() {
    return new Matrix3().setFromMatrix4(new Matrix4().extractRotation(this.matrixWorld));
  }

  _hook(material) {
    const { atlas } = this, part = atlas && material.userData.rtgiAtlas;
    const volumes = `${this.volumes.length}${this.uniforms.rtgiWords ? ' scattered' : ''}`;
    hooks.add(this, material, (shader, renderer) => {
      this._checkTextures(renderer);
      Object.assign(shader.uniforms, this.uniforms);
      spliceProbes(shader, this.volumes, material.name || material.type);
      this.mirrors?.splice(shader);
      if (part) {
        atlas.splice(shader, part);
      }
    }, () => `rtgi ${volumes} ${this.mirrors?.count ?? 0} ${part ? 'atlas' : ''}`);
  }

  _checkTextures(renderer) {
    const most = renderer.capabilities.maxTextureSize;
    for (const { image } of [this.uniforms.rtgiProbes.value, this.uniforms.rtgiDistances.value]) {
      if (Math.max(image.width, image.height) > most) {
        throw new Error(`RTGI: the probes fill a texture of ${image.width} x ${image.height}, this device takes ${most} at most: ` +
          'bake fewer probes');
      }
    }
  }
}

// A LightProbe for a scene without the hook, or for one that moves: `update` gives it the light of a point. As every LightProbe it
// lights all materials of the scene but those with the hook.
export class RTGILightProbe extends LightProbe {
  constructor(probes, intensity = 1) {
    super(undefined, intensity);
    this.probes = probes;
  }

  update(position) {
    this.probes.radiance(position, this.sh);
    return this;
  }

  clone(recursive) {
    return new RTGILightProbe(this.probes).copy(this, recursive);
  }
}

const LIT = ['isMeshStandardMaterial', 'isMeshLambertMaterial', 'isMeshPhongMaterial', 'isMeshToonMaterial'];
const isLit = (material) => LIT.some((name) => material[name]) && !material.isNodeMaterial;

// The volumes of a .json with what the look-up needs of each.
function prepare(volumes) {
  let firstProbe = 0, firstTexel = 0, firstNode = 0;
  return volumes.map((volume) => {
    const nodes = volume.resolution[0] * volume.resolution[1] * volume.resolution[2];
    const count = volume.probes ?? nodes;
    const offsetFromLattice = new Matrix4().fromArray(volume.latticeFromOffset).invert().toArray();
    const prepared = { ...volume, count, firstProbe, firstTexel, firstNode, offsetFromLattice };
    firstNode += volume.probes === undefined ? 0 : nodes;
    firstProbe += count;
    firstTexel += count * (volume.tile + 1) * (volume.tile + 2);
    return prepared;
  });
}

// The arrays of a .bin: halves of all probes, then distances of all tiles (mean, deviation), both in steps of two bytes, then words
// of the nodes of scattered volumes.
function unpack(volumes, buffer) {
  const total = volumes.reduce((sum, volume) => sum + volume.count, 0);
  const halves = new Uint16Array(buffer, 0, 4 * COEFFICIENTS * total);
  const numbers = Float32Array.from(halves, DataUtils.fromHalfFloat);
  const stored = new Uint16Array(buffer, halves.byteLength);
  const last = volumes.at(-1);
  const distances = new Uint16Array(4 * (last.firstTexel + last.count * (last.tile + 1) * (last.tile + 2)));
  let from = 0, to = 0;
  for (const { count, tile } of volumes) {
    for (let probe = 0; probe < count; probe++, from += 2 * tile * tile) {
      for (let row = -1; row <= tile; row++) {
        for (let column = -1; column < tile; column++, to += 4) {
          const texel = from + 2 * wrapped(row, column, tile), next = from + 2 * wrapped(row, column + 1, tile);
          distances[to] = stored[texel];
          distances[to + 1] = stored[texel + 1];
          distances[to + 2] = stored[next];
          distances[to + 3] = stored[next + 1];
        }
      }
    }
  }
  const words = new Float32Array(buffer, halves.byteLength + 2 * from);
  return { probes: { halves, numbers }, distances, words };
}

// Where the octahedral map goes on past the edges of its square: mirrored along an edge, in the opposite corner beyond a corner.
function wrapped(row, column, tile) {
  const last = tile - 1, clamp = (i) => Math.min(Math.max(i, 0), last);
  const outsideRow = row < 0 || row > last, outsideColumn = column < 0 || column > last;
  row = clamp(row);
  column = clamp(column);
  return (outsideColumn ? last - row : row) * tile + (outsideRow ? last - column : column);
}

function makeUniforms(volumes, halves, distances, words) {
  const flat = (values, type = Float32Array) => ({ value: type.from(volumes.flatMap(values)) });
  const scattered = words.length === 0 ? {} : {
    rtgiWords: { value: listTexture(words, 1, RGBAFormat, FloatType) },
    rtgiNodes: flat((volume) => [volume.firstNode, volume.probes === undefined ? 0 : 1], Int32Array),
  };
  return {
    ...scattered,
    rtgiProbes: { value: listTexture(halves, COEFFICIENTS, RGBAFormat, HalfFloatType) },
    rtgiDistances: { value: listTexture(distances, 1, RGBAIntegerFormat, UnsignedShortType, 'RGBA16UI') },
    rtgiFromWorld: { value: new Matrix4() },
    rtgiIntensity: { value: 1 },
    rtgiLatticeFromOffset: flat((volume) => volume.latticeFromOffset),
    rtgiOffsetFromLattice: flat((volume) => volume.offsetFromLattice),
    rtgiCentre: flat((volume) => [...volume.centre, volume.normalBias]),
    rtgiResolution: flat((volume) => [...volume.resolution, volume.firstProbe], Int32Array),
    rtgiTile: flat((volume) => [volume.tile, volume.firstTexel], Int32Array),
    rtgiDistanceStep: flat((volume) => [volume.distanceStep]),
  };
}

// `values` (RGBA texels) folded into a texture near a square, an item's `texels` side by side.
function listTexture(values, texels, format, type, internalFormat = null) {
  const items = values.length / (4 * texels);
  const perRow = Math.max(Math.min(Math.ceil(Math.sqrt(items / texels)), items), 1);
  const width = perRow * texels, height = Math.ceil(items / perRow);
  const padded = new values.constructor(4 * width * height);
  padded.set(values);
  const texture = new DataTexture(padded, width, height, format, type);
  // Old releases do not find the one of integers by themselves.
  texture.internalFormat = internalFormat;
  texture.magFilter = texture.minFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

// Twelve directions that integrate products of two harmonics of the second band exactly: the corners of an icosahedron.
const golden = (1 + Math.sqrt(5)) / 2;
const corners = [-1, 1].flatMap((s) => [-golden, golden].flatMap((t) => [[0, s, t], [s, t, 0], [t, 0, s]]))
  .map((corner) => new Vector3(...corner).normalize());

// Coefficients (27) of a function of directions after its `rotation`: projected anew.
function turned(coefficients, rotation) {
  const back = rotation.clone().transpose(), result = new Float64Array(coefficients.length);
  for (const corner of corners) {
    const before = harmonics(...corner.clone().applyMatrix3(back).toArray()), after = harmonics(...corner.toArray());
    for (let channel = 0; channel < 3; channel++) {
      const value = before.reduce((sum, basis, i) => sum + basis * coefficients[3 * i + channel], 0);
      after.forEach((basis, i) => { result[3 * i + channel] += (4 * Math.PI / corners.length) * basis * value; });
    }
  }
  return result;
}
