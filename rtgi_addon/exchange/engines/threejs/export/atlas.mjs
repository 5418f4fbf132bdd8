// Holds the light atlas on the CPU to RTGI's own numbers: `node atlas.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { compare, summary } from './conformance/compare.js';
import { RTGIAtlas } from './rtgi/RTGIAtlas.js';

const folder = new URL('conformance/', import.meta.url);
const { cases } = JSON.parse(await readFile(new URL('atlas.json', folder))), atlases = {};
for (const [name, file] of [['kit', 'kit_atlas.json'], ['bundle', '../rtgi/atlas.json']]) {
  const description = JSON.parse(await readFile(new URL(file, folder)));
  const content = await readFile(new URL(description.data.file, new URL(file, folder)));
  atlases[name] = new RTGIAtlas(description, content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength));
}
const results = cases.map((expected) => compare(expected.name, expected,
  expected.st.map((st, i) => atlases[expected.atlas].irradiance(expected.parts[i], st, expected.normals[i]))));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
