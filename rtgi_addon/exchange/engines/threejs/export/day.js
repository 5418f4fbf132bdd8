// Sliders of the demo for other light: the sun by the hour, the sky, and every group of lights.

import { sunAt } from './rtgi/RTGIRelight.js';

const german = navigator.language.startsWith('de');
const WORDS = german ? { hour: 'Uhrzeit', strength: 'Sonne', sky: 'Himmel', baked: 'wie gebacken' }
  : { hour: 'Time of day', strength: 'Sun', sky: 'Sky', baked: 'as baked' };
// Noon's sun on a plane that faces it [W/m2], and how red it is near the horizon.
const NOON = 3, SUNSET = [1, 0.45, 0.15];

export function addDay({ THREE, form, scene, relight, bounds, model, draw }) {
  const sphere = bounds.getBoundingSphere(new THREE.Sphere());
  const sun = new THREE.DirectionalLight(0xffffff, 0);
  sun.castShadow = true;
  sun.shadow.camera = new THREE.OrthographicCamera(-sphere.radius, sphere.radius, sphere.radius, -sphere.radius, 0, 4 * sphere.radius);
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.normalBias = 0.01 * sphere.radius;
  sun.target.position.copy(sphere.center);
  scene.add(sun, sun.target);
  const baked = [];
  model?.traverse((object) => { if (object.isDirectionalLight) { baked.push([object, object.visible]); } });

  const slider = (name, text, max, value) => {
    const label = document.createElement('label'), input = document.createElement('input'), shown = document.createElement('output');
    Object.assign(input, { name, type: 'range', min: 0, max, step: max / 400, value });
    label.append(text, input, shown);
    label.style.gridTemplateColumns = '8em 9em 6em';
    form.insertBefore(label, document.getElementById('info'));
    return { input, shown };
  };
  // Left of midnight's end the light stays as it was baked.
  const hour = slider('hour', WORDS.hour, 24, 0), strength = slider('sun', WORDS.strength, 3, 1);
  const world = relight.lights.find(({ kind }) => kind === 'world');
  const sky = world && slider('sky', WORDS.sky, 3, 1);
  const groups = relight.lights.filter(({ kind }) => kind === 'group')
    .map(({ name }) => ({ name, ...slider(`group ${name}`, name, 2, 1) }));

  const follow = () => {
    const time = Number(hour.input.value), moved = time > 0;
    const towards = sunAt(time), up = towards.y;
    const day = THREE.MathUtils.smoothstep(up, -0.1, 0.17), low = THREE.MathUtils.smoothstep(up, 0, 0.4);
    const power = NOON * Number(strength.input.value) * THREE.MathUtils.smoothstep(up, 0, 0.1);
    const colour = new THREE.Color(...SUNSET.map((value) => power * (value + (1 - value) * low)));
    relight.suns = moved ? [{ towards, irradiance: colour }] : null;
    baked.forEach(([light, visible]) => { light.visible = visible && !moved; });
    // A lamp of three gives irradiance for intensity; its colour is scene-linear.
    sun.intensity = moved ? 1 : 0;
    sun.visible = moved && power > 0;
    sun.color.copy(colour);
    sun.position.copy(sphere.center).addScaledVector(towards, 2 * sphere.radius);
    if (world) {
      relight.factors[world.name] = Number(sky.input.value) * (moved ? 0.02 + 0.98 * day : 1);
    }
    groups.forEach(({ name, input }) => { relight.factors[name] = Number(input.value); });
    hour.shown.value = moved ? `${Math.floor(time)}:${String(Math.floor(60 * (time % 1))).padStart(2, '0')}` : WORDS.baked;
    draw();
  };
  form.addEventListener('input', follow);
  follow();
}
