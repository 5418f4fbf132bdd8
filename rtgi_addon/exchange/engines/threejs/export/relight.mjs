// Holds relighting on the CPU to RTGI's own numbers: `npm install`, then `node relight.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { Color, Vector3 } from 'three';
import { readKit, summary } from './conformance/compare.js';
import { checkRelight } from './conformance/relight.js';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';

async function read(name, type) {
  const content = await readFile(new URL(`conformance/${name}`, import.meta.url));
  return type === 'json' ? JSON.parse(content) : content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength);
}

const { probes } = await readKit(new RTGIProbeLoader(), read);
const results = await checkRelight(read, probes, (volumes, relight, asked) => {
  // In parts, as a game would.
  relight.parts = 3;
  while (!relight.update()) {
    // Not yet.
  }
  return asked.points.map((point, i) => volumes.irradiance(new Vector3(...point), new Vector3(...asked.normals[i]), new Color(),
    new Vector3(...asked.surface_normals[i])).toArray());
});
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
