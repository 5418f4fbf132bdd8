// Holds relighting for WebGPURenderer, which shows what the CPU makes of it, to RTGI's own numbers.

import * as THREE from 'three/webgpu';
import { RTGIProbeLight } from '../rtgi/RTGIProbeLight.js';
import { RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { readKit, summary } from './compare.js';
import { draw, read } from './draw.js';
import { checkRelight } from './relight.js';

const renderer = new THREE.WebGPURenderer();
await renderer.init();
const readPixels = (target) => renderer.readRenderTargetPixelsAsync(target, 0, 0, target.width, target.height);

const { probes } = await readKit(new RTGIProbeLoader(), read);
const lights = new Map(Object.values(probes).map((volumes) => [volumes, new RTGIProbeLight(volumes)]));
const results = await checkRelight(read, probes, async (volumes, relight, asked) => {
  relight.parts = 3;
  while (!relight.update()) {
    // Not yet.
  }
  const material = new THREE.MeshStandardMaterial();
  const found = await draw(renderer, readPixels, asked, material, { lights: [lights.get(volumes)] });
  material.dispose();
  return found;
});
const device = renderer.backend.isWebGPUBackend ? 'WebGPU' : 'WebGL 2 in place of WebGPU';
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
