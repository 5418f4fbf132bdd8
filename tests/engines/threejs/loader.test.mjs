// What the loader promises beyond its numbers: `EXPORT=folder node --test loader.test.mjs`, in a folder where `three` resolves.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import test from 'node:test';
import { pathToFileURL } from 'node:url';

// Three's FileLoader reports its progress with an event that only browsers have.
globalThis.ProgressEvent ??= class extends Event {};
const folder = pathToFileURL(`${process.env.EXPORT}/`);
const { RTGILightProbe, RTGIProbeLoader } = await import(new URL('rtgi/RTGIProbeVolumes.js', folder));
const THREE = await import(new URL('node_modules/three/build/three.module.js', folder));

const description = JSON.parse(await readFile(new URL('rtgi/probes.json', folder)));
const file = await readFile(new URL('rtgi/probes.bin', folder));
const buffer = file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength);
const parse = (changes = {}, content = buffer) => new RTGIProbeLoader().parse({ ...description, ...changes }, content);

// What three hands to onBeforeCompile for a material of `type`.
function shaderOf(type) {
  const { vertexShader, fragmentShader } = THREE.ShaderLib[type];
  return { uniforms: {}, vertexShader, fragmentShader };
}

const renderer = { capabilities: { maxTextureSize: 4096 } };

test('loads over HTTP from the folder of the .json', async () => {
  const server = createServer(async (request, response) => {
    try {
      response.end(await readFile(new URL(`.${request.url.split('/deep')[1]}`, folder)));
    } catch {
      response.writeHead(404).end();
    }
  }).listen(0, '127.0.0.1');
  await new Promise((resolve) => server.once('listening', resolve));
  const root = `http://127.0.0.1:${server.address().port}/deep/`;
  try {
    const probes = await new RTGIProbeLoader().loadAsync(`${root}rtgi/probes.json`);
    assert.equal(probes.volumes.length, description.volumes.length);
    assert.equal((await new RTGIProbeLoader().setPath(root).loadAsync('rtgi/probes.json')).name, description.scene);
    await assert.rejects(new RTGIProbeLoader().loadAsync(`${root}missing.json`), /missing\.json could not be read.*404/s);
  } finally {
    server.close();
    server.closeAllConnections();
  }
});

test('knows which lamps of the glTF are in the probes', () => {
  const lamp = (name) => Object.assign(new THREE.PointLight(), { name: name.replace('.', ''), userData: { name } });
  const probes = parse({ includesDirect: true, lamps: { 'Key.001': 'all', Fill: 'bounces' }, objects: { Door: 'dynamic' } });
  assert.ok(probes.holdsDirect(lamp('Key.001')) && !probes.holdsDirect(lamp('Fill')) && !probes.holdsDirect(lamp('Another')));
  assert.equal(probes.objects.Door, 'dynamic');
  assert.ok(parse({ includesDirect: true, lamps: undefined }).holdsDirect(lamp('Any')));
  assert.ok(!parse({ includesDirect: false, lamps: {} }).holdsDirect(lamp('Any')));
});

test('refuses what does not belong together, saying why', () => {
  assert.throws(() => parse({}, buffer.slice(2)), /probes\.bin holds \d+ bytes, its \.json says \d+/);
  assert.throws(() => parse({ format: 'rtgi-three/9' }), /"rtgi-three\/9".*this loader reads "rtgi-three\/1"/);
  assert.throws(() => new RTGIProbeLoader().parse({}, buffer), /is of format undefined/);
  const volumes = Array(17).fill(description.volumes[0]);
  assert.throws(() => parse({ volumes }), /17 volumes are more than the 16/);
});

test('lights every lit material below an object, and gives each back as it was', () => {
  const probes = parse();
  const lit = [new THREE.MeshStandardMaterial(), new THREE.MeshToonMaterial()], unlit = new THREE.MeshBasicMaterial();
  const group = new THREE.Group().add(new THREE.Mesh(new THREE.BufferGeometry(), [lit[0], unlit]),
    new THREE.Mesh(new THREE.BufferGeometry(), lit[1]), new THREE.Object3D());
  const before = lit.map((material) => [material.version, material.customProgramCacheKey()]);
  assert.equal(probes.apply(group), probes);
  lit.forEach((material, i) => {
    assert.ok(material.version > before[i][0] && material.customProgramCacheKey() !== before[i][1]);
  });
  assert.ok(!Object.hasOwn(unlit, 'onBeforeCompile'));
  probes.release(group);
  lit.forEach((material, i) => {
    assert.ok(!Object.hasOwn(material, 'onBeforeCompile') && !Object.hasOwn(material, 'customProgramCacheKey'));
    assert.equal(material.customProgramCacheKey(), before[i][1]);
  });
});

test('refuses a material that has no light', () => {
  const material = new THREE.MeshBasicMaterial({ name: 'Sign' });
  assert.throws(() => parse().apply(material), /MeshBasicMaterial "Sign" cannot be lit by probes/);
});

test('keeps the hooks that a material has already', () => {
  const probes = parse(), material = new THREE.MeshLambertMaterial(), calls = [];
  const own = (shader) => { calls.push('own'); shader.fragmentShader += '// own'; };
  material.onBeforeCompile = own;
  const ownKey = material.customProgramCacheKey();
  probes.apply(material).apply(material);
  const shader = shaderOf('lambert');
  material.onBeforeCompile(shader, renderer);
  assert.deepEqual(calls, ['own']);
  assert.equal(shader.fragmentShader.match(/vec3 rtgiIrradiance/g).length, 1);
  assert.ok(shader.fragmentShader.endsWith('// own') && shader.uniforms.rtgiProbes === probes.uniforms.rtgiProbes);
  assert.ok(material.customProgramCacheKey().includes(ownKey));
  probes.dispose();
  assert.equal(material.onBeforeCompile, own);
});

test('hands a material over from one bake to another', () => {
  const [first, second] = [parse(), parse()], material = new THREE.MeshPhongMaterial();
  second.apply(first.apply(material) && material);
  first.dispose();
  const shader = shaderOf('phong');
  material.onBeforeCompile(shader, renderer);
  assert.equal(shader.uniforms.rtgiProbes, second.uniforms.rtgiProbes);
  second.dispose();
  assert.ok(!Object.hasOwn(material, 'onBeforeCompile'));
});

test('says which part of a changed shader is missing, and which device is too small', () => {
  const material = new THREE.MeshLambertMaterial({ name: 'Wall' });
  parse().apply(material);
  const shader = shaderOf('lambert');
  shader.fragmentShader = shader.fragmentShader.replace('#include <lights_fragment_maps>', '');
  assert.throws(() => material.onBeforeCompile(shader, renderer), /material "Wall" has no #include <lights_fragment_maps>/);
  const small = { capabilities: { maxTextureSize: 8 } };
  assert.throws(() => material.onBeforeCompile(shaderOf('lambert'), small), /this device takes 8 at most/);
});

test('visits every probe where it is', () => {
  const probes = parse();
  probes.position.set(1, 2, 3);
  probes.updateMatrixWorld();
  const seen = probes.volumes.map(() => 0);
  let dead = 0;
  const known = description.volumes.findIndex(({ name }) => name === 'Known'), first = [];
  probes.forEachProbe((position, live, volume) => {
    seen[volume]++;
    dead += !live;
    if (volume === known) {
      first.push(position.toArray());
    }
  });
  assert.deepEqual(seen, probes.volumes.map(({ count }) => count));
  assert.ok(dead > 0);
  // Blender's (-1.5, -0.5, -0.5), the first of 4 x 2 x 2 samples in a box of 4 x 2 x 2 m, is (-1.5, -0.5, 0.5) with Y up.
  first[0].forEach((value, axis) => assert.ok(Math.abs(value - [-0.5, 1.5, 3.5][axis]) < 1e-6));
});

test('scales all light by its intensity', () => {
  const probes = parse(), point = new THREE.Vector3(), up = new THREE.Vector3(0, 1, 0);
  const one = probes.irradiance(point, up), light = new RTGILightProbe(probes, 2).update(point);
  const before = light.sh.clone();
  probes.intensity = 0.5;
  assert.deepEqual(probes.irradiance(point, up).toArray(), one.clone().multiplyScalar(0.5).toArray());
  light.update(point);
  light.sh.coefficients.forEach((c, i) => assert.ok(c.distanceTo(before.coefficients[i].multiplyScalar(0.5)) < 1e-9));
  assert.equal(light.intensity, 2);
});

test('goes along when a scene is cloned', () => {
  const probes = parse(), scene = new THREE.Scene(), light = new RTGILightProbe(probes, 2).update(new THREE.Vector3());
  probes.position.set(1, 2, 3);
  probes.intensity = 0.5;
  const [copy, lightCopy] = scene.add(probes, light).clone().children;
  const point = new THREE.Vector3(1, 2, 3), up = new THREE.Vector3(0, 1, 0);
  [probes, copy].forEach((each) => each.updateMatrixWorld());
  assert.deepEqual(copy.irradiance(point, up).toArray(), probes.irradiance(point, up).toArray());
  assert.ok(copy !== probes && copy.uniforms.rtgiProbes.value !== probes.uniforms.rtgiProbes.value);
  assert.ok(lightCopy.probes === probes && lightCopy.intensity === 2 && lightCopy.sh.equals(light.sh));
});
