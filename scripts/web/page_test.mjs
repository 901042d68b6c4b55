// The page in a real browser: page_test.mjs DIST SPLAT OUT
//
// DIST  build/web/dist    SPLAT  a splat file    OUT  folder for screenshots
// Prints what it measured and every failed expectation; exit code 1 if there is one.
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';
import {ISOLATED, expect, finish, launchBrowser, serve, watchedTab} from '../browser.mjs';

const [dist, splat, out] = process.argv.slice(2).map((p) => path.resolve(p));
const browser = await launchBrowser();

async function openPage(url, allowed, {width = 1200, height = 800, scheme = 'dark'} = {}) {
  const context = await browser.newContext({viewport: {width, height}, colorScheme: scheme, acceptDownloads: true});
  // The viewer's help has a button that wants the focus, which a frame does not get.
  const tab = await watchedTab(context, {allowed, hushed: /autofocus/i});
  await tab.goto(url);
  await state(tab, 'ready');
  return {tab, context};
}
const state = (tab, wanted) => tab.waitForFunction((name) =>
  document.documentElement.dataset.state === name || document.documentElement.dataset.trouble, wanted);
const troubles = (tab) => tab.evaluate(() => document.documentElement.dataset.trouble || '');
const stageOf = (tab) => tab.frames().find((frame) => frame !== tab.mainFrame());
const inSight = (tab) => tab.evaluate(() => {
  const {top, bottom} = document.getElementById('trouble').getBoundingClientRect();
  const panel = document.getElementById('panel').getBoundingClientRect();
  return bottom > top && top >= panel.top && bottom <= panel.bottom;
});
// As if these files had been dropped: [name, text].
const dropFiles = (tab, files) => tab.evaluate((list) => {
  const dataTransfer = new DataTransfer();
  for (const [name, text] of list) dataTransfer.items.add(new File([text], name));
  dispatchEvent(new DragEvent('drop', {dataTransfer, cancelable: true}));
}, files);
const settled = (tab) => stageOf(tab).waitForFunction(() => document.documentElement.dataset.settled === 'true');

// From a folder, as a file: everything.
{
  const {tab} = await openPage(pathToFileURL(path.join(dist, 'index.html')).href, /^(file|blob|data):/);
  const readyAfter = Number(await tab.evaluate(() => document.documentElement.dataset.readyAfter));
  console.log(`the page can be used after ${readyAfter} ms`);
  await tab.screenshot({path: path.join(out, 'welcome.png')});
  await tab.setInputFiles('#file', splat);
  await state(tab, 'shown');
  expect('a splat is shown', (await troubles(tab)) === '', await troubles(tab));
  expect('it is described', /Gaussians/.test(await tab.locator('#about').innerText()), await tab.locator('#about').innerText());
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'shown.png')});

  // The slider: every step is a new width on the stage.
  const steps = await tab.evaluate(async () => {
    const slider = document.getElementById('pixel');
    const frame = document.getElementById('viewer');
    const times = [];
    for (let k = 0; k < 10; ++k) {
      const began = performance.now();
      slider.value = String(-1 + 0.2 * k);
      slider.dispatchEvent(new Event('input', {bubbles: true}));
      times.push(performance.now() - began);
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    return {times, hidden: frame.hidden};
  });
  console.log(`a step of the slider: ${Math.max(...steps.times).toFixed(1)} ms of the page at most`);
  expect('a step of the slider is quick', Math.max(...steps.times) <= 50, String(steps.times));
  const drawn = () => stageOf(tab).evaluate(() => ({...document.documentElement.dataset}));
  await stageOf(tab).waitForFunction(() => document.documentElement.dataset.drawnWidening === document.documentElement.dataset.widening);
  await settled(tab);
  expect('the last step is shown with all pixels', (await drawn()).pixels === 'all' && (await drawn()).drawnWidening === (await drawn()).widening);
  const widening = () => stageOf(tab).evaluate(() => document.documentElement.dataset.widening || '');
  await settled(tab);
  const first = await widening();
  await tab.locator('#pixel').focus();
  await tab.keyboard.press('ArrowRight');
  await tab.waitForTimeout(200);
  expect('the stage follows the slider', Number(first) > 0 && Number(await widening()) > Number(first), `${first} ${await widening()}`);
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'preview.png')});
  await tab.locator('#pixel-auto').click();

  // Stop, then to the end.
  await tab.selectOption('#quality', 'good');
  await tab.locator('#enhance').click();
  await tab.locator('#stop').waitFor({state: 'visible'});
  expect('nothing that it is made with changes meanwhile', await tab.evaluate(() =>
    ['upscale', 'quality', 'pixel', 'pixel-auto', 'cameras'].every((id) => document.getElementById(id).disabled)));
  await tab.locator('#stop').click();
  await tab.waitForFunction(() => /Stopped/.test(document.getElementById('done').textContent));
  await tab.selectOption('#quality', 'fast');
  const began = Date.now();
  await tab.locator('#enhance').click();
  await state(tab, 'enhanced');
  expect('it is enhanced', (await troubles(tab)) === '', await troubles(tab));
  console.log(`enhanced and shown after ${((Date.now() - began) / 1000).toFixed(1)} s: ${await tab.locator('#done').innerText()}`);
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'enhanced.png')});

  for (const format of await tab.locator('#format option').evaluateAll((all) => all.map((o) => o.value))) {
    await tab.selectOption('#format', format);
    const [download] = await Promise.all([tab.waitForEvent('download'), tab.locator('#download').click()]);
    const file = path.join(out, download.suggestedFilename());
    await download.saveAs(file);
    expect(`it is saved as ${format}`, fs.statSync(file).size > 10000 && file.endsWith(`-4x.${format}`), file);
    fs.rmSync(file);
  }

  // A splat that lies elsewhere, and of which nothing can be estimated, is seen whole; its slider's picture goes back, too.
  const place = (tab) => tab.evaluate(() => new Promise((resolve) => {
    addEventListener('message', ({data}) => { if (data && data.look) resolve(data.look.target); });
    document.getElementById('viewer').contentWindow.postMessage({tell: 'look'}, '*');
  }));
  const columns = ['x', 'y', 'z', 'f_dc_0', 'f_dc_1', 'f_dc_2', 'opacity', 'scale_0', 'scale_1', 'scale_2', 'rot_0', 'rot_1', 'rot_2', 'rot_3'];
  const far = `ply\nformat ascii 1.0\nelement vertex 2\n${columns.map((name) => `property float ${name}\n`).join('')}end_header\n` +
    '1000 0 0 1 1 1 3 -3 -3 -3 1 0 0 0\n1001 0 0 1 1 1 3 -3 -3 -3 1 0 0 0\n';
  await tab.setInputFiles('#file', {name: 'far.ply', mimeType: 'application/octet-stream', buffer: Buffer.from(far)});
  await tab.waitForFunction(() => document.getElementById('name').textContent === 'far.ply' && document.documentElement.dataset.state === 'shown');
  expect('another splat is looked at where it is', (await place(tab))[0] > 900, String(await place(tab)));
  await tab.locator('#pixel').press('ArrowRight');
  await tab.locator('#pixel-auto').click();
  await stageOf(tab).waitForFunction(() => !Number(document.documentElement.dataset.widening));

  // Cameras: dropped beside the splat they are of; the slider is instead of them; another splat has none.
  const cameraText = fs.readFileSync(path.join(path.dirname(splat), 'transforms_lr.json'), 'utf8');
  const said = () => tab.locator('#cameras-about').innerText();
  await dropFiles(tab, [['transforms.json', cameraText], ['near.ply', far.replaceAll(/100([01])/g, '$1')]]);
  await tab.waitForFunction(() => /127 cameras/.test(document.getElementById('cameras-about').textContent));
  expect('the splat beside the cameras is open', await tab.locator('#name').innerText() === 'near.ply');
  await tab.locator('#pixel').press('ArrowRight');
  expect('cameras are not used behind the slider', /not used/.test(await said()), await said());
  await tab.locator('#pixel-auto').click();
  expect('cameras are used again', /127 cameras: Enhance takes/.test(await said()), await said());
  await dropFiles(tab, [['a.ply', far], ['b.ply', far]]);
  expect('two splats at once are refused', /a\.ply, b\.ply/.test(await troubles(tab)), await troubles(tab));
  await tab.setInputFiles('#file', {name: 'far.ply', mimeType: 'application/octet-stream', buffer: Buffer.from(far)});
  await tab.waitForFunction(() => document.getElementById('name').textContent === 'far.ply');
  expect('another splat has no cameras', await said() === '', await said());

  // A file that is none is an error with a sentence, and the page goes on.
  await tab.setInputFiles('#file', {name: 'broken.ply', mimeType: 'application/octet-stream', buffer: Buffer.from('ply\nformat ascii 1.0\n')});
  await tab.waitForFunction(() => document.documentElement.dataset.trouble);
  expect('a broken file is named', /broken\.ply/.test(await troubles(tab)), await troubles(tab));
  expect('an error can be seen', await inSight(tab));
  await tab.setInputFiles('#file', splat);
  await tab.waitForFunction(() => !document.documentElement.dataset.trouble && document.documentElement.dataset.state === 'shown');
  await tab.close();
}

// On a phone, light.
{
  const {tab} = await openPage(pathToFileURL(path.join(dist, 'index.html')).href, /^(file|blob|data):/,
    {width: 390, height: 780, scheme: 'light'});
  await tab.setInputFiles('#file', splat);
  await state(tab, 'shown');
  await settled(tab);
  expect('nothing is wider than a phone', await tab.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  await tab.screenshot({path: path.join(out, 'phone.png')});
  await tab.setInputFiles('#file', {name: 'broken.ply', mimeType: 'application/octet-stream', buffer: Buffer.from('ply\nformat ascii 1.0\n')});
  await tab.waitForFunction(() => document.documentElement.dataset.trouble);
  expect('an error can be seen on a phone', await inSight(tab));
  await tab.screenshot({path: path.join(out, 'phone-error.png')});
  await tab.setViewportSize({width: 740, height: 360});
  expect('held sideways, the stage has the whole height', await tab.evaluate(() => document.getElementById('viewer').clientHeight === innerHeight));
  expect('held sideways, the panel has no wide parts', await tab.evaluate(() => {
    const panel = document.getElementById('panel');
    return panel.scrollWidth <= panel.clientWidth;
  }));
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'phone-sideways.png')});
  await tab.close();
}

// Hosted: only its own files are asked for, and it opens again without a network. Where the host isolates it, with threads.
const inDist = (name) => path.join(dist, name === '/' ? 'index.html' : path.basename(name));
for (const [headers, own] of [[{}, '(sw\\.js)?'], [ISOLATED, '(sw\\.js|worker-threads\\.js|engine-threads\\.wasm)?']]) {
  const {home, close} = await serve(inDist, headers);
  const isolated = headers === ISOLATED;
  const {tab, context} = await openPage(home, new RegExp(`^(blob:|data:|${home}${own}$)`));
  await tab.evaluate(() => navigator.serviceWorker.ready);
  await tab.waitForFunction((least) => caches.keys()
    .then(async (names) => names.length > 0 && (await (await caches.open(names[0])).keys()).length >= least), isolated ? 3 : 1);
  // Another page of the host is not kept under the address of this one.
  if (!isolated) {
    const other = await context.newPage();
    await other.goto(`${home}sw.js`);
    await other.close();
  }
  close();
  await context.setOffline(true);
  await tab.reload();
  await state(tab, 'ready');
  await tab.setInputFiles('#file', splat);
  await state(tab, 'shown');
  expect('it works offline', (await troubles(tab)) === '', await troubles(tab));
  const threads = Number(await tab.evaluate(() => document.documentElement.dataset.threads));
  expect(isolated ? 'it has threads' : 'it has one thread', isolated ? threads > 1 : threads === 1, String(threads));
  const began = Date.now();
  await tab.locator('#enhance').click();
  await state(tab, 'enhanced');
  expect('it enhances offline', (await troubles(tab)) === '', await troubles(tab));
  console.log(`${threads} threads: enhanced and shown after ${((Date.now() - began) / 1000).toFixed(1)} s: ${await tab.locator('#done').innerText()}`);
  await context.close();
}

// The package in a page of somebody else's, with a viewer from npm (examples/web).
{
  const modules = path.join(process.env.NODE_FOLDER, 'node_modules');
  const {home, close} = await serve((name) => (name === '/' ? path.resolve('examples/web/index.html') : name === '/splat.ply' ? splat
    : name.startsWith('/node_modules/anchorsplat/') ? path.join(dist, '../npm', path.basename(name))
    : name.startsWith('/node_modules/') && !name.includes('..') ? path.join(modules, name.slice(14)) : ''));
  const tab = await watchedTab(await browser.newContext({viewport: {width: 700, height: 500}}), {console: false});
  await tab.goto(home);
  await tab.waitForFunction(() => document.documentElement.dataset.state);
  const told = await tab.locator('#told').innerText();
  expect('a viewer from npm shows an enhanced splat', /^20,000 Gaussians became/.test(told), told);
  await tab.waitForTimeout(3000);  // until it has sorted
  await tab.screenshot({path: path.join(out, 'example.png')});
  close();
}

await browser.close();
finish();
