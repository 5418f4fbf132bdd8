// What the style promises beyond its shaders: `EXPORT=folder node --test style.test.mjs`, in a folder where `three` resolves.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import test from 'node:test';
import { pathToFileURL } from 'node:url';

const folder = pathToFileURL(`${process.env.EXPORT}/`);
const { RTGIStyle, RTGIStyleView } = await import(new URL('rtgi/RTGIStyle.js', folder));
const { RTGIProbeLoader } = await import(new URL('rtgi/RTGIProbeVolumes.js', folder));
const { compareLines, stillLife } = await import(new URL('conformance/style.js', folder));
const THREE = await import(new URL('node_modules/three/build/three.module.js', folder));
const read = async (name) => JSON.parse(await readFile(new URL(name, folder)));
const description = await read('rtgi/style.json'), expected = await read('conformance/style_picture.json');
const style = () => new RTGIStyle(description, new THREE.Texture());

test('refuses another format', () => {
  assert.throws(() => new RTGIStyle({ ...description, format: 'x/1' }, new THREE.Texture()), /the style is x\/1 instead of/);
});

test('styles lit materials over the probes, and gives each back as it was', async () => {
  const file = await readFile(new URL('rtgi/probes.bin', folder));
  const buffer = file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength);
  const probes = new RTGIProbeLoader().parse(await read('rtgi/probes.json'), buffer);
  const material = new THREE.MeshStandardMaterial(), unlit = new THREE.MeshBasicMaterial(), one = style();
  const group = new THREE.Group().add(new THREE.Mesh(new THREE.BufferGeometry(), [material, unlit]));
  probes.apply(group);
  const lit = material.customProgramCacheKey();
  one.apply(group).apply(material);
  assert.ok(material.customProgramCacheKey().includes(lit) && material.customProgramCacheKey() !== lit);
  const shader = { uniforms: {}, ...THREE.ShaderLib.physical };
  material.onBeforeCompile(shader, { capabilities: { maxTextureSize: 4096 } });
  assert.equal(shader.fragmentShader.match(/vec3 rtgi_styled_light/g).length, 1);
  assert.ok(shader.fragmentShader.includes('vec3 rtgiIrradiance') && shader.uniforms.style_key === one.uniforms.style_key);
  assert.ok(shader.fragmentShader.indexOf('rtgi_styled_light(rtgiDirect') > shader.fragmentShader.indexOf('rtgiIntensity * rtgi'));
  one.release(group);
  assert.equal(material.customProgramCacheKey(), lit);
  probes.release(group);
  assert.ok(!Object.hasOwn(material, 'onBeforeCompile') && !Object.hasOwn(unlit, 'onBeforeCompile'));
});

test('says which part of a changed shader is missing', () => {
  const material = new THREE.MeshLambertMaterial({ name: 'Wall' });
  style().apply(material);
  const shader = { uniforms: {}, ...THREE.ShaderLib.lambert };
  shader.fragmentShader = shader.fragmentShader.replace('#include <aomap_fragment>', '');
  assert.throws(() => material.onBeforeCompile(shader, {}), /material "Wall" has no #include <aomap_fragment>/);
});

test('draws surfaces without what is transparent, and leaves scene and renderer as they were', () => {
  const view = new RTGIStyleView(style()), { scene, camera } = stillLife(expected);
  const [first] = scene.children, glass = new THREE.Mesh(first.geometry, new THREE.MeshBasicMaterial({ transparent: true }));
  const copies = new THREE.InstancedMesh(first.geometry, new THREE.MeshBasicMaterial(), 3), dots = new THREE.Points();
  scene.add(glass, copies, dots, new THREE.Mesh(first.geometry, first.material));
  scene.background = new THREE.Color(0xff0000);
  const drawn = [];
  const renderer = {
    target: null, shadowMap: { autoUpdate: true }, alpha: 0.5,
    getRenderTarget() { return this.target; }, setRenderTarget(target) { this.target = target; },
    getDrawingBufferSize: (size) => size.set(32, 24), getClearColor: (color) => color.set(0x123456), getClearAlpha() { return this.alpha; },
    setClearColor(color, alpha) { this.alpha = alpha; }, clear() {},
    render(what) {
      const { overrideMaterial } = what;
      drawn.push([this.target, what.background, overrideMaterial, glass.layers.mask, dots.layers.mask, this.alpha]);
      for (const object of overrideMaterial ? what.children.filter((child) => child.layers.mask) : []) {
        overrideMaterial.onBeforeRender(this, what, camera, object.geometry, object, null);
        numbers.push([overrideMaterial.uniforms.rtgiObject.value, overrideMaterial.uniforms.rtgiMaterial.value, overrideMaterial.side]);
      }
    },
  };
  const numbers = [];
  view.render(renderer, scene, camera);
  assert.deepEqual(drawn.map(([target]) => target), [view.picture, view.surfaces, null]);
  assert.deepEqual(drawn[1].slice(1), [null, view.surfaceMaterial, 0, 0, 0]);
  assert.equal(view.surfaces.width, 32);
  // Four boxes of a material each, three copies of one, and an object of a material that is there already.
  assert.deepEqual(numbers.map(([object]) => object), [0, 1, 2, 3, 4, 7]);
  assert.deepEqual(numbers.map(([, material]) => material), [0, 1, 2, 3, 4, 0]);
  assert.equal(numbers[0][2], THREE.DoubleSide);
  assert.ok(scene.background.isColor && scene.overrideMaterial === null && glass.layers.mask === 1 && renderer.alpha === 0.5);
  assert.ok(renderer.shadowMap.autoUpdate && !view.material.uniforms.parallel.value);
});

test('compares lines as it says', () => {
  const [width, height] = expected.size, pixels = new Float32Array(4 * width * height);
  expected.coverage.forEach((value, index) => {
    pixels[4 * ((height - 1 - Math.floor(index / width)) * width + index % width)] = 1 - value / 255;
  });
  assert.match(compareLines(expected, pixels).text, /^pass  lines: 0 of/);
  assert.ok(!compareLines(expected, pixels.fill(1)).passed);
});

test('the still life is where its camera looks', () => {
  const { scene, camera } = stillLife(expected);
  camera.updateProjectionMatrix();
  const place = new THREE.Vector3();
  scene.children.forEach(({ geometry }) => {
    geometry.computeBoundingBox();
    geometry.boundingBox.getCenter(place).project(camera);
    assert.ok(Math.abs(place.x) < 0.8 && Math.abs(place.y) < 0.8 && Math.abs(place.z) < 1);
  });
});
