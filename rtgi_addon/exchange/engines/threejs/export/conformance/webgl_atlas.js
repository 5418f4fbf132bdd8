// Holds the light atlas to RTGI's own numbers: the look-up that is spliced into materials, by itself, and a material of three's.

import * as THREE from 'three';
import { RTGIAtlas } from '../rtgi/RTGIAtlas.js';
import { compare } from './compare.js';
import { read } from './draw.js';

// Results of every case; `readPixels` as in webgl.js, `probes` light what is beside the atlas.
export async function checkAtlas(renderer, readPixels, probes) {
  const results = [];
  for (const expected of (await read('atlas.json', 'json')).cases) {
    const file = expected.atlas === 'kit' ? 'kit_atlas.json' : '../rtgi/atlas.json';
    const description = await read(file, 'json');
    const atlas = new RTGIAtlas(description, await read(file.slice(0, file.lastIndexOf('/') + 1) + description.data.file,
      'arraybuffer'));
    results.push(compare(`${expected.name}, shader`, expected, await lookUp(renderer, readPixels, atlas, expected)));
    results.push(compare(`${expected.name}, material`, ...await material(renderer, readPixels, atlas, expected, probes)));
    atlas.dispose();
  }
  return results;
}

async function pixels(renderer, readPixels, mesh, camera, count) {
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false }), scene = new THREE.Scene();
  mesh.frustumCulled = false;
  scene.add(mesh);
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const found = await readPixels(target);
  renderer.setRenderTarget(null);
  target.dispose();
  return Array.from({ length: count }, (_, i) => [...found.subarray(4 * i, 4 * i + 3)]);
}

// Every point as a pixel of a float target that the functions are drawn to.
export async function lookUp(renderer, readPixels, atlas, expected) {
  const count = expected.st.length, place = (i) => {
    const { scale, offset } = atlas.parts.get(expected.parts[i]);
    return expected.st[i].map((value, axis) => value * scale + offset[axis]);
  };
  const table = new THREE.DataTexture(Float32Array.from([...expected.st.flatMap((_, i) => [...place(i), 0, 0]),
    ...expected.normals.flatMap((normal) => [...normal, 0])]), count, 2, THREE.RGBAFormat, THREE.FloatType);
  table.needsUpdate = true;
  const material = new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3, uniforms: { ...atlas.uniforms, table: { value: table } }, depthTest: false,
    vertexShader: 'in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `precision highp float;\nprecision highp int;\nuniform sampler2D table;\nout vec4 color;\n${
      atlas.declared.replace(/^varying.*$/m, '')}
void main() {
  int column = int(gl_FragCoord.x);
  color = vec4(rtgi_atlas_irradiance(texelFetch(table, ivec2(column, 0), 0).xy, texelFetch(table, ivec2(column, 1), 0).xyz), 1.0);
}` });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
  const found = await pixels(renderer, readPixels, mesh, new THREE.Camera(), count);
  [material, mesh.geometry, table].forEach((part) => part.dispose());
  return found;
}

// The points of the first part as pixels of a strip with a white material, lit by the probes' hook: irradiance over pi.
async function material(renderer, readPixels, atlas, expected, probes) {
  const name = expected.parts[0], rows = expected.parts.flatMap((part, i) => (part === name ? [i] : []));
  const { texcoord } = atlas.parts.get(name), corners = [[0, -1], [1, -1], [1, 1], [0, -1], [1, 1], [0, 1]];
  const geometry = new THREE.BufferGeometry(), count = rows.length;
  const fill = (key, size, value) => geometry.setAttribute(key, new THREE.Float32BufferAttribute(
    rows.flatMap((row, column) => corners.flatMap((corner) => value(row, column, corner))), size));
  fill('position', 3, (row, column, [across, up]) => [2 * (column + across) / count - 1, up, -0.5]);
  fill('normal', 3, (row) => expected.normals[row]);
  fill(texcoord === 0 ? 'uv' : `uv${texcoord}`, 2, (row) => expected.st[row]);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ side: THREE.FrontSide }));
  mesh.name = name;
  probes.addAtlas(atlas).apply(mesh);
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
  const found = (await pixels(renderer, readPixels, mesh, camera, count)).map((color) => color.map((value) => value * Math.PI));
  probes.release(mesh).addAtlas(null);
  [geometry, mesh.material].flat().forEach((part) => part.dispose());
  // Materials compute in half-way precision of three's own.
  return [{ irradiance: rows.map((row) => expected.irradiance[row]), tolerance: rows.map((row) => expected.tolerance[row]) }, found, 4];
}
