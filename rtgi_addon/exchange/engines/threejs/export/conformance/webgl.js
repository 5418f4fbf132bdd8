// Holds the hook in three's own materials, on this machine's GPU, to RTGI's own numbers.

import * as THREE from 'three';
import { RTGILightProbe, RTGIProbeLoader } from '../rtgi/RTGIProbeVolumes.js';
import { compare, readKit, summary } from './compare.js';
import { draw, read } from './draw.js';
import { DECLARED, LIT } from '../rtgi/shader.js';
import { weights } from '../rtgi/weights.js';
import { device, readPixels, renderer } from './webgl_renderer.js';

const { cases, lightProbe, probes, spheres: hasSpheres, atlas: hasAtlas } = await readKit(new RTGIProbeLoader(), read);
const results = [];

function byLightProbe() {
  const light = new RTGILightProbe(probes.kit);
  return { lights: [light], moving: light };
}

async function check(label, expected, hooked, material, options) {
  hooked?.apply(material);
  results.push(compare(label, expected, await draw(renderer, readPixels, expected, material, options)));
  hooked?.release(material);
  material.dispose();
}

// The sphere probes, where there are any: the look-up that is spliced into materials, by itself.
async function mirrors() {
  const { RTGISpheres } = await import('../rtgi/RTGISpheres.js');
  for (const expected of (await read('spheres.json', 'json')).cases) {
    const file = expected.probes === 'kit' ? 'kit_spheres.json' : '../rtgi/spheres.json';
    const description = await read(file, 'json');
    const binary = file.slice(0, file.lastIndexOf('/') + 1) + description.data.file;
    const spheres = new RTGISpheres(description, await read(binary, 'arraybuffer'));
    results.push(compare(`${expected.name}, shader`, { irradiance: expected.radiance, tolerance: expected.tolerance },
      await lookUp(spheres, expected)));
    spheres.dispose();
    // Probes that reach nowhere change nothing in a material that reads them.
    probes.kit.addMirrors(new RTGISpheres({ ...description, table: description.table.map(() => 0) }, await read(binary, 'arraybuffer')));
    await check(`visibility, beside ${expected.name}`, hard, probes.kit, new THREE.MeshStandardMaterial());
    probes.kit.addMirrors(null);
  }
}

// Every point of `expected` as a pixel of a float target that the spliced functions are drawn to.
async function lookUp(spheres, expected) {
  const count = expected.points.length;
  const table = new THREE.DataTexture(Float32Array.from([...expected.points.flatMap((p, i) => [...p, expected.roughness[i]]),
    ...expected.directions.flatMap((d) => [...d, 0])]), count, 2, THREE.RGBAFormat, THREE.FloatType);
  table.needsUpdate = true;
  const shader = { fragmentShader: `${DECLARED}${LIT}`, uniforms: {} };
  spheres.splice(shader);
  const material = new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3, uniforms: { ...spheres.uniforms, table: { value: table } }, depthTest: false,
    vertexShader: 'in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `precision highp float;\nprecision highp int;\nuniform sampler2D table;\nout vec4 color;\n${weights}\n` +
      `${shader.fragmentShader.split('#if defined(RE_IndirectSpecular)')[0]}
void main() {
  int column = int(gl_FragCoord.x);
  vec4 place = texelFetch(table, ivec2(column, 0), 0);
  color = rtgi_spheres(place.xyz, texelFetch(table, ivec2(column, 1), 0).xyz, place.w * place.w);
}` });
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material), scene = new THREE.Scene();
  mesh.frustumCulled = false;
  scene.add(mesh);
  renderer.setRenderTarget(target);
  renderer.render(scene, new THREE.Camera());
  const pixels = await readPixels(target);
  [target, material, mesh.geometry, table].forEach((part) => part.dispose());
  return expected.points.map((_, i) => [...pixels.subarray(4 * i, 4 * i + 4)]);
}

for (const expected of cases) {
  await check(expected.name, expected, probes[expected.volumes], new THREE.MeshStandardMaterial());
}
const hard = cases.find((expected) => expected.name === 'visibility');
for (const type of ['MeshPhysicalMaterial', 'MeshLambertMaterial', 'MeshPhongMaterial', 'MeshToonMaterial']) {
  await check(`visibility, ${type}`, hard, probes.kit, new THREE[type]());
}
await check('visibility, instanced', hard, probes.kit, new THREE.MeshLambertMaterial(), { instanced: true });
const sheet = new THREE.MeshStandardMaterial({ side: THREE.DoubleSide });
await check('visibility, from behind', hard, probes.kit, sheet, { behind: true });
await check('light probe', lightProbe, null, new THREE.MeshLambertMaterial(), byLightProbe());
// Light probes are for objects without the hook: with it they must not add to the light.
await check('visibility, beside a light probe', hard, probes.kit, new THREE.MeshStandardMaterial(), byLightProbe());

if (hasSpheres) {
  await mirrors();
}
if (hasAtlas) {
  const { checkAtlas } = await import('./webgl_atlas.js');
  results.push(...await checkAtlas(renderer, readPixels, probes.kit));
}

probes.kit.position.set(-3, 5, 2);
probes.kit.rotation.set(0.4, -1.1, 2.0);
probes.kit.scale.setScalar(1.7);
probes.kit.updateMatrixWorld();
const place = probes.kit.matrixWorld;
await check('visibility, moved', hard, probes.kit, new THREE.MeshStandardMaterial(), { place });
await check('light probe, moved', lightProbe, null, new THREE.MeshLambertMaterial(), { place, ...byLightProbe() });
Object.values(probes).forEach((volumes) => volumes.dispose());

window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
