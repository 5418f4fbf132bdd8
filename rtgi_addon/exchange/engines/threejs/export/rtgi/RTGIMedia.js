// The media of a bake (fog, smoke, fire) for three.js: their textures and uniforms, a shader that marches them, and the same on the
// CPU.
//
//   const media = await loadMedia('rtgi/media.json');
//   const view = new RTGIMediaView(media);
//   view.render(renderer, scene, camera);          // instead of renderer.render(scene, camera)
//
// What is scattered is the ambient light of the bake. Lamps of three.js scatter in a shader of your own, which puts `media.glsl` after
// `#define RTGI_MEDIA_LAMPS` (see there) and takes `media.uniforms`. Radiance [W/(sr m2)], metres, Y up.

import {
  Data3DTexture, DataUtils, DepthTexture, FloatType, HalfFloatType, LinearFilter, Matrix3, Matrix4, Mesh, OrthographicCamera,
  PlaneGeometry, RGBAFormat, RedFormat, Scene, ShaderMaterial, Vector2, Vector3, Vector4, WebGLRenderTarget,
} from 'three';

export const FORMAT = 'rtgi-three-media/1';
const THIN = 0.01, STEPS = 48, FARTHEST = 1e3;

// The media of the .json at `url` and of the .bin beside it.
export async function loadMedia(url) {
  const read = async (name, type) => {
    const response = await fetch(name);
    if (!response.ok) {
      throw new Error(`RTGI: ${name} could not be read (${response.status}). Copy both files of one export`);
    }
    return type === 'json' ? response.json() : response.arrayBuffer();
  };
  const place = new URL(url, globalThis.location?.href);
  const description = await read(place, 'json');
  return new RTGIMedia(description, await read(new URL(description.data.file, place), 'arraybuffer'));
}

export class RTGIMedia {
  // `description` is the parsed .json, `buffer` the ArrayBuffer of the .bin.
  constructor(description, buffer) {
    if (description.format !== FORMAT) {
      throw new Error(`RTGI: the media are ${description.format ?? 'of no format'} instead of ${FORMAT}: export again`);
    }
    if (buffer.byteLength !== description.data.bytes) {
      throw new Error(`RTGI: ${description.data.file} holds ${buffer.byteLength} bytes, its .json says ${description.data.bytes}` +
        ': copy both files of one export');
    }
    this.glsl = description.glsl;
    this.description = description;
    const scattering = description.scattering;
    this.bands = [0, 3, 6].map((first) => scattering.slice(first, first + 3));
    let offset = 0;
    const take = (resolution, blocks, channels) => {
      const count = resolution[0] * resolution[1] * resolution[2] * blocks * channels;
      const halves = new Uint16Array(buffer, 2 * offset, count);
      offset += count;
      return { resolution, blocks, channels, halves, numbers: Float32Array.from(halves, DataUtils.fromHalfFloat) };
    };
    this.ambient = { ...description.ambient, ...take(description.ambient.resolution, 7, 4) };
    this.boxes = description.boxes.map((box) => ({ ...box, ...take(box.resolution, box.blocks, box.blocks === 1 ? 1 : 4) }));
    this.uniforms = {
      rtgi_media_ambient: { value: texture(this.ambient) },
      rtgi_media_ambient_from_world: { value: new Matrix4().fromArray(this.ambient.unitFromWorld) },
      rtgi_media_ambient_size: { value: new Vector3(...this.ambient.resolution) },
      rtgi_media_turn: { value: new Matrix3() },
      rtgi_media_everywhere: { value: description.everywhere },
      rtgi_media_extinction: { value: new Vector3(...description.extinction) },
      rtgi_media_emission: { value: new Vector3(...description.emission) },
      rtgi_media_scattering: { value: new Matrix3().fromArray(scattering) },
    };
    this.boxes.forEach((box, number) => Object.assign(this.uniforms, {
      [`rtgi_cells_${number}`]: { value: texture(box) },
      [`rtgi_unit_from_world_${number}`]: { value: new Matrix4().fromArray(box.unitFromWorld) },
      [`rtgi_cells_size_${number}`]: { value: new Vector4(...box.resolution, box.blocks) },
      [`rtgi_scattering_${number}`]: { value: new Vector3(...box.scattering) },
      [`rtgi_absorption_${number}`]: { value: new Vector3(...box.absorption) },
      [`rtgi_emission_${number}`]: { value: new Vector3(...box.emission) },
      [`rtgi_moments_${number}`]: { value: new Vector2(...box.moments) },
    }));
  }

  // What rtgi_media_at says at `point` along the unit `direction` ([x, y, z] each): { extinction, given }, three numbers each.
  at(point, direction) {
    const { description, boxes } = this;
    const extinction = [...description.extinction], given = [...description.emission];
    const scattered = this.bands.map((band) => [...band]);
    for (const box of boxes) {
      const place = transform(box.unitFromWorld, point);
      if (place.some((value) => value < 0 || value > 1)) {
        continue;
      }
      const first = sample(box, place, 0);
      const [s, a, e] = box.blocks === 1 ? [Array(3).fill(first[0]), Array(3).fill(first[0]), [1, 1, 1]]
        : [first, sample(box, place, 1), sample(box, place, 2)];
      for (let c = 0; c < 3; c++) {
        const scattering = box.scattering[c] * s[c];
        extinction[c] += scattering + box.absorption[c] * a[c];
        given[c] += box.emission[c] * e[c];
        [1, ...box.moments].forEach((moment, band) => { scattered[band][c] += moment * scattering; });
      }
    }
    const light = this._bands(point, direction);
    for (let c = 0; c < 3; c++) {
      given[c] += Math.max(scattered.reduce((sum, band, l) => sum + band[c] * light[l][c], 0), 0);
    }
    return { extinction, given };
  }

  // What rtgi_media_march says: { left, gained }, the transmittance of `length` and the radiance that media add.
  march(origin, direction, length, steps = STEPS, jitter = 0.5) {
    let first = length, last = 0;
    if (this.description.everywhere) {
      [first, last] = [0, length];
    } else {
      for (const box of this.boxes) {
        const start = transform(box.unitFromWorld, origin), end = transform(box.unitFromWorld, add(origin, direction, 1));
        let enter = 0, leave = length;
        start.forEach((value, axis) => {
          const along = Math.abs(end[axis] - value) > 1e-12 ? end[axis] - value : 1e-12;
          const [low, high] = [-value / along, (1 - value) / along];
          enter = Math.max(enter, Math.min(low, high));
          leave = Math.min(leave, Math.max(low, high));
        });
        if (leave > enter) {
          [first, last] = [Math.min(first, enter), Math.max(last, leave)];
        }
      }
    }
    const stride = Math.max(last - first, 0) / steps;
    const left = [1, 1, 1], gained = [0, 0, 0];
    for (let number = 0; number < (stride > 0 ? steps : 0); number++) {
      const { extinction, given } = this.at(add(origin, direction, first + stride * (number + jitter)), direction);
      for (let c = 0; c < 3; c++) {
        const depth = extinction[c] * stride;
        gained[c] += left[c] * given[c] * (depth < THIN ? 1 - depth * (0.5 - depth / 6) : -Math.expm1(-depth) / depth) * stride;
        left[c] *= Math.exp(-depth);
      }
    }
    return { left, gained };
  }

  dispose() {
    Object.values(this.uniforms).forEach(({ value }) => value.isTexture && value.dispose());
  }

  _bands(point, [x, y, z]) {
    const place = transform(this.ambient.unitFromWorld, point);
    const blocks = Array.from({ length: 7 }, (_, block) => sample(this.ambient, place, block));
    const first = [0.4886025 * y, 0.4886025 * z, 0.4886025 * x];
    const second = [1.0925484 * x * y, 1.0925484 * y * z, 0.3153916 * (3 * z * z - 1), 1.0925484 * x * z];
    const bands = [[], [], []];
    for (let c = 0; c < 3; c++) {
      const [low, high] = [blocks[2 * c], blocks[2 * c + 1]];
      bands[0].push(0.2820948 * low[0]);
      bands[1].push(first.reduce((sum, basis, i) => sum + basis * low[i + 1], 0));
      bands[2].push(second.reduce((sum, basis, i) => sum + basis * high[i], 0.5462742 * (x * x - y * y) * blocks[6][c]));
    }
    return bands;
  }
}

// Draws a scene with media in front of its surfaces. Depth comes from the scene's own; what is transparent is fogged as what is
// behind it.
export class RTGIMediaView {
  constructor(media, { steps = STEPS, farthest = FARTHEST } = {}) {
    this.media = media;
    this.target = new WebGLRenderTarget(1, 1, { type: HalfFloatType, depthTexture: new DepthTexture(1, 1, FloatType), samples: 0 });
    this.material = new ShaderMaterial({
      depthTest: false, depthWrite: false,
      uniforms: { ...media.uniforms, surfaces: { value: this.target.texture }, depths: { value: this.target.depthTexture },
        worldFromClip: { value: new Matrix4() }, eye: { value: new Vector3() }, farthest: { value: farthest } },
      vertexShader: 'varying vec2 place;\nvoid main() {\n  place = uv;\n  gl_Position = vec4(position.xy, 0.0, 1.0);\n}\n',
      fragmentShader: `${media.glsl}
uniform sampler2D surfaces;
uniform highp sampler2D depths;
uniform mat4 worldFromClip;
uniform vec3 eye;
uniform float farthest;
varying vec2 place;
void main() {
  float depth = texture2D(depths, place).r;
  vec4 end = worldFromClip * vec4(2.0 * vec3(place, depth) - 1.0, 1.0);
  vec3 ray = end.xyz / end.w - eye;
  float far = depth < 1.0 ? length(ray) : farthest;
  vec3 left, gained;
  rtgi_media_march(eye, normalize(ray), far, ${steps},
    fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))), left, gained);
  gl_FragColor = vec4(left * texture2D(surfaces, place).rgb + gained, 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
}
`,
    });
    this._scene = new Scene();
    this._quad = new Mesh(new PlaneGeometry(2, 2), this.material);
    this._quad.frustumCulled = false;
    this._scene.add(this._quad);
    this._camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  }

  // Draw `scene` as `camera` sees it, to the renderer's current target.
  render(renderer, scene, camera) {
    const size = renderer.getDrawingBufferSize(new Vector2());
    if (this.target.width !== size.x || this.target.height !== size.y) {
      this.target.setSize(size.x, size.y);
    }
    const before = renderer.getRenderTarget();
    renderer.setRenderTarget(this.target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(before);
    const { worldFromClip, eye } = this.material.uniforms;
    worldFromClip.value.copy(camera.projectionMatrixInverse).premultiply(camera.matrixWorld);
    eye.value.setFromMatrixPosition(camera.matrixWorld);
    renderer.render(this._scene, this._camera);
  }

  dispose() {
    this.target.dispose();
    this.material.dispose();
    this._quad.geometry.dispose();
  }
}

function texture({ resolution: [nx, ny, nz], blocks, channels, halves }) {
  const made = new Data3DTexture(halves, nx, ny, nz * blocks);
  made.format = channels === 1 ? RedFormat : RGBAFormat;
  made.type = HalfFloatType;
  made.minFilter = made.magFilter = LinearFilter;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}

// Trilinear, between the cells of one block alone.
function sample({ resolution, channels, numbers }, place, block) {
  const low = [], fraction = [];
  resolution.forEach((count, axis) => {
    const at = Math.min(Math.max(place[axis] * count - 0.5, 0), count - 1);
    low.push(Math.min(Math.floor(at), Math.max(count - 2, 0)));
    fraction.push(at - low[axis]);
  });
  const result = Array(channels).fill(0);
  for (let corner = 0; corner < 8; corner++) {
    let weight = 1, index = block * resolution[2];
    for (let axis = 2; axis >= 0; axis--) {
      const step = corner >> axis & 1;
      weight *= step ? fraction[axis] : 1 - fraction[axis];
      const at = Math.min(low[axis] + step, resolution[axis] - 1);
      index = axis === 2 ? index + at : index * resolution[axis] + at;
    }
    for (let c = 0; weight > 0 && c < channels; c++) {
      result[c] += weight * numbers[channels * index + c];
    }
  }
  return result;
}

const add = (origin, direction, distance) => origin.map((value, axis) => value + distance * direction[axis]);
const transform = (m, [x, y, z]) => [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
