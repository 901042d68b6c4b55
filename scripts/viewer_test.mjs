// The page of `anchorsplat view` in a real browser: viewer_test.mjs PAGE LARGE REFERENCES OUT
//
// PAGE        a page with before, after and views with true pictures
// LARGE       folder with one.html and many.html, a large splat in one file and with its data in many.data, in several parts
// REFERENCES  folder with before/NAME.png and after/NAME.png, 512×512, from `anchorsplat render`
// OUT         folder for screenshots
// Prints what it measured and every failed expectation; exit code 1 if there is one.
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';
import {expect, finish, launchBrowser, watchedTab} from './browser.mjs';

const [page, large, references, out] = process.argv.slice(2).map((p) => path.resolve(p));
const SIDE = 512;
const LEAST_PSNR = 32;
const browser = await launchBrowser();

// A tab with the page in it; whatever it says or asks for that it should not is a failure.
async function open(file, {width, height, scale = 1, touch = false, quiet = true, before, cut = false} = {}) {
  const context = await browser.newContext({viewport: {width, height}, deviceScaleFactor: scale, hasTouch: touch});
  // A script that was cut is an error for the browser, whatever the page makes of it.
  const known = cut ? /^(Invalid or unexpected token|Unexpected end)/ : undefined;
  const tab = await watchedTab(context, {allowed: /^(file|blob|data):/, console: quiet, known});
  if (before) await tab.addInitScript(before);
  await tab.goto(pathToFileURL(file).href);
  await tab.waitForFunction(() => document.documentElement.dataset.state !== 'loading', null, {timeout: 300000});
  return tab;
}

const state = (tab) => tab.evaluate(() => document.documentElement.dataset.state);
const settled = (tab) =>
  tab.waitForFunction(() => document.documentElement.dataset.settled === 'true', null, {timeout: 300000});
const visible = (tab, selector) => tab.locator(selector).isVisible();
const pressed = (tab, selector) => tab.locator(selector).getAttribute('aria-pressed');
async function picture(tab, name) {
  await settled(tab);
  await tab.waitForTimeout(60);  // until the compositor shows the frame
  return tab.screenshot({timeout: 300000, ...(name ? {path: path.join(out, `${name}.png`)} : {})});
}

// Two PNGs, decoded by the browser: largest difference and PSNR of rgb.
const ruler = await browser.newPage();
function difference(a, b) {
  return ruler.evaluate(async (pictures) => {
    const [x, y] = await Promise.all(pictures.map(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext('2d');
      context.drawImage(image, 0, 0);
      return context.getImageData(0, 0, image.width, image.height);
    }));
    if (x.width !== y.width || x.height !== y.height) return {psnr: -1, share: 1};
    let squares = 0;
    let changed = 0;
    for (let i = 0; i < x.data.length; i += 4) {
      let most = 0;
      for (let c = 0; c < 3; ++c) {
        const d = x.data[i + c] - y.data[i + c];
        squares += d * d;
        most = Math.max(most, Math.abs(d));
      }
      if (most > 8) ++changed;
    }
    const mean = squares / (3 * x.width * x.height);
    return {psnr: mean === 0 ? Infinity : 10 * Math.log10(255 * 255 / mean), share: changed / (x.width * x.height)};
  }, [a, b].map((bytes) => Buffer.from(bytes).toString('base64')));
}
const same = async (a, b) => (await difference(a, b)).share < 1e-4;

// What the renderer shows from the same camera.
{
  const tab = await open(page, {width: SIDE, height: SIDE});
  expect('the page opens', (await state(tab)) === 'ready');
  const names = await tab.locator('#views button span').evaluateAll((all) => all.map((e) => e.textContent));
  await tab.keyboard.press('i');
  let least = Infinity;
  let compared = 0;
  for (let k = 0; k < Math.min(9, names.length); k += 2) {
    for (const [key, side] of [['a', 'before'], ['b', 'after']]) {
      const file = path.join(references, side, `${path.basename(names[k])}.png`);
      if (!fs.existsSync(file)) continue;
      await tab.keyboard.press(String(k + 1));
      await tab.keyboard.press(key);
      const {psnr} = await difference(await picture(tab), fs.readFileSync(file));
      least = Math.min(least, psnr);
      ++compared;
      expect(`${side} from ${names[k]} looks like the renderer's`, psnr >= LEAST_PSNR, `${psnr.toFixed(2)} dB`);
    }
  }
  expect('views were compared', compared >= 4, String(compared));
  console.log(`${compared} screenshots against the renderer: at least ${least.toFixed(2)} dB`);
  await tab.close();
}

// Every control, by hand and by key.
{
  const tab = await open(page, {width: 1280, height: 800});
  const ready = await tab.evaluate(() => document.documentElement.dataset.readyAfter);
  console.log(`${(fs.statSync(page).size / 1e6).toFixed(2)} MB, ready after ${ready} ms`);
  const first = await picture(tab, 'desktop');

  expect('readers can open their own', await tab.locator('#own').getAttribute('href') === 'https://splats.example/' &&
    await visible(tab, '#own'));
  const divider = tab.locator('#divider');
  const box = await divider.boundingBox();
  await tab.mouse.move(box.x + box.width / 2, 500);
  await tab.mouse.down();
  await tab.mouse.move(320, 500, {steps: 4});
  await tab.mouse.up();
  expect('the slider follows the mouse', (await divider.getAttribute('aria-valuenow')) === '25');
  await divider.focus();
  await tab.keyboard.press('ArrowRight');
  await settled(tab);
  expect('the slider follows its keys', (await divider.getAttribute('aria-valuenow')) === '27');
  expect('the slider moves pixels', !(await same(first, await picture(tab))));

  await tab.keyboard.press('a');
  const before = await picture(tab);
  expect('A is before', (await tab.locator('#tag-first').textContent()) === 'Before' && await visible(tab, '#tag-first'));
  await tab.keyboard.press('b');
  const after = await picture(tab);
  expect('B is after', await visible(tab, '#tag-second') && !(await visible(tab, '#tag-first')));
  expect('before and after differ', !(await same(before, after)));
  await tab.locator('#canvas').focus();
  await tab.keyboard.press(' ');
  expect('space takes the other', await same(before, await picture(tab)));

  await tab.click('[data-mode=side]');
  await picture(tab, 'side-by-side');
  expect('side by side is pressed', (await pressed(tab, '[data-mode=side]')) === 'true');
  await tab.click('[data-mode=difference]');
  const heat = await picture(tab, 'difference');
  expect('the difference has a legend', await visible(tab, '#legend'));
  expect('the difference looks different', !(await same(heat, after)));

  await tab.keyboard.press('s');
  await tab.keyboard.press('l');
  await tab.mouse.move(560, 380);
  const lens = await picture(tab, 'lens');
  expect('the lens shows', await visible(tab, '#ring-first'));
  await tab.mouse.move(700, 420);
  expect('the lens follows', !(await same(lens, await picture(tab))));
  await tab.keyboard.press('l');

  await tab.locator('#canvas').focus();  // a focused button has a ring
  const still = await picture(tab);
  await tab.mouse.move(640, 150);
  await tab.mouse.down();
  await tab.mouse.move(720, 200, {steps: 4});
  await tab.mouse.up();
  const turned = await picture(tab);
  expect('dragging turns', !(await same(still, turned)));
  await tab.mouse.wheel(0, -400);
  const closer = await picture(tab);
  expect('the wheel zooms', !(await same(turned, closer)));
  await tab.keyboard.press('Shift+ArrowLeft');
  expect('arrows with shift move', !(await same(closer, await picture(tab))));
  await tab.keyboard.press('0');
  expect('0 goes back', await same(still, await picture(tab)));
  await tab.keyboard.press('ArrowLeft');
  await tab.keyboard.press('ArrowRight');
  expect('turning there and back ends where it began', await same(still, await picture(tab)));

  await tab.keyboard.press('g');
  expect('the background changes', !(await same(still, await picture(tab))));
  await tab.click('#open-views');
  expect('the views open', await visible(tab, '#views'));
  await picture(tab, 'views');
  await tab.locator('#views button').nth(2).click();
  await settled(tab);
  expect('a view is chosen', (await pressed(tab, '#views button:nth-child(3)')) === 'true');
  await tab.keyboard.press('Escape');
  expect('escape closes the views', !(await visible(tab, '#views')));

  await tab.keyboard.press('t');
  await picture(tab, 'truth');
  expect('T compares with the truth', (await tab.locator('#tag-second').textContent()) === 'Truth');
  await tab.keyboard.press('ArrowLeft');
  await settled(tab);
  expect('away from the view there is no truth', (await tab.locator('#tag-second').textContent()) === 'After');
  expect('the scale bar shows', await visible(tab, '#scale'));

  await tab.keyboard.press('?');
  expect('help opens', await visible(tab, '#help'));
  await picture(tab, 'help');
  await tab.keyboard.press('Escape');
  expect('help closes', !(await visible(tab, '#help')));

  const unnamed = await tab.evaluate(() => [...document.querySelectorAll('button, select, canvas, [role=slider]')]
    .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label'))).map((e) => e.outerHTML));
  expect('every control has a name', unnamed.length === 0, unnamed.join('\n'));

  await tab.close();
}

// Where the graphics card is slow: what moves is shown with fewer pixels, and then with all of them what a fast one shows.
{
  // A card that does nothing for its fences until a while after each: a slow one, whatever this machine has.
  const slow = () => {
    const status = WebGL2RenderingContext.prototype.getSyncParameter;
    const asked = new WeakMap();
    WebGL2RenderingContext.prototype.getSyncParameter = function(sync, name) {
      if (!asked.has(sync)) asked.set(sync, performance.now());
      return performance.now() - asked.get(sync) < 60 ? this.UNSIGNALED : status.call(this, sync, name);
    };
    globalThis.shown = [];
    addEventListener('DOMContentLoaded', () => new MutationObserver(() => {
      globalThis.shown.push(document.documentElement.dataset.pixels);
    }).observe(document.documentElement, {attributeFilter: ['data-pixels']}));
  };
  const tab = await open(page, {width: SIDE, height: SIDE, before: slow});
  const first = await picture(tab);
  await tab.keyboard.press('ArrowLeft');
  await settled(tab);
  await tab.evaluate(() => { globalThis.shown = []; });
  await tab.keyboard.press('ArrowRight');
  expect('what stops is shown with all pixels, as before', await same(first, await picture(tab, 'slow')));
  const shown = await tab.evaluate(() => globalThis.shown);
  expect('what moves is shown with fewer pixels at first', shown[0] === 'fewer' && shown.at(-1) === 'all', shown.join());
  // What has not changed is not drawn again.
  await tab.evaluate(() => {
    globalThis.shown = [];
    globalThis.draws = 0;
    const draw = WebGL2RenderingContext.prototype.drawElementsInstanced;
    WebGL2RenderingContext.prototype.drawElementsInstanced = function(...what) {
      ++globalThis.draws;
      return draw.apply(this, what);
    };
  });
  await tab.keyboard.press('g');
  await settled(tab);
  expect('another background draws no Gaussian', (await tab.evaluate(() => globalThis.draws)) === 0);
  await tab.close();
}

// A phone: fingers.
{
  const tab = await open(page, {width: 390, height: 844, scale: 3, touch: true});
  const first = await picture(tab, 'phone');
  const touches = await tab.context().newCDPSession(tab);
  const touch = (type, ...points) => touches.send('Input.dispatchTouchEvent',
    {type, touchPoints: points.map(([x, y], id) => ({x, y, id}))});
  await touch('touchStart', [120, 300]);
  await touch('touchMove', [170, 330]);
  await touch('touchEnd');
  const turned = await picture(tab);
  expect('a finger turns', !(await same(first, turned)));
  await touch('touchStart', [150, 400], [250, 400]);
  await touch('touchMove', [100, 400], [300, 400]);
  await touch('touchEnd');
  expect('two fingers zoom', !(await same(turned, await picture(tab))));
  await tab.tap('[data-mode=side]');
  await tab.tap('#lens');
  await picture(tab, 'phone-side-by-side');
  expect('two lenses side by side', await visible(tab, '#ring-second'));
  const wide = await tab.evaluate(() => document.documentElement.scrollWidth > innerWidth ||
    [...document.querySelectorAll('.chrome')].some((e) => e.getBoundingClientRect().right > innerWidth));
  expect('everything fits the phone', !wide);
  await tab.close();
}

// A page with its data beside it.
{
  const one = await open(path.join(large, 'one.html'), {width: SIDE, height: SIDE});
  await one.keyboard.press('i');
  const whole = await picture(one);
  await one.close();

  const folder = path.join(large, 'many.html');
  const many = await open(folder, {width: SIDE, height: SIDE});
  await many.keyboard.press('i');
  const {psnr} = await difference(whole, await picture(many, 'folder'));
  console.log(`a folder against one file: ${psnr.toFixed(2)} dB`);
  expect('a folder shows what one file shows', psnr >= 45, `${psnr.toFixed(2)} dB`);
  await many.close();

  // While its second part is still to come.
  let release;
  const held = new Promise((resolve) => { release = resolve; });
  const context = await browser.newContext({viewport: {width: SIDE, height: SIDE}});
  const tab = await context.newPage();
  tab.setDefaultTimeout(300000);
  await tab.route('**/after-1.js', async (route) => {
    await held;
    await route.continue();
  });
  await tab.goto(pathToFileURL(folder).href, {waitUntil: 'commit'});
  await tab.waitForFunction(() => document.documentElement.dataset.state === 'ready', null, {timeout: 300000});
  await tab.waitForTimeout(1000);
  const share = Number(await tab.evaluate(() => document.documentElement.dataset.arrived));
  expect('a part is shown while others come', share > 0 && share < 1, String(share));
  expect('how much is there is said', /^\d+ % loaded$/.test(await tab.locator('#arriving').textContent()));
  await tab.keyboard.press('i');
  await tab.waitForTimeout(1000);
  const early = await tab.screenshot({path: path.join(out, 'folder-early.png'), timeout: 300000});
  const {psnr: rough} = await difference(whole, early);
  console.log(`with ${Math.round(100 * share)} % of its Gaussians: ${rough.toFixed(2)} dB to all of them`);
  expect('the largest ones give the picture', rough >= 15 && !(await same(whole, early)), `${rough.toFixed(2)} dB`);
  release();
  expect('then the rest comes', (await difference(whole, await picture(tab))).psnr >= 45);
  expect('and no more is said', !(await visible(tab, '#arriving')));
  await context.close();
}

// What goes wrong is said.
async function expectMessage(name, file, pattern, before, cut) {
  const tab = await open(file, {width: 800, height: 600, quiet: false, before, cut});
  // A part may be missed when the others are shown already.
  await tab.waitForFunction(() => document.documentElement.dataset.state === 'error', null, {timeout: 300000}).catch(() => {});
  expect(`${name}: is an error`, (await state(tab)) === 'error');
  const text = await tab.locator('#message').innerText();
  expect(`${name}: says so`, await visible(tab, '#message') && pattern.test(text), text);
  await tab.close();
}
const whole = fs.readFileSync(page, 'latin1');
const at = whole.indexOf('id="after-0">') + 5000;
const broken = (name, text) => {
  const file = path.join(out, `${name}.html`);
  fs.writeFileSync(file, text, 'latin1');
  return file;
};
await expectMessage('damaged data', broken('damaged', `${whole.slice(0, at)}AAAAAAAA${whole.slice(at + 8)}`),
  /cannot be shown/);
await expectMessage('no base64', broken('garbage', `${whole.slice(0, at)}????????${whole.slice(at + 8)}`),
  /cannot be shown/);
await expectMessage('missing part', broken('missing', whole.replace('id="after-0"', 'id="gone"')), /after-0/);
// Cut anywhere: in the head, the style, the page, the data, the code, right before the end.
const guardEnd = whole.indexOf('</script>') + '</script>'.length;
for (const size of [guardEnd, whole.indexOf('<style>') + 500, whole.indexOf('<main') + 20, at,
  whole.indexOf('id="worker-source"') + 100, whole.lastIndexOf('<script>') - 1000, whole.lastIndexOf('</script>')]) {
  await expectMessage(`cut after ${size} bytes`, broken('cut', whole.slice(0, size)), /incomplete/);
}
// Parts that are missing, cut, or another page's.
{
  const folder = path.join(large, 'many.html');
  const part = path.join(large, 'many.data', 'after-1.js');
  const good = fs.readFileSync(part, 'latin1');
  fs.renameSync(part, `${part}.away`);
  await expectMessage('no part', folder, /after-1\.js” is missing/);
  fs.writeFileSync(part, good.slice(0, good.length / 2), 'latin1');
  await expectMessage('a part that was cut', folder, /after-1\.js” is damaged or of another page/, undefined, true);
  fs.writeFileSync(part, good.replace(/"[0-9a-f]{16}"/, '"0123456789abcdef"'), 'latin1');
  await expectMessage('a part of another page', folder, /after-1\.js” is damaged or of another page/);
  fs.renameSync(`${part}.away`, part);
}
await expectMessage('an old browser', page, /Safari 16/, () => { delete globalThis.DecompressionStream; });
await expectMessage('no WebGL 2', page, /WebGL 2/,
  () => { HTMLCanvasElement.prototype.getContext = () => null; });
{
  const tab = await open(page, {width: 800, height: 600, quiet: false});
  await tab.evaluate(() => document.getElementById('canvas').getContext('webgl2')
    .getExtension('WEBGL_lose_context').loseContext());
  await tab.waitForFunction(() => document.documentElement.dataset.state === 'error', null, {timeout: 300000});
  expect('a lost context is said', /graphics card/.test(await tab.locator('#message').innerText()));
  await tab.close();
}

await browser.close();
for (const name of ['damaged', 'garbage', 'missing', 'cut']) fs.rmSync(path.join(out, `${name}.html`));
finish();
