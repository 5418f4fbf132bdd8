// Opens a page in headless Chromium and reports what became of it, as one JSON object:
//
//   node browser.mjs CHROMIUM PROFILE '{"url": ..., "width": 480, "height": 480, "screenshot": FILE, "picture": FILE}'
//
// Everything is drawn in software; "webgpu": true adds WebGPU to WebGL.
//
// "picture" receives the scene of the demo page from its camera, in linear light: float32 r, g, b rows from the bottom, twice as
// wide and high as the window.

import { writeFileSync } from 'node:fs';
import { chromium } from 'playwright-core';

const [executablePath, profile, text] = process.argv.slice(2);
const job = JSON.parse(text);
const context = await chromium.launchPersistentContext(profile, {
  executablePath,
  headless: true,
  viewport: { width: job.width, height: job.height },
  args: ['--no-sandbox', '--disable-gpu-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
    '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
    ...(job.webgpu ? ['--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader'] : [])],
});
const page = context.pages()[0] ?? await context.newPage();
const messages = [];
page.on('console', (message) => messages.push(`${message.type()}: ${message.text()}`));
page.on('pageerror', (error) => messages.push(`error: ${error.message}`));
try {
  await page.goto(job.url);
  await page.waitForFunction(() => document.documentElement.dataset.state, null, { timeout: 120000 });
  if (job.script) {
    await page.evaluate(job.script);
  }
  if (job.picture) {
    writeFileSync(job.picture, Buffer.from(await page.evaluate(draw), 'base64'));
  }
  if (job.screenshot) {
    await page.screenshot({ path: job.screenshot });
  }
  const state = await page.evaluate(() => document.documentElement.dataset.state);
  const shown = await page.evaluate(() => document.body.innerText);
  console.log(JSON.stringify({ state, shown, messages }));
} finally {
  await context.close();
}

// Runs in the page.
async function draw() {
  const { THREE, scene, camera, renderer } = window.rtgi;
  const size = renderer.getDrawingBufferSize(new THREE.Vector2()).multiplyScalar(2);
  const target = new THREE.WebGLRenderTarget(size.x, size.y, { type: THREE.FloatType });
  const before = renderer.getRenderTarget();
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  renderer.setRenderTarget(before);
  const pixels = new Float32Array(4 * size.x * size.y);
  renderer.readRenderTargetPixels(target, 0, 0, size.x, size.y, pixels);
  const rgb = pixels.filter((_, i) => i % 4 !== 3);
  const bytes = new Uint8Array(rgb.buffer);
  let binary = '';
  for (let i = 0; i < bytes.length; i += 32768) {
    binary += String.fromCharCode(...bytes.subarray(i, i + 32768));
  }
  return btoa(binary);
}
