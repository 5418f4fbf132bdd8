// The model of this export, if it has one, in the light of its probes; else white balls where the probes are, over a floor.

import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';

const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.shadowMap.enabled = true;
renderer.toneMapping = THREE.AgXToneMapping;
document.body.append(renderer.domElement);
const scene = new THREE.Scene();

const demo = await (await fetch('demo.json')).json();
const probes = await new RTGIProbeLoader().loadAsync('rtgi/probes.json');
const gltf = demo.model ? await new GLTFLoader().loadAsync(demo.model) : null;
scene.add(probes);
if (demo.spheres) {
  const { loadSpheres } = await import('./rtgi/RTGISpheres.js');
  probes.addMirrors(await loadSpheres(demo.spheres));
}
if (demo.atlas) {
  const { loadAtlas } = await import('./rtgi/RTGIAtlas.js');
  probes.addAtlas(await loadAtlas(demo.atlas));
}
let view = null;
if (demo.media) {
  const { RTGIMediaView, loadMedia } = await import('./rtgi/RTGIMedia.js');
  view = new RTGIMediaView(await loadMedia(demo.media));
}
let style = null, styleView = null;
if (demo.style) {
  const { RTGIStyleView, loadStyle } = await import('./rtgi/RTGIStyle.js');
  style = await loadStyle(demo.style);
  styleView = new RTGIStyleView(style);
}
if (demo.sky) {
  // Behind the model alone: the probes hold its light.
  scene.background = await new EXRLoader().loadAsync(demo.sky);
  scene.background.mapping = THREE.EquirectangularReflectionMapping;
  scene.backgroundIntensity = demo.skyScale;
}

let relight = null;
if (demo.relight) {
  const { loadRelight } = await import('./rtgi/RTGIRelight.js');
  relight = await loadRelight(demo.relight, probes);
}

const bounds = new THREE.Box3();
const cellSizes = [];
for (const { worldFromLocal, resolution } of probes.volumes) {
  const matrix = new THREE.Matrix4().fromArray(worldFromLocal);
  const size = new THREE.Vector3().setFromMatrixScale(matrix);
  bounds.union(new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1)).applyMatrix4(matrix));
  cellSizes.push(Math.min(...resolution.map((count, axis) => 2 * size.getComponent(axis) / count)));
}

// One ball for each probe that holds light, in the light at its own surface.
function makeBalls() {
  const places = [];
  probes.forEachProbe((position, live, volume) => {
    if (live) {
      places.push(new THREE.Matrix4().makeScale(...Array(3).fill(0.12 * cellSizes[volume])).setPosition(position));
    }
  });
  const balls = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 24, 16), new THREE.MeshLambertMaterial(), places.length);
  places.forEach((matrix, i) => balls.setMatrixAt(i, matrix));
  return balls;
}

function makeFloor() {
  const size = bounds.getSize(new THREE.Vector3());
  const floor = new THREE.Mesh(new THREE.PlaneGeometry(1.2 * size.x, 1.2 * size.z).rotateX(-Math.PI / 2),
    new THREE.MeshLambertMaterial({ color: 0xbbbbbb, side: THREE.DoubleSide }));
  return floor.translateY(bounds.min.y).translateX((bounds.min.x + bounds.max.x) / 2).translateZ((bounds.min.z + bounds.max.z) / 2);
}

// Lamps of the model: already in the probes, or ours to draw, with shadows.
function prepareLamp(light, radius) {
  light.visible = !probes.holdsDirect(light);
  light.castShadow = Boolean(light.shadow);
  if (light.isDirectionalLight) {
    const centre = bounds.getCenter(new THREE.Vector3());
    const towards = light.target.getWorldPosition(new THREE.Vector3());
    const direction = light.getWorldPosition(new THREE.Vector3()).sub(towards).normalize();
    light.shadow.camera = new THREE.OrthographicCamera(-radius, radius, radius, -radius, 0, 4 * radius);
    light.position.copy(light.parent.worldToLocal(direction.multiplyScalar(2 * radius).add(centre)));
    light.updateMatrixWorld();
    // The loader makes the target a child of the lamp.
    light.target.position.copy(light.target.parent.worldToLocal(centre));
  }
  if (light.shadow) {
    light.shadow.mapSize.set(2048, 2048);
    light.shadow.normalBias = 0.01 * radius;
  }
}

const balls = makeBalls();
balls.visible = !gltf;
scene.add(balls);
if (gltf) {
  scene.add(gltf.scene);
  bounds.setFromObject(gltf.scene);
  gltf.scene.updateMatrixWorld(true);
  const radius = bounds.getBoundingSphere(new THREE.Sphere()).radius;
  gltf.scene.traverse((object) => {
    object.castShadow = object.receiveShadow = Boolean(object.isMesh);
    if (object.isLight) {
      prepareLamp(object, radius);
    }
  });
} else {
  scene.add(makeFloor());
}
probes.apply(scene);
style?.apply(scene);

// The model's own camera, else one that sees all.
const camera = new THREE.PerspectiveCamera(45, 1);
const sphere = bounds.getBoundingSphere(new THREE.Sphere());
const target = sphere.center.clone();
const given = gltf?.cameras.find((other) => other.isPerspectiveCamera) ?? camera.clone();
if (given.parent) {
  given.matrixWorld.decompose(camera.position, camera.quaternion, new THREE.Vector3());
  const forward = new THREE.Vector3(0, 0, -1).applyQuaternion(camera.quaternion);
  const depth = sphere.center.clone().sub(camera.position).dot(forward);
  target.copy(camera.position).addScaledVector(forward, Math.max(depth, 0.1 * sphere.radius));
} else {
  camera.position.copy(target).add(new THREE.Vector3(1, 0.6, 1.6).setLength(2.6 * sphere.radius));
}
camera.near = sphere.radius / 200;
camera.far = 20 * sphere.radius;
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.copy(target);
controls.update();

// An exposure that shows a surface of medium reflectance, in the probes' average light, as medium grey; where lamps add theirs,
// a stop less.
function exposureStops() {
  const sh = new THREE.SphericalHarmonics3(), light = new THREE.Color();
  let sum = 0, count = 0;
  probes.forEachProbe((position, live) => {
    if (live && count < 256) {
      probes.radiance(position, sh);
      light.setRGB(...sh.coefficients[0].toArray());
      sum += 0.2820948 * (0.2126 * light.r + 0.7152 * light.g + 0.0722 * light.b);
      count++;
    }
  });
  return sum > 0 ? Math.log2((probes.includesDirect || !gltf ? 0.6 : 0.3) * count / sum) : 0;
}

// Frames are drawn when something changed.
let waiting = false;
function draw() {
  if (!waiting) {
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const followed = relight?.update(renderer) ?? true;
      const plain = () => view ? view.render(renderer, scene, camera) : renderer.render(scene, camera);
      styleView ? styleView.render(renderer, scene, camera, plain) : plain();
      document.documentElement.dataset.state = 'ready';
      if (!followed) {
        draw();
      }
    });
  }
}

const form = document.querySelector('form');
const { exposure, intensity, balls: showBalls } = form.elements;
exposure.value = exposureStops();
showBalls.checked = balls.visible;
form.oninput = () => {
  renderer.toneMappingExposure = 2 ** exposure.value;
  probes.intensity = Number(intensity.value);
  balls.visible = showBalls.checked;
  draw();
};
if (relight) {
  const { addDay } = await import('./day.js');
  addDay({ THREE, form, scene, relight, bounds, model: gltf?.scene, draw });
}
form.oninput();
document.getElementById('info').textContent = probes.volumes
  .map(({ name, resolution }) => `${name}: ${resolution.join(' x ')} probes`).join('; ');
form.hidden = false;

function resize() {
  renderer.setPixelRatio(window.devicePixelRatio);
  renderer.setSize(window.innerWidth, window.innerHeight);
  camera.aspect = window.innerWidth / window.innerHeight;
  // What the given camera sees stays in a window of another shape.
  const height = Math.tan(THREE.MathUtils.degToRad(given.fov / 2)) * Math.max(1, given.aspect / camera.aspect);
  camera.fov = 2 * THREE.MathUtils.radToDeg(Math.atan(height));
  camera.updateProjectionMatrix();
  draw();
}
window.addEventListener('resize', resize);
resize();
controls.addEventListener('change', draw);
document.getElementById('message').textContent = '';
// For the browser's console.
window.rtgi = { THREE, scene, camera, renderer, probes, relight, balls, view, draw };
