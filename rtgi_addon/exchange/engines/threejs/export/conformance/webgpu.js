// Holds RTGIProbeLight, for WebGPURenderer, to RTGI's own numbers: on WebGPU where the browser has it, else on WebGL 2.

import * as THREE from 'three/webgpu';
import { RTGIProbeLight } from '../rtgi/RTGIProbeLight.js';
import { RTGILightProbe, RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { compare, readKit, summary } from './compare.js';
import { draw, read } from './draw.js';

const renderer = new THREE.WebGPURenderer();
await renderer.init();

const { cases, lightProbe, probes } = await readKit(new RTGIProbeLoader(), read);
const results = [];

const readPixels = (target) => renderer.readRenderTargetPixelsAsync(target, 0, 0, target.width, target.height);

async function check(label, expected, light, material, options) {
  results.push(compare(label, expected, await draw(renderer, readPixels, expected, material, { lights: [light], ...options })));
  material.dispose();
}

const lights = { kit: new RTGIProbeLight(probes.kit), bundle: new RTGIProbeLight(probes.bundle) };
for (const expected of cases) {
  await check(expected.name, expected, lights[expected.volumes], new THREE.MeshStandardMaterial());
}
const hard = cases.find((expected) => expected.name === 'visibility');
for (const type of ['MeshPhysicalMaterial', 'MeshLambertMaterial', 'MeshPhongMaterial', 'MeshToonMaterial']) {
  await check(`visibility, ${type}`, hard, lights.kit, new THREE[type]());
}
await check('visibility, instanced', hard, lights.kit, new THREE.MeshLambertMaterial(), { instanced: true });
const sheet = new THREE.MeshStandardMaterial({ side: THREE.DoubleSide });
await check('visibility, from behind', hard, lights.kit, sheet, { behind: true, mapTurns: false });
const moving = new RTGILightProbe(probes.kit);
await check('light probe', lightProbe, moving, new THREE.MeshLambertMaterial(), { moving });

probes.kit.position.set(-3, 5, 2);
probes.kit.rotation.set(0.4, -1.1, 2.0);
probes.kit.scale.setScalar(1.7);
probes.kit.updateMatrixWorld();
await check('visibility, moved', hard, lights.kit, new THREE.MeshStandardMaterial(), { place: probes.kit.matrixWorld });

const device = renderer.backend.isWebGPUBackend ? 'WebGPU' : 'WebGL 2 in place of WebGPU';
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
