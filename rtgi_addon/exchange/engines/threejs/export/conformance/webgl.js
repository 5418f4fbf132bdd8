// Holds the hook in three's own materials, on this machine's GPU, to RTGI's own numbers.

import * as THREE from 'three';
import { RTGILightProbe, RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { compare, readKit, summary } from './compare.js';
import { draw, read } from './draw.js';

const renderer = new THREE.WebGLRenderer();
if (!renderer.extensions.has('EXT_color_buffer_float')) {
  throw new Error('this GPU cannot draw into float textures (EXT_color_buffer_float), so it cannot be measured');
}
// Errors in shaders end in the console alone otherwise.
renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
  throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(vertex)} ${gl.getShaderInfoLog(fragment)}`);
};

const { cases, lightProbe, probes } = await readKit(new RTGIProbeLoader(), read);
const results = [];

async function readPixels(target) {
  const pixels = new Float32Array(4 * target.width * target.height);
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, pixels);
  return pixels;
}

function byLightProbe() {
  const light = new RTGILightProbe(probes.kit);
  return { lights: [light], moving: light };
}

async function check(label, expected, hooked, material, options) {
  hooked?.apply(material);
  results.push(compare(label, expected, await draw(renderer, readPixels, expected, material, options)));
  hooked?.release(material);
  material.dispose();
}

for (const expected of cases) {
  await check(expected.name, expected, probes[expected.volumes], new THREE.MeshStandardMaterial());
}
const hard = cases.find((expected) => expected.name === 'visibility');
for (const type of ['MeshPhysicalMaterial', 'MeshLambertMaterial', 'MeshPhongMaterial', 'MeshToonMaterial']) {
  await check(`visibility, ${type}`, hard, probes.kit, new THREE[type]());
}
await check('visibility, instanced', hard, probes.kit, new THREE.MeshLambertMaterial(), { instanced: true });
const sheet = new THREE.MeshStandardMaterial({ side: THREE.DoubleSide });
await check('visibility, from behind', hard, probes.kit, sheet, { behind: true });
await check('light probe', lightProbe, null, new THREE.MeshLambertMaterial(), byLightProbe());
// Light probes are for objects without the hook: with it they must not add to the light.
await check('visibility, beside a light probe', hard, probes.kit, new THREE.MeshStandardMaterial(), byLightProbe());

probes.kit.position.set(-3, 5, 2);
probes.kit.rotation.set(0.4, -1.1, 2.0);
probes.kit.scale.setScalar(1.7);
probes.kit.updateMatrixWorld();
const place = probes.kit.matrixWorld;
await check('visibility, moved', hard, probes.kit, new THREE.MeshStandardMaterial(), { place });
await check('light probe, moved', lightProbe, null, new THREE.MeshLambertMaterial(), { place, ...byLightProbe() });
Object.values(probes).forEach((volumes) => volumes.dispose());

const info = renderer.getContext().getExtension('WEBGL_debug_renderer_info');
const device = info ? renderer.getContext().getParameter(info.UNMASKED_RENDERER_WEBGL) : 'WebGL 2';
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
