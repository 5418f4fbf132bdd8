// Holds cones through the voxels on the CPU to RTGI's own numbers: `node voxels.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { compare, summary } from './conformance/compare.js';
import { RTGIVoxels } from './rtgi/RTGIVoxels.js';

const folder = new URL('conformance/', import.meta.url);
const { cases } = JSON.parse(await readFile(new URL('voxels.json', folder))), voxels = {};
for (const [name, file] of [['kit', 'kit_voxels.json'], ['bundle', '../rtgi/voxels.json']]) {
  const description = JSON.parse(await readFile(new URL(file, folder)));
  const content = await readFile(new URL(description.data.file, new URL(file, folder)));
  voxels[name] = new RTGIVoxels(description, content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength));
}
const results = cases.map((expected) => compare(expected.name, expected,
  expected.points.map((point, i) => voxels[expected.voxels].irradiance(point, expected.normals[i]))));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
