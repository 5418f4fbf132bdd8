// What both pages share: the kit over HTTP, and every point of it as one pixel of a white surface that faces the point's surface
// normal and has a normal map of the other one, drawn with three's own materials into a float target: what comes back is irradiance
// over pi.

import * as THREE from 'three';

const FORWARD = new THREE.Vector3(0, 0, 1), BACKWARD = new THREE.Vector3(0, 0, -1);

export async function read(name, type) {
  const response = await fetch(new URL(name, import.meta.url));
  if (!response.ok) {
    throw new Error(`${name}: ${response.status} ${response.statusText}`);
  }
  return type === 'json' ? response.json() : response.arrayBuffer();
}

// A square around the origin that faces z, by itself or as the second of two instances.
function square(material, instanced) {
  const geometry = new THREE.PlaneGeometry(1, 1);
  if (!instanced) {
    return new THREE.Mesh(geometry, material);
  }
  const mesh = new THREE.InstancedMesh(geometry, material, 2);
  mesh.frustumCulled = false;
  mesh.setMatrixAt(0, new THREE.Matrix4().makeTranslation(0, 0, -1e4));
  mesh.setMatrixAt(1, new THREE.Matrix4());
  return mesh;
}

// Irradiance at every point of `expected`, as a surface of `material` shows it. `readPixels(target)` brings the float32 pixels of a
// target back; the options are `place`, a matrix for points and normals, `lights` of the scene, one of them `moving` to the points,
// whether the surface is `instanced` or seen from `behind`, and whether three then turns the normals of its map (`mapTurns`).
export async function draw(renderer, readPixels, expected, material, options = {}) {
  const { place = new THREE.Matrix4(), lights = [], moving = null, instanced = false, behind = false, mapTurns = true } = options;
  const count = expected.points.length;
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false });
  const scene = new THREE.Scene();
  const mesh = square(material, instanced);
  const camera = new THREE.OrthographicCamera(-0.4, 0.4, 0.4, -0.4, 0.1, 2);
  scene.add(mesh, ...lights);
  renderer.autoClear = false;
  const texel = new Float32Array([0.5, 0.5, 1, 1]);
  material.normalMap = new THREE.DataTexture(texel, 1, 1, THREE.RGBAFormat, THREE.FloatType);
  material.normalMapType = THREE.ObjectSpaceNormalMap;
  const point = new THREE.Vector3(), surfaceNormal = new THREE.Vector3(), normal = new THREE.Vector3();
  const turnBack = new THREE.Quaternion();
  for (let i = 0; i < count; i++) {
    point.fromArray(expected.points[i]).applyMatrix4(place);
    surfaceNormal.fromArray(expected.surface_normals[i]).transformDirection(place);
    normal.fromArray(expected.normals[i]).transformDirection(place);
    mesh.position.copy(point);
    mesh.quaternion.setFromUnitVectors(behind ? BACKWARD : FORWARD, surfaceNormal);
    camera.position.copy(point).add(surfaceNormal);
    camera.quaternion.setFromUnitVectors(FORWARD, surfaceNormal);
    normal.applyQuaternion(turnBack.copy(mesh.quaternion).invert()).multiplyScalar(behind && mapTurns ? -0.5 : 0.5).addScalar(0.5);
    normal.toArray(texel);
    material.normalMap.needsUpdate = true;
    if (moving) {
      // WebGPURenderer looks at light probes once a frame.
      await new Promise(requestAnimationFrame);
      moving.update(point);
    }
    target.viewport.set(i, 0, 1, 1);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
  }
  const pixels = await readPixels(target);
  target.dispose();
  mesh.geometry.dispose();
  material.normalMap.dispose();
  return expected.points.map((_, i) => [...pixels.subarray(4 * i, 4 * i + 3)].map((value) => Math.PI * value));
}
