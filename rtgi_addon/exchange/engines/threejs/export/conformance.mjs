// Holds the loader's look-up on the CPU to RTGI's own numbers: `npm install`, then `node conformance.mjs`. Exit code 1 if it fails.

import { readFile } from 'node:fs/promises';
import { Euler, SphericalHarmonics3, Vector3 } from 'three';
import { compare, readKit, summary } from './conformance/compare.js';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';

async function read(name, type) {
  const content = await readFile(new URL(`conformance/${name}`, import.meta.url));
  return type === 'json' ? JSON.parse(content) : content.buffer.slice(content.byteOffset, content.byteOffset + content.byteLength);
}

const vectors = (rows) => rows.map((row) => new Vector3(...row));

function irradiance(probes, points, normals) {
  return points.map((point, i) => probes.irradiance(point, normals[i]).toArray());
}

// The light probe's way: coefficients at a point, then what three's shader makes of them.
function lightProbe(probes, points, normals) {
  return points.map((point, i) => {
    const sh = probes.radiance(point, new SphericalHarmonics3());
    return sh.getIrradianceAt(normals[i], new Vector3()).toArray();
  });
}

// What comes with a node that is moved, turned and scaled.
function moved(probes, points, normals) {
  probes.position.set(-3, 5, 2);
  probes.setRotationFromEuler(new Euler(0.4, -1.1, 2.0));
  probes.scale.setScalar(1.7);
  probes.updateMatrixWorld();
  return [points.map((point) => point.clone().applyMatrix4(probes.matrixWorld)),
    normals.map((normal) => normal.clone().transformDirection(probes.matrixWorld))];
}

const { cases, lightProbe: light, probes } = await readKit(new RTGIProbeLoader(), read);
const results = [];
for (const expected of cases) {
  const [points, normals] = [vectors(expected.points), vectors(expected.normals)];
  results.push(compare(expected.name, expected, irradiance(probes[expected.volumes], points, normals)));
}
const [points, normals] = [vectors(light.points), vectors(light.normals)];
results.push(compare(light.name, light, lightProbe(probes.kit, points, normals)));
const turned = moved(probes.kit, points, normals);
const hard = cases.find((expected) => expected.name === 'visibility');
results.push(compare('visibility, moved', hard, irradiance(probes.kit, ...turned)));
results.push(compare('light probe, moved', light, lightProbe(probes.kit, ...turned)));
results.forEach((result) => console.log(result.text));
console.log(summary(results));
process.exitCode = results.every((result) => result.passed) ? 0 : 1;
