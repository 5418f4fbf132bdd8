// Holds cones through voxels on this machine's GPU to RTGI's own numbers: the functions by themselves, and a material of three's.

import * as THREE from 'three';
import { RTGIVoxels } from '../rtgi/RTGIVoxels.js';
import { compare, summary } from './compare.js';
import { draw, read } from './draw.js';
import { device, readPixels, renderer } from './webgl_renderer.js';

// Every point as a pixel of a float target that the functions are drawn to.
async function lookUp(voxels, { points, normals }) {
  const count = points.length, table = new THREE.DataTexture(Float32Array.from([...points.flatMap((row) => [...row, 0]),
    ...normals.flatMap((row) => [...row, 0])]), count, 2, THREE.RGBAFormat, THREE.FloatType);
  table.needsUpdate = true;
  const material = new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3, uniforms: { ...voxels.uniforms, table: { value: table } }, depthTest: false,
    vertexShader: 'in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `precision highp float;\nprecision highp int;\nuniform sampler2D table;\nout vec4 color;\n${voxels.declared}
void main() {
  int column = int(gl_FragCoord.x);
  color = vec4(rtgi_voxels_irradiance(texelFetch(table, ivec2(column, 0), 0).xyz, texelFetch(table, ivec2(column, 1), 0).xyz), 1.0);
}` });
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material), scene = new THREE.Scene();
  mesh.frustumCulled = false;
  scene.add(mesh);
  renderer.setRenderTarget(target);
  renderer.render(scene, new THREE.Camera());
  const found = await readPixels(target);
  renderer.setRenderTarget(null);
  [target, material, mesh.geometry, table].forEach((part) => part.dispose());
  return Array.from({ length: count }, (_, i) => [...found.subarray(4 * i, 4 * i + 3)]);
}

const results = [];
for (const expected of (await read('voxels.json', 'json')).cases) {
  const file = expected.voxels === 'kit' ? 'kit_voxels.json' : '../rtgi/voxels.json', description = await read(file, 'json');
  const voxels = new RTGIVoxels(description, await read(file.slice(0, file.lastIndexOf('/') + 1) + description.data.file,
    'arraybuffer'));
  results.push(compare(`${expected.name}, shader`, expected, await lookUp(voxels, expected)));
  const material = new THREE.MeshLambertMaterial();
  voxels.apply(material);
  results.push(compare(`${expected.name}, material`, expected,
    await draw(renderer, readPixels, { ...expected, surface_normals: expected.normals }, material), 2));
  material.dispose();
  voxels.dispose();
}
window.show([`three r${THREE.REVISION} on ${device}`, ...results.map((result) => result.text), summary(results)].join('\n'));
