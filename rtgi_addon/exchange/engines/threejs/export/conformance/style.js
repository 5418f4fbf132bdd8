// Holds the lines of three.js, on this machine's GPU, to those of RTGI's own effect: a still life, pixel by pixel.

import * as THREE from 'three';
import { RTGIStyleView, loadStyle } from '../rtgi/RTGIStyle.js';
import { read } from './draw.js';

// Coverage that differs by more is wrong, and so large a share of the pixels that have or should have lines may be: rasterization has
// its own mind of pixels on an edge.
const OFF = 0.25, MOST = 0.05;

// The scene and the camera of a style_picture.json.
export function stillLife({ objects, triangles, camera: place, size }) {
  const scene = new THREE.Scene();
  const each = triangles.length / objects;
  for (let number = 0; number < objects; number++) {
    const geometry = new THREE.BufferGeometry();
    const corners = new Float32Array(triangles.slice(number * each, (number + 1) * each));
    geometry.setAttribute('position', new THREE.BufferAttribute(corners, 3));
    geometry.computeVertexNormals();
    scene.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide })));
  }
  const camera = new THREE.PerspectiveCamera(place.fov, size[0] / size[1], place.near, place.far);
  const axes = [place.x, place.y, place.z].map((axis) => new THREE.Vector3(...axis));
  camera.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...axes));
  camera.position.set(...place.origin);
  camera.updateMatrixWorld();
  return { scene, camera };
}

// How the coverage of lines in `pixels` (RGBA, rows from the bottom, black on white) fits the case's.
export function compareLines({ coverage, size: [width, height] }, pixels) {
  let wrong = 0, concerned = 0, found = 0, expected = 0;
  coverage.forEach((value, index) => {
    const row = height - 1 - Math.floor(index / width), here = 1 - pixels[4 * (row * width + index % width)];
    found += here;
    expected += value / 255;
    concerned += here > OFF || value / 255 > OFF;
    wrong += Math.abs(here - value / 255) > OFF;
  });
  const passed = expected > 100 && wrong <= MOST * concerned;
  return { passed, text: `${passed ? 'pass' : 'FAIL'}  lines: ${wrong} of ${concerned} pixels off by more than ${OFF}, lines cover ` +
    `${found.toFixed(0)} pixels of ${expected.toFixed(0)}` };
}

if (globalThis.document) {
  const expected = await read('style_picture.json', 'json');
  const view = new RTGIStyleView(await loadStyle(new URL('style/style.json', import.meta.url)));
  const renderer = new THREE.WebGLRenderer();
  // Errors in shaders end in the console alone otherwise.
  renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
    throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(vertex)} ${gl.getShaderInfoLog(fragment)}`);
  };
  const [width, height] = expected.size;
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  const { scene, camera } = stillLife(expected);
  renderer.setRenderTarget(target);
  view.render(renderer, scene, camera);
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  const { passed, text } = compareLines(expected, pixels);
  window.show(`three r${THREE.REVISION}\n${text}\n${passed ? 'PASSED' : 'FAILED'}`);
}
