// Holds relighting on this machine's GPU to RTGI's own numbers.

import * as THREE from 'three';
import { RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { readKit, summary } from './compare.js';
import { draw, read } from './draw.js';
import { checkRelight } from './relight.js';
import { device, readPixels, renderer } from './webgl_renderer.js';

const { probes, relitAtlas } = await readKit(new RTGIProbeLoader(), read);
const results = await checkRelight(read, probes, async (volumes, relight, asked) => {
  relight.parts = 3;
  while (!relight.update(renderer)) {
    // Not yet.
  }
  const material = new THREE.MeshStandardMaterial();
  volumes.apply(material);
  const found = await draw(renderer, readPixels, asked, material);
  volumes.release(material);
  material.dispose();
  return found;
});
// A light atlas follows with the probes.
if (relitAtlas) {
  const [{ checkAtlasRelight }, { lookUp }] = await Promise.all([import('./atlas_relight.js'), import('./webgl_atlas.js')]);
  results.push(...await checkAtlasRelight(read, probes, (atlas, asked) => lookUp(renderer, readPixels, atlas, asked), renderer));
}
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
