// A style of RTGI (bands, ramps, rims and lines) for three.js's WebGLRenderer: a hook for lit materials and a pass over the screen.
//
//   const style = await loadStyle('rtgi/style.json');
//   style.apply(model);                              // after probes.apply, which the light comes from
//   const view = new RTGIStyleView(style);
//   view.render(renderer, scene, camera);            // instead of renderer.render(scene, camera)
//
// Materials band the sum of all light, lamps' and probes'. Lines see what is opaque: transparent objects, points, lines and sprites
// have none, and what a map cuts out has those of its whole surface. Scene-linear colours, metres, Y up.

import {
  Color, DoubleSide, FloatType, HalfFloatType, LinearFilter, Matrix4, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, SRGBColorSpace,
  Scene, ShaderChunk, ShaderMaterial, TextureLoader, Vector2, Vector3, WebGLRenderTarget,
} from 'three';
import { Hooks } from './hook.js';

export const FORMAT = 'rtgi-three-style/1';
const COLORS = ['shadow_color', 'paper_color', 'tint', 'line_color', 'rim_color'];
const LIT = ['isMeshStandardMaterial', 'isMeshLambertMaterial', 'isMeshPhongMaterial', 'isMeshToonMaterial'];
// What a number of a surface has room for.
const MOST_OBJECTS = 16383, MOST_MATERIALS = 1024;
const hooks = new Hooks();

// The style of the .json at `url`, with the picture of its ramps beside it.
export async function loadStyle(url) {
  const place = new URL(url, globalThis.location?.href);
  const response = await fetch(place);
  if (!response.ok) {
    throw new Error(`RTGI: ${place} could not be read (${response.status})`);
  }
  const description = await response.json();
  return new RTGIStyle(description, await new TextureLoader().loadAsync(new URL(description.ramps, place).href));
}

export class RTGIStyle {
  // `description` is the parsed .json, `ramps` the texture of its picture.
  constructor(description, ramps) {
    if (description.format !== FORMAT) {
      throw new Error(`RTGI: the style is ${description.format ?? 'of no format'} instead of ${FORMAT}: export again`);
    }
    Object.assign(ramps, { flipY: false, generateMipmaps: false, minFilter: LinearFilter, magFilter: LinearFilter,
      colorSpace: SRGBColorSpace, needsUpdate: true });
    this.glsl = description.glsl;
    // `style_NAME` for every name of the .json's values: change them as you like.
    this.uniforms = { style_ramps: { value: ramps } };
    for (const [name, value] of Object.entries(description.values)) {
      this.uniforms[`style_${name}`] = { value: COLORS.includes(name) ? new Vector3(...value) : value };
    }
  }

  // Draw `target`, a material or every lit material below an Object3D, in the style, and return this. Materials that probes light are
  // applied to those first.
  apply(target) {
    materialsOf(target).filter(isLit).forEach((material) => this._hook(material));
    return this;
  }

  // Give `target`, a material or everything below an Object3D, back as it was, and return this; before the probes release it.
  release(target) {
    materialsOf(target).forEach((material) => hooks.remove(this, material));
    return this;
  }

  // Free the ramps, and give materials back as they were.
  dispose() {
    hooks.clear(this);
    this.uniforms.style_ramps.value.dispose();
  }

  _hook(material) {
    hooks.add(this, material, (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      spliceStyle(shader, this.glsl.tone, material);
    }, () => 'rtgi style');
  }
}

// Draws a scene with lines, paper and grading over it.
export class RTGIStyleView {
  constructor(style) {
    this.style = style;
    this.picture = new WebGLRenderTarget(1, 1, { type: HalfFloatType, samples: 4 });
    this.surfaces = new WebGLRenderTarget(1, 1, { type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter });
    this.surfaceMaterial = new ShaderMaterial({ ...surfaceShader, side: DoubleSide,
      uniforms: { rtgiObject: { value: 0 }, rtgiMaterial: { value: 0 } } });
    this.surfaceMaterial.onBeforeRender = (renderer, scene, camera, geometry, object, group) => this._name(object, group);
    this.material = new ShaderMaterial({ depthTest: false, depthWrite: false, ...linesShader(style.glsl), uniforms: {
      ...style.uniforms, picture: { value: this.picture.texture }, surfaces: { value: this.surfaces.texture },
      parallel: { value: false }, pixelWidth: { value: 1 }, cameraFromClip: { value: new Matrix4() } } });
    this._numbers = new WeakMap();
    this._materials = 0;
    this._quad = new Mesh(new PlaneGeometry(2, 2), this.material);
    this._quad.frustumCulled = false;
    this._scene = new Scene().add(this._quad);
    this._camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  }

  // Draw `scene` as `camera` sees it, to the renderer's current target; `draw` is how it is drawn before lines.
  render(renderer, scene, camera, draw = () => renderer.render(scene, camera)) {
    const before = renderer.getRenderTarget();
    const size = before ? new Vector2(before.width, before.height) : renderer.getDrawingBufferSize(new Vector2());
    for (const target of [this.picture, this.surfaces]) {
      if (target.width !== size.x || target.height !== size.y) {
        target.setSize(size.x, size.y);
      }
    }
    renderer.setRenderTarget(this.picture);
    draw(renderer, scene, camera);
    renderer.setRenderTarget(this.surfaces);
    this._drawSurfaces(renderer, scene, camera);
    renderer.setRenderTarget(before);
    const { parallel, pixelWidth, cameraFromClip } = this.material.uniforms;
    parallel.value = camera.projectionMatrix.elements[15] === 1;
    pixelWidth.value = 2 / (Math.abs(camera.projectionMatrix.elements[0]) * size.x);
    cameraFromClip.value.copy(camera.projectionMatrixInverse);
    renderer.render(this._scene, this._camera);
  }

  dispose() {
    [this.picture, this.surfaces, this.material, this.surfaceMaterial, this._quad.geometry].forEach((one) => one.dispose());
  }

  _drawSurfaces(renderer, scene, camera) {
    const { background, overrideMaterial } = scene;
    const color = renderer.getClearColor(new Color()), alpha = renderer.getClearAlpha(), { autoUpdate } = renderer.shadowMap;
    const hidden = [];
    let next = 0;
    scene.traverseVisible((object) => {
      if (object.isMesh && [object.material].flat().some((material) => !material.transparent)) {
        this._numbers.set(object, next);
        next += object.isInstancedMesh ? object.count : 1;
      } else if (object.isMesh || object.isPoints || object.isLine || object.isSprite) {
        hidden.push([object, object.layers.mask]);
        object.layers.mask = 0;
      }
    });
    try {
      Object.assign(scene, { background: null, overrideMaterial: this.surfaceMaterial });
      renderer.shadowMap.autoUpdate = false;
      renderer.setClearColor(0, 0);
      renderer.clear();
      renderer.render(scene, camera);
    } finally {
      Object.assign(scene, { background, overrideMaterial });
      renderer.shadowMap.autoUpdate = autoUpdate;
      renderer.setClearColor(color, alpha);
      hidden.forEach(([object, mask]) => { object.layers.mask = mask; });
    }
  }

  // What the next surface is called, and which of its sides are drawn.
  _name(object, group) {
    const material = Array.isArray(object.material) ? object.material[group?.materialIndex ?? 0] : object.material;
    if (!this._numbers.has(material)) {
      this._numbers.set(material, this._materials++);
    }
    const { rtgiObject, rtgiMaterial } = this.surfaceMaterial.uniforms;
    rtgiObject.value = this._numbers.get(object);
    rtgiMaterial.value = this._numbers.get(material) % MOST_MATERIALS;
    Object.assign(this.surfaceMaterial, { side: material.side, uniformsNeedUpdate: true });
  }
}

// Splice the style of surfaces into `shader`, as onBeforeCompile receives it: after all light is summed up.
export function spliceStyle(shader, tone, material) {
  // Newer releases have a metal's share taken out of a member of its own.
  const newer = material.isMeshStandardMaterial && ShaderChunk.lights_physical_pars_fragment.includes('vec3 diffuseContribution');
  const specular = material.isMeshStandardMaterial || material.isMeshPhongMaterial;
  const main = surfaceMain(newer ? 'diffuseContribution' : 'diffuseColor', specular);
  for (const [chunk, after] of [['common', tone], ['aomap_fragment', main]]) {
    const include = `#include <${chunk}>`;
    if (!shader.fragmentShader.includes(include)) {
      throw new Error(`RTGI: the fragmentShader of material "${material.name || material.type}" has no ${include}, after which it is ` +
        'styled: use a built-in lit material of three 0.160 or later');
    }
    shader.fragmentShader = shader.fragmentShader.replace(include, () => `${include}\n${after}`);
  }
}

const surfaceMain = (member, specular) => /* glsl */ `
if (style_shading != 3) {
  vec3 rtgiBase = max(material.${member}, vec3(1e-4)) * RECIPROCAL_PI;
  vec3 rtgiDirect = reflectedLight.directDiffuse / rtgiBase;
  vec3 rtgiIndirect = reflectedLight.indirectDiffuse / rtgiBase;
  float rtgiTone = rtgi_luminance(rtgiDirect + rtgiIndirect) / style_key;
  float rtgiCosine = dot(normalize(normal), isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition));
  reflectedLight.directDiffuse = rtgiBase * rtgi_styled_light(rtgiDirect, rtgiIndirect, fwidth(rtgiTone))
    + rtgi_rim(rtgiCosine, rtgi_luminance(rtgiDirect) / style_key);
  reflectedLight.indirectDiffuse = vec3(0.0);
  ${specular ? 'reflectedLight.directSpecular = rtgi_styled_shine(reflectedLight.directSpecular);' : ''}
}
`;

const surfaceShader = {
  vertexShader: /* glsl */ `
uniform float rtgiObject, rtgiMaterial;
varying vec3 rtgiPlace;
flat varying float rtgiNumber;
#include <common>
#include <batching_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
void main() {
  #include <batching_vertex>
  #include <beginnormal_vertex>
  ${ShaderChunk.morphinstance_vertex ? '#include <morphinstance_vertex>' : ''}
  #include <morphnormal_vertex>
  #include <skinbase_vertex>
  #include <skinnormal_vertex>
  #include <defaultnormal_vertex>
  #include <normal_vertex>
  #include <begin_vertex>
  #include <morphtarget_vertex>
  #include <skinning_vertex>
  #include <project_vertex>
  float object = rtgiObject;
  #ifdef USE_INSTANCING
    object += float(gl_InstanceID);
  #endif
  rtgiPlace = mvPosition.xyz;
  rtgiNumber = 1024.0 * (1.0 + mod(object, ${MOST_OBJECTS}.0)) + rtgiMaterial;
}
`,
  fragmentShader: /* glsl */ `
varying vec3 rtgiPlace;
flat varying float rtgiNumber;
#include <normal_pars_fragment>
void main() {
  vec3 normal = normalize(vNormal);
  // Towards the camera on whatever side is seen.
  normal *= dot(cross(dFdx(rtgiPlace), dFdy(rtgiPlace)), normal) < 0.0 ? -1.0 : 1.0;
  normal /= abs(normal.x) + abs(normal.y) + abs(normal.z);
  vec2 folded = (1.0 - abs(normal.yx)) * vec2(normal.x < 0.0 ? -1.0 : 1.0, normal.y < 0.0 ? -1.0 : 1.0);
  gl_FragColor = vec4(normal.z < 0.0 ? folded : normal.xy, -rtgiPlace.z, rtgiNumber);
}
`,
};

const linesShader = ({ tone, lines }) => ({
  vertexShader: 'varying vec2 place;\nvoid main() {\n  place = uv;\n  gl_Position = vec4(position.xy, 0.0, 1.0);\n}\n',
  fragmentShader: `${tone}
uniform sampler2D picture;
uniform highp sampler2D surfaces;
uniform bool parallel;
uniform float pixelWidth;
uniform mat4 cameraFromClip;
varying vec2 place;
${lines}
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec4 ray = cameraFromClip * vec4(2.0 * place - 1.0, 1.0, 1.0);
  vec3 towards = parallel ? vec3(0.0, 0.0, 1.0) : normalize(-ray.xyz / ray.w);
  float cosine = dot(rtgi_normal_of(rtgi_surface(texel)), towards);
  gl_FragColor = vec4(rtgi_styled_pixel(texel, texture(picture, place).rgb, cosine), 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
}
`,
});

const isLit = (material) => LIT.some((name) => material[name]) && !material.isNodeMaterial;

function materialsOf(target) {
  if (target.isMaterial) {
    return [target];
  }
  const found = new Set();
  target.traverse((object) => [object.material ?? []].flat().forEach((material) => found.add(material)));
  return [...found];
}
