// Holds the sphere probes on the CPU to RTGI's own numbers: `node spheres.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { compare, summary } from './conformance/compare.js';
import { RTGISpheres } from './rtgi/RTGISpheres.js';

const folder = new URL('conformance/', import.meta.url);
const { cases } = JSON.parse(await readFile(new URL('spheres.json', folder))), spheres = {};
for (const [name, file] of [['kit', 'kit_spheres.json'], ['bundle', '../rtgi/spheres.json']]) {
  const description = JSON.parse(await readFile(new URL(file, folder)));
  const content = await readFile(new URL(description.data.file, new URL(file, folder)));
  spheres[name] = new RTGISpheres(description, content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength));
}
const results = cases.map((expected) => compare(expected.name, { irradiance: expected.radiance, tolerance: expected.tolerance },
  expected.points.map((point, i) => spheres[expected.probes].mirrored(point, expected.directions[i], expected.roughness[i]))));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
