// Holds the loader's look-up on the CPU to RTGI's own numbers: `npm install`, then `node conformance.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { Color, Euler, SphericalHarmonics3, Vector3 } from 'three';
import { compare, readKit, summary } from './conformance/compare.js';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';

async function read(name, type) {
  const content = await readFile(new URL(`conformance/${name}`, import.meta.url));
  return type === 'json' ? JSON.parse(content) : content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength);
}

function irradiance(probes, points, normals, surfaceNormals) {
  return points.map((point, i) => probes.irradiance(point, normals[i], new Color(), surfaceNormals[i]).toArray());
}

// The light probe's way: coefficients at a point, then what three's shader makes of them.
function lightProbe(probes, points, normals) {
  return points.map((point, i) => {
    const sh = probes.radiance(point, new SphericalHarmonics3());
    return sh.getIrradianceAt(normals[i], new Vector3()).toArray();
  });
}

const { cases, lightProbe: light, probes } = await readKit(new RTGIProbeLoader(), read);
const hard = cases.find((expected) => expected.name === 'visibility');
const results = [];

// `ask` the probes for the irradiance at the points of `expected`, where the probes themselves are.
function check(label, expected, volumes, ask) {
  const { matrixWorld } = volumes;
  const points = expected.points.map((point) => new Vector3(...point).applyMatrix4(matrixWorld));
  const [normals, surfaceNormals] = [expected.normals, expected.surface_normals]
    .map((vectors) => vectors.map((vector) => new Vector3(...vector).transformDirection(matrixWorld)));
  results.push(compare(label, expected, ask(volumes, points, normals, surfaceNormals)));
}

cases.forEach((expected) => check(expected.name, expected, probes[expected.volumes], irradiance));
check(light.name, light, probes.kit, lightProbe);
probes.kit.position.set(-3, 5, 2);
probes.kit.setRotationFromEuler(new Euler(0.4, -1.1, 2.0));
probes.kit.scale.setScalar(1.7);
probes.kit.updateMatrixWorld();
check('visibility, moved', hard, probes.kit, irradiance);
check('light probe, moved', light, probes.kit, lightProbe);
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
