// The shaders of an export's style as three hands them to WebGL, but for its prefix: `EXPORT=folder node style_shaders.mjs` prints
// { name: { vertexShader, fragmentShader, uniforms } } as JSON, in a folder where `three` resolves.

import { readFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';

const folder = pathToFileURL(`${process.env.EXPORT}/`);
const { RTGIStyle, RTGIStyleView } = await import(new URL('rtgi/RTGIStyle.js', folder));
const THREE = await import(new URL('node_modules/three/build/three.module.js', folder));
const description = JSON.parse(await readFile(new URL('rtgi/style.json', folder)));
const style = new RTGIStyle(description, new THREE.Texture());

function resolved(text) {
  return text.replace(/^[ \t]*#include +<([\w\d./]+)>/gm, (_, name) => {
    if (THREE.ShaderChunk[name] === undefined) {
      throw new Error(`three has no chunk ${name}`);
    }
    return resolved(THREE.ShaderChunk[name]);
  }).replace(/NUM_DIR_LIGHTS/g, '1').replace(/NUM_\w+/g, '0').replace(/UNROLLED_LOOP_INDEX/g, '0');
}

const shaders = {};
function take(name, { vertexShader, fragmentShader }) {
  shaders[name] = { vertexShader: resolved(vertexShader), fragmentShader: resolved(fragmentShader) };
}

const view = new RTGIStyleView(style);
take('surfaces', view.surfaceMaterial);
take('lines', view.material);
for (const [name, type] of Object.entries({ lambert: 'MeshLambertMaterial', phong: 'MeshPhongMaterial',
  physical: 'MeshStandardMaterial', toon: 'MeshToonMaterial' })) {
  const material = new THREE[type](), shader = { uniforms: {}, ...THREE.ShaderLib[name] };
  style.apply(material);
  material.onBeforeCompile(shader, {});
  take(name, shader);
  if (shader.uniforms.style_bands !== style.uniforms.style_bands) {
    throw new Error('the uniforms of a material are not those of its style');
  }
}
console.log(JSON.stringify(shaders));
