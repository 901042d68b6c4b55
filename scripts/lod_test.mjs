// Levels of detail in the PlayCanvas engine: lod_test.mjs SCENE NEAR FAR REFERENCES OUT
//
// SCENE       folder with the lod-meta.json that `anchorsplat convert --lod` wrote
// NEAR, FAR   transforms.json of the same cameras, near by and eight times as far away
// REFERENCES  folder with near/NAME.png, far/NAME.png and far-level/NAME.png, 512×512, from `anchorsplat render`: of the splat,
//             and of the level that is to be shown from far away
// OUT         folder for screenshots
// Prints what it measured and every failed expectation; exit code 1 if there is one.
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import {expect, finish, launchBrowser} from './browser.mjs';

const engine = path.join(process.env.NODE_FOLDER, 'node_modules/playcanvas/build/playcanvas.mjs');
const [scene, near, far, references, out] = process.argv.slice(2).map((p) => path.resolve(p));
const SIDE = 512;
const LEVELS = JSON.parse(fs.readFileSync(path.join(scene, 'lod-meta.json'))).lodLevels;

const page = `<!DOCTYPE html><html><head><link rel="icon" href="data:,"></head>
<body style="margin:0;background:#000"><canvas id="canvas" width="${SIDE}" height="${SIDE}"></canvas>
<script type="module">
import * as pc from './playcanvas.mjs';
const canvas = document.getElementById('canvas');
const app = new pc.Application(canvas, {graphicsDeviceOptions: {antialias: false, alpha: false}});
app.setCanvasFillMode(pc.FILLMODE_NONE, ${SIDE}, ${SIDE});
app.setCanvasResolution(pc.RESOLUTION_FIXED, ${SIDE}, ${SIDE});
app.start();
// Everything that belongs to a Gaussian is drawn, as the renderer does it.
Object.assign(app.scene.gsplat, {minPixelSize: 0, minContribution: 0, alphaClip: 1 / 255, lodUpdateAngle: 0});
// The level goes by the distance alone, however few Gaussians that makes.
app.scene.gsplat.splatBudgetMode = pc.GSPLAT_BUDGET_LIMIT;
const camera = new pc.Entity();
camera.addComponent('camera', {clearColor: new pc.Color(0, 0, 0), nearClip: 0.01, farClip: 1000});
app.root.addChild(camera);
const asset = new pc.Asset('scene', 'gsplat', {url: '/scene/lod-meta.json'});
window.failed = null;
asset.on('error', (error) => { window.failed = String(error); });
window.quiet = 0;  // frames in a row in which all that is wanted was there
app.systems.gsplat.on('frame:ready', (camera, layer, ready, loading) => {
  window.quiet = ready && loading === 0 ? window.quiet + 1 : 0;
});
window.look = (matrix, fov, base) => {
  const world = new pc.Mat4();
  world.set([0, 1, 2, 3].flatMap((column) => matrix.map((row) => row[column])));
  camera.setPosition(world.getTranslation());
  camera.setRotation(new pc.Quat().setFromMat4(world));
  camera.camera.fov = fov;
  // The scene comes once the camera is where it looks from: nothing is loaded for another place.
  if (!window.entity) {
    window.entity = new pc.Entity();
    window.entity.addComponent('gsplat', {asset, lodBaseDistance: base, lodMultiplier: 2});
    app.root.addChild(window.entity);
  }
  window.quiet = 0;
};
asset.ready(() => { window.opened = true; });
app.assets.add(asset);
app.assets.load(asset);
</script></body></html>`;

const types = {'.json': 'application/json', '.webp': 'image/webp', '.mjs': 'text/javascript'};
const asked = [];
const server = http.createServer((request, response) => {
  const name = decodeURIComponent(new URL(request.url, 'http://here').pathname);
  const send = (type, body) => response.writeHead(200, {'Content-Type': type}).end(body);
  if (name === '/') return send('text/html', page);
  if (name === '/playcanvas.mjs') return send('text/javascript', fs.readFileSync(engine));
  const file = path.join(scene, path.normalize(name.replace(/^\/scene\//, '')));
  if (!name.startsWith('/scene/') || !fs.existsSync(file)) return response.writeHead(404).end();
  asked.push(name.slice('/scene/'.length));
  send(types[path.extname(file)] ?? 'application/octet-stream', fs.readFileSync(file));
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

const browser = await launchBrowser();
const ruler = await browser.newPage();
// PSNR of the middle of two PNGs, `side` pixels wide.
function psnr(a, b, side) {
  return ruler.evaluate(async ([pictures, side]) => {
    const [x, y] = await Promise.all(pictures.map(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = new OffscreenCanvas(side, side);
      canvas.getContext('2d').drawImage(image, (side - image.width) / 2, (side - image.height) / 2);
      return canvas.getContext('2d').getImageData(0, 0, side, side).data;
    }));
    let squares = 0;
    for (let i = 0; i < x.length; ++i) if (i % 4 < 3) squares += (x[i] - y[i]) ** 2;
    return 10 * Math.log10(255 * 255 / (squares / (3 * side * side)));
  }, [[a, b].map((bytes) => Buffer.from(bytes).toString('base64')), side]);
}

const distance = (matrix) => Math.hypot(...[0, 1, 2].map((row) => matrix[row][3]));
const chunksAsked = () => [...new Set(asked.map((name) => name.split('/')[0]).filter((name) => /^\d+_\d+$/.test(name)))];

// A fresh page per distance, so that nothing is there that was loaded for another one.
async function visit(kind, cameras, side, comparisons) {
  asked.length = 0;
  const tab = await browser.newPage({viewport: {width: SIDE, height: SIDE}});
  tab.setDefaultTimeout(240000);
  tab.on('pageerror', (error) => expect('no uncaught error', false, error.message));
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  await tab.waitForFunction(() => window.opened || window.failed);
  expect(`${kind}: the scene opens`, (await tab.evaluate(() => window.failed)) === null, await tab.evaluate(() => window.failed));
  const {fl_y: focal, h, frames} = JSON.parse(fs.readFileSync(cameras));
  const fov = 2 * Math.atan(h / 2 / focal) * 180 / Math.PI;
  const least = {};
  for (const frame of frames.slice(0, 6)) {
    const name = path.basename(frame.file_path);
    // The engine counts distances as for a field of view of its own; level k is beyond base·2^k of them.
    const base = kind === 'near' ? 1000 : 0.1;
    await tab.evaluate(([matrix, fov, base]) => window.look(matrix, fov, base), [frame.transform_matrix, fov, base]);
    await tab.waitForFunction(() => window.quiet >= 8);
    const shot = await tab.screenshot({path: path.join(out, `lod-${kind}-${name}`)});
    for (const [reference, bound] of Object.entries(comparisons)) {
      const value = await psnr(shot, fs.readFileSync(path.join(references, reference, name)), side);
      least[reference] = Math.min(least[reference] ?? Infinity, value);
      expect(`${kind}: ${name} looks like ${reference}`, value >= bound, `${value.toFixed(2)} dB`);
    }
  }
  const chunks = chunksAsked();
  await tab.close();
  console.log(`${kind} (${distance(frames[0].transform_matrix).toFixed(1)} units): at least ` +
    Object.entries(least).map(([name, value]) => `${value.toFixed(2)} dB to ${name}`).join(', ') + `; chunks ${chunks.join(' ')}`);
  return chunks;
}

// The whole picture, and from far away the middle, which has the object.
const chunksNear = await visit('near', near, SIDE, {near: 30});
expect('near: the finest level was loaded', chunksNear.some((name) => name.startsWith('0_')), chunksNear.join(' '));
const chunksFar = await visit('far', far, SIDE / 8, {'far-level': 28, far: 15});
expect('far: the coarsest level was loaded', chunksFar.some((name) => name.startsWith(`${LEVELS - 1}_`)), chunksFar.join(' '));
expect('far: nothing finer was loaded', chunksFar.every((name) => name.startsWith(`${LEVELS - 1}_`)), chunksFar.join(' '));

await browser.close();
server.close();
finish();
