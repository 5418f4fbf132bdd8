// Holds the media on the CPU to RTGI's own numbers: `node media.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { compareMedia, summary } from './conformance/compare.js';
import { RTGIMedia } from './rtgi/RTGIMedia.js';

const folder = new URL('conformance/', import.meta.url);
const { steps, cases } = JSON.parse(await readFile(new URL('media.json', folder))), media = {};
for (const [name, file] of [['kit', 'kit_media.json'], ['bundle', '../rtgi/media.json']]) {
  const description = JSON.parse(await readFile(new URL(file, folder)));
  const content = await readFile(new URL(description.data.file, new URL(file, folder)));
  media[name] = new RTGIMedia(description, content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength));
}
const results = cases.map((expected) => compareMedia(expected, expected.points.map((point, i) => {
  const one = media[expected.media], direction = expected.directions[i];
  return Object.values(expected.kind === 'rays' ? one.march(point, direction, expected.lengths[i], steps) : one.at(point, direction));
})));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
