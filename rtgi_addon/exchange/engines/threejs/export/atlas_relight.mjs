// Holds the light atlas under other light to RTGI's own numbers on the CPU: `node atlas_relight.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { checkAtlasRelight } from './conformance/atlas_relight.js';
import { readKit, summary } from './conformance/compare.js';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';

async function read(name, type) {
  const content = await readFile(new URL(`conformance/${name}`, import.meta.url));
  return type === 'json' ? JSON.parse(content) : content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength);
}

const { probes } = await readKit(new RTGIProbeLoader(), read);
const results = await checkAtlasRelight(read, probes,
  (atlas, { parts, st, normals }) => parts.map((part, i) => atlas.irradiance(part, st[i], normals[i])));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
