// What the pages of WebGL share: a renderer that draws into float targets and says what is wrong with a shader, how its pixels come
// back, and the name of this machine's GPU.

import * as THREE from 'three';

export const renderer = new THREE.WebGLRenderer();
if (!renderer.extensions.has('EXT_color_buffer_float')) {
  throw new Error('this GPU cannot draw into float textures (EXT_color_buffer_float), so it cannot be measured');
}
// Errors in shaders end in the console alone otherwise.
renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
  throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(vertex)} ${gl.getShaderInfoLog(fragment)}`);
};

export async function readPixels(target) {
  const pixels = new Float32Array(4 * target.width * target.height);
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, pixels);
  return pixels;
}

const info = renderer.getContext().getExtension('WEBGL_debug_renderer_info');
export const device = info ? renderer.getContext().getParameter(info.UNMASKED_RENDERER_WEBGL) : 'WebGL 2';
