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

async function openPage(url, allowed, {width = 1200, height = 800, scheme = 'dark', touch = false} = {}) {
  const context = await browser.newContext({viewport: {width, height}, colorScheme: scheme, hasTouch: touch, acceptDownloads: true});
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

// Edits: a box that is dragged, what it takes away, steps back to the bit.
{
  const {tab} = await openPage(pathToFileURL(path.join(dist, 'index.html')).href, /^(file|blob|data):/);
  await tab.setInputFiles('#file', splat);
  await state(tab, 'shown');
  const text = (id) => tab.locator(id).innerText();
  const numbers = (words) => [...words.matchAll(/\d[\d,]*/g)].map(([word]) => Number(word.replaceAll(',', '')));
  const said = async (pattern) => {
    await tab.waitForFunction((source) => document.getElementById('busy').hidden && (document.documentElement.dataset.trouble ||
      new RegExp(source).test(document.getElementById('edited').textContent)), pattern.source);
    await settled(tab);
  };
  const handle = (kind) => tab.frameLocator('#viewer').locator(`#box button.${kind}`);
  const saved = async () => {
    await tab.waitForFunction(() => document.getElementById('busy').hidden);
    await tab.selectOption('#format', 'ply');
    const [download] = await Promise.all([tab.waitForEvent('download'), tab.locator('#download').click()]);
    const chunks = [];
    for await (const chunk of await download.createReadStream()) chunks.push(chunk);
    return {name: download.suggestedFilename(), bytes: Buffer.concat(chunks)};
  };
  const steps = [await saved()];
  expect('what is not edited is called as it was', steps[0].name === path.basename(splat), steps[0].name);
  expect('there is nothing to undo', await tab.locator('#undo').isDisabled() && await tab.locator('#redo').isDisabled());

  await tab.locator('#crop').click();
  await tab.waitForFunction(() => /are inside/.test(document.getElementById('inside').textContent));
  expect('a box has a handle on each side and one in the middle', await tab.frameLocator('#viewer').locator('#box button').count() === 7);
  const [inside, all] = numbers(await text('#inside'));
  expect('the box is around the most of it', inside > 0.9 * all && inside < all, await text('#inside'));
  const middle = await handle('middle').boundingBox();
  const side = await handle('x').nth(1).boundingBox();
  const center = ({x, y, width, height}) => [x + width / 2, y + height / 2];
  await tab.mouse.move(...center(side));
  await tab.mouse.down();
  await tab.mouse.move(...center(side).map((x, k) => 0.4 * x + 0.6 * center(middle)[k]), {steps: 5});
  const dragged = center(await handle('x').nth(1).boundingBox());
  expect('a handle follows the mouse', Math.hypot(...center(side).map((x, k) => 0.4 * x + 0.6 * center(middle)[k] - dragged[k])) < 3, String(dragged));
  await tab.mouse.up();
  await tab.waitForFunction((before) => document.getElementById('inside').textContent !== before, `${inside.toLocaleString('en')} of ${all.toLocaleString('en')} Gaussians are inside.`);
  const [fewer] = numbers(await text('#inside'));
  expect('fewer are inside', fewer < 0.9 * inside && fewer > 0, `${inside} ${fewer}`);
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'crop.png')});
  await handle('y').first().focus();
  const before = await text('#inside');
  await tab.keyboard.press('Shift+ArrowRight');
  await tab.waitForFunction((old) => document.getElementById('inside').textContent !== old, before);
  const [least] = numbers(await text('#inside'));
  expect('a key moves a side', least < fewer, `${fewer} ${least}`);
  await tab.locator('#keep').click();
  await said(/removed/);
  const [removed, left] = numbers(await text('#edited'));
  expect('what the box said is what it took away', removed === all - least && left === least, `${await text('#edited')} ${least} of ${all}`);
  expect('the splat is described as it is', (await text('#about')).startsWith(`${left.toLocaleString('en')} Gaussians, edited`), await text('#about'));
  expect('the box is gone', !(await tab.locator('#crop-how').isVisible()) && await tab.frameLocator('#viewer').locator('#box').count() === 0);
  await tab.screenshot({path: path.join(out, 'cropped.png')});
  steps.push(await saved());
  expect('what was edited says so in its name', /-edited\.ply$/.test(steps[1].name), steps[1].name);

  // Turned until it stands upright, from where one looks.
  const lookAt = () => tab.evaluate(() => new Promise((resolve) => {
    addEventListener('message', ({data}) => { if (data && data.look) resolve(data.look); });
    document.getElementById('viewer').contentWindow.postMessage({tell: 'look'}, '*');
  }));
  await tab.locator('#turn').click();
  await tab.locator('#tilt').fill('30');
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'turning.png')});
  const tilted = await lookAt();
  await tab.locator('#upright').click();
  await said(/Turned upright/);
  await tab.screenshot({path: path.join(out, 'turned.png')});
  const upright = await lookAt();
  expect('it is seen from the same place', Math.abs(upright.distance - tilted.distance) < 1e-9 && upright.axes.every((axis, k) =>
    Math.abs(axis.reduce((sum, x, j) => sum + x * upright.up[j], 0) - tilted.axes[k].reduce((sum, x, j) => sum + x * tilted.up[j], 0)) < 1e-6));
  expect('up is up', Math.abs(upright.up[1] + 1) < 1e-9, String(upright.up));
  steps.push(await saved());
  await tab.locator('#centre').click();
  await said(/0, 0, 0/);
  const ply = (await saved()).bytes;
  const head = ply.indexOf('end_header\n') + 11;
  const width = 4 * [...ply.subarray(0, head).toString('latin1').matchAll(/property float/g)].length;
  // Roughly: what is faint counts here.
  const middleNow = [0, 1, 2].map((axis) => {
    const along = Array.from({length: (ply.length - head) / width}, (_, k) => ply.readFloatLE(head + k * width + 4 * axis)).sort((a, b) => a - b);
    return 0.5 * (along[Math.floor(0.01 * along.length)] + along[Math.floor(0.99 * along.length)]);
  });
  expect('its middle is at 0, 0, 0', Math.hypot(...middleNow) < 0.02, String(middleNow));
  await tab.locator('#floaters').click();
  await said(/Nothing was removed|removed, /);
  console.log(`floaters of the example: ${await text('#edited')}`);

  // Back and forth: the same bits.
  while (await tab.locator('#undo').isEnabled()) {
    const told = await text('#edited');
    await tab.locator('#undo').click();
    await tab.waitForFunction((old) => document.getElementById('edited').textContent !== old && document.getElementById('busy').hidden, told);
  }
  expect('all undone, it is the file', (await saved()).bytes.equals(steps[0].bytes));
  for (const key of ['Control+y', 'Control+Shift+z']) {
    const told = await text('#edited');
    await tab.locator('#panel h2').click();
    await tab.keyboard.press(key);
    await tab.waitForFunction((old) => document.getElementById('edited').textContent !== old && document.getElementById('busy').hidden, told);
    expect(`${key} does it again`, (await saved()).bytes.equals(steps[key === 'Control+y' ? 1 : 2].bytes));
  }
  await tab.keyboard.press('Control+z');
  await said(/Undone: turn upright/);
  expect('undone to the bit', (await saved()).bytes.equals(steps[1].bytes));

  // What was made of another state is not its result.
  await tab.selectOption('#quality', 'filter');
  await tab.locator('#enhance').click();
  await state(tab, 'enhanced');
  await tab.locator('#undo').click();
  await tab.waitForFunction(() => /enhance it again/.test(document.getElementById('done').textContent));
  expect('the file as it was is open again', (await text('#about')).startsWith(`${all.toLocaleString('en')} Gaussians, PLY`));

  // The other way round, and nothing at all.
  await tab.waitForFunction(() => document.getElementById('busy').hidden);
  await tab.locator('#crop').click();
  await tab.waitForFunction(() => /are inside/.test(document.getElementById('inside').textContent));
  await tab.locator('#remove').click();
  await said(/removed/);
  expect('the inside is removed', numbers(await text('#edited'))[0] === inside, `${await text('#edited')} ${inside}`);
  expect('no trouble', (await troubles(tab)) === '', await troubles(tab));
  await tab.close();
}

// On a phone, light.
{
  const {tab} = await openPage(pathToFileURL(path.join(dist, 'index.html')).href, /^(file|blob|data):/,
    {width: 390, height: 780, scheme: 'light', touch: true});
  await tab.setInputFiles('#file', splat);
  await state(tab, 'shown');
  await settled(tab);
  expect('nothing is wider than a phone', await tab.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  await tab.screenshot({path: path.join(out, 'phone.png')});
  // A finger drags a side of the box.
  await tab.locator('#crop').tap();
  await tab.waitForFunction(() => /are inside/.test(document.getElementById('inside').textContent));
  const inside = await tab.locator('#inside').innerText();
  const {x, y, width, height} = await tab.frameLocator('#viewer').locator('#box button.y').first().boundingBox();
  const fingers = await tab.context().newCDPSession(tab);
  const finger = (type, ...points) => fingers.send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([px, py]) => ({x: px, y: py}))});
  await finger('touchStart', [x + width / 2, y + height / 2]);
  await finger('touchMove', [x + width / 2, y + height / 2 + 30]);
  await finger('touchEnd');
  await tab.waitForFunction((before) => document.getElementById('inside').textContent !== before, inside);
  await settled(tab);
  await tab.screenshot({path: path.join(out, 'phone-crop.png')});
  await tab.locator('#crop-end').tap();
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
