// Draws every point of the kit as one pixel of a white surface that faces the point's normal, with three's own materials and the
// hook in them, into a float target: what comes back is irradiance over pi.

import * as THREE from 'three';
import { RTGILightProbe, RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { compare, readKit, summary } from './compare.js';

const FORWARD = new THREE.Vector3(0, 0, 1);
const renderer = new THREE.WebGLRenderer();
if (!renderer.extensions.has('EXT_color_buffer_float')) {
  throw new Error('this GPU cannot draw into float textures (EXT_color_buffer_float), so it cannot be measured');
}
// Errors in shaders end in the console alone otherwise.
renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
  throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(vertex)} ${gl.getShaderInfoLog(fragment)}`);
};

async function read(name, type) {
  const response = await fetch(new URL(name, import.meta.url));
  if (!response.ok) {
    throw new Error(`${name}: ${response.status} ${response.statusText}`);
  }
  return type === 'json' ? response.json() : response.arrayBuffer();
}

// A square around the origin that faces z, by itself or as the second of two instances.
function square(material, instanced) {
  const geometry = new THREE.PlaneGeometry(1, 1);
  if (!instanced) {
    return new THREE.Mesh(geometry, material);
  }
  const mesh = new THREE.InstancedMesh(geometry, material, 2);
  mesh.frustumCulled = false;
  mesh.setMatrixAt(0, new THREE.Matrix4().makeTranslation(0, 0, -1e4));
  mesh.setMatrixAt(1, new THREE.Matrix4());
  return mesh;
}

// Irradiance at every point of `expected`, as a surface of `material` shows it.
function draw(expected, material, { place = new THREE.Matrix4(), light = null, instanced = false } = {}) {
  const count = expected.points.length;
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false });
  const scene = new THREE.Scene();
  const mesh = square(material, instanced);
  const camera = new THREE.OrthographicCamera(-0.4, 0.4, 0.4, -0.4, 0.1, 2);
  scene.add(mesh, ...(light ? [light] : []));
  renderer.autoClear = false;
  const point = new THREE.Vector3(), normal = new THREE.Vector3();
  expected.points.forEach((position, i) => {
    point.fromArray(position).applyMatrix4(place);
    normal.fromArray(expected.normals[i]).transformDirection(place);
    mesh.position.copy(point);
    mesh.quaternion.setFromUnitVectors(FORWARD, normal);
    camera.position.copy(point).add(normal);
    camera.quaternion.copy(mesh.quaternion);
    light?.update(point);
    target.viewport.set(i, 0, 1, 1);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
  });
  const pixels = new Float32Array(4 * count);
  renderer.readRenderTargetPixels(target, 0, 0, count, 1, pixels);
  target.dispose();
  mesh.geometry.dispose();
  return expected.points.map((_, i) => [...pixels.subarray(4 * i, 4 * i + 3)].map((value) => Math.PI * value));
}

const { cases, lightProbe, probes } = await readKit(new RTGIProbeLoader(), read);
const results = [];

function check(label, expected, hooked, material, options) {
  hooked?.apply(material);
  results.push(compare(label, expected, draw(expected, material, options)));
  hooked?.release(material);
  material.dispose();
}

for (const expected of cases) {
  check(expected.name, expected, probes[expected.volumes], new THREE.MeshStandardMaterial());
}
const hard = cases.find((expected) => expected.name === 'visibility');
for (const type of ['MeshPhysicalMaterial', 'MeshLambertMaterial', 'MeshPhongMaterial', 'MeshToonMaterial']) {
  check(`visibility, ${type}`, hard, probes.kit, new THREE[type]());
}
check('visibility, instanced', hard, probes.kit, new THREE.MeshLambertMaterial(), { instanced: true });
check('light probe', lightProbe, null, new THREE.MeshLambertMaterial(), { light: new RTGILightProbe(probes.kit) });
// Light probes are for objects without the hook: with it they must not add to the light.
check('visibility, beside a light probe', hard, probes.kit, new THREE.MeshStandardMaterial(),
  { light: new RTGILightProbe(probes.kit) });

probes.kit.position.set(-3, 5, 2);
probes.kit.rotation.set(0.4, -1.1, 2.0);
probes.kit.scale.setScalar(1.7);
probes.kit.updateMatrixWorld();
const place = probes.kit.matrixWorld;
check('visibility, moved', hard, probes.kit, new THREE.MeshStandardMaterial(), { place });
check('light probe, moved', lightProbe, null, new THREE.MeshLambertMaterial(), { place, light: new RTGILightProbe(probes.kit) });
Object.values(probes).forEach((volumes) => volumes.dispose());

const info = renderer.getContext().getExtension('WEBGL_debug_renderer_info');
const device = info ? renderer.getContext().getParameter(info.UNMASKED_RENDERER_WEBGL) : 'WebGL 2';
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
