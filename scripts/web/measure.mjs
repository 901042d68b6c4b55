// Figures of what `make web` made in headless Chromium, beside this machine's own program: measure.mjs WEB SPLAT WORK [WHAT...]
//
// WEB     build/web
// SPLAT   a splat of 20,000 Gaussians; larger ones are copies of it side by side
// WORK    folder for what is made on the way
// WHAT    page, 20k, 500k, 3M, threads (20k and 500k with threads); all of them unless some are named
// $WEB_REFERENCE is the program: one thread, no wider vectors than WebAssembly has. Let nothing else run.
import fs from 'node:fs';
import path from 'node:path';
import {execFileSync} from 'node:child_process';
import {pathToFileURL} from 'node:url';
import {ISOLATED, expect, finish, launchBrowser, serve, watchedTab} from '../browser.mjs';

const [web, splat, work] = process.argv.slice(2, 5).map((p) => path.resolve(p));
const chosen = process.argv.slice(5);
const wanted = (what) => chosen.length === 0 || chosen.includes(what);
fs.mkdirSync(work, {recursive: true});
const number = (value) => value.toLocaleString('en');
const seconds = (value) => `${value.toFixed(value < 10 ? 2 : 1)} s`;
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

// Copies of the splat side by side.
function tiled(count) {
  const file = path.join(work, `${count}.ply`);
  if (!fs.existsSync(file)) execFileSync('scripts/tile-splat.py', [splat, file, String(count)]);
  return file;
}

// Of the processes that draw pages and run their workers, the most memory that one has had.
function mostMemory() {
  let most = 0;
  for (const pid of fs.readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      if (!fs.readFileSync(`/proc/${pid}/cmdline`, 'utf8').includes('--type=renderer')) continue;
      most = Math.max(most, Number(fs.readFileSync(`/proc/${pid}/status`, 'utf8').match(/VmHWM:\s+(\d+)/)[1]) * 1024);
    } catch {
      // it is gone
    }
  }
  return most;
}

// Reads, enhances and writes in a page: as often as `repeat` says, the median of the times.
async function inBrowser(file, {words, repeat = 1, isolated = false}) {
  fs.writeFileSync(path.join(work, 'index.html'), '<!DOCTYPE html><link rel="icon" href="data:,"><title>measure</title>');
  const {home, close} = await serve((name) => (name === '/' ? path.join(work, 'index.html') : name === '/splat.ply' ? file
    : path.join(web, 'npm', path.basename(name))), isolated ? ISOLATED : {});
  const browser = await launchBrowser();
  const tab = await watchedTab(browser, {console: false});
  tab.setDefaultTimeout(0);
  await tab.goto(home);
  const runs = [];
  for (let k = 0; k < repeat; ++k) {
    runs.push(await tab.evaluate(async (options) => {
      const {close, open} = await import('./index.mjs');
      const timed = async (call) => {
        const began = performance.now();
        return [await call(), (performance.now() - began) / 1000];
      };
      try {
        const file = await (await fetch('splat.ply')).blob();
        const [read, reading] = await timed(() => open(file, {name: 'splat.ply'}));
        let told = 0;
        const [{splat, report}, enhancing] = await timed(() => read.enhance({...options, onProgress: () => { ++told; }}));
        const [bytes, writing] = await timed(() => splat.write('spz'));
        const answer = {reading, enhancing, writing, told, method: report.method, before: read.count, count: splat.count, bytes: bytes.length};
        await close();
        return answer;
      } catch (error) {
        await close();
        return {error: error.message};
      }
    }, words));
  }
  const memory = mostMemory();
  await browser.close();
  close();
  const failed = runs.find((run) => run.error);
  if (failed) return {...failed, memory};
  return {...runs[0], ...Object.fromEntries(['reading', 'enhancing', 'writing'].map((name) => [name, median(runs.map((run) => run[name]))])), memory};
}

// The same by the program: from its own clock around each request.
function native(file, {method}, repeat = 1) {
  const requests = [{verb: 'open', name: 'splat.ply', data: file},
    {verb: 'enhance', cloud: 1, words: method ? [`--method=${method}`] : []}, {verb: 'write', cloud: 2, format: 'spz', words: []}];
  fs.writeFileSync(path.join(work, 'requests'), requests.map((r) => JSON.stringify(r)).join('\n'));
  const runs = [];
  for (let k = 0; k < repeat; ++k) {
    execFileSync(process.env.WEB_REFERENCE, [path.join(work, 'requests'), work]);
    runs.push(requests.map((_, j) => JSON.parse(fs.readFileSync(path.join(work, `${j}.json`)))));
    for (const name of fs.readdirSync(work)) if (/^\d+-\d+\.bin$/.test(name)) fs.rmSync(path.join(work, name));
  }
  const wrong = runs[0].find((answer) => answer.error);
  if (wrong) throw new Error(wrong.error.message);
  return runs[0].map((_, j) => median(runs.map((run) => run[j].seconds)));
}

function tell(what, run, theirs) {
  if (run.error) return void console.log(`${what}: refused: ${run.error} (${Math.round(run.memory / 1e6)} MB)`);
  const beside = (mine, other) => (other ? `${seconds(mine)} (native ${seconds(other)}, ${(mine / other).toFixed(2)} times)` : seconds(mine));
  const [read, enhance, write] = theirs ?? [];
  console.log(`${what}: ${number(run.before)} Gaussians by ${run.method} are ${number(run.count)}: read ${beside(run.reading, read)}, ` +
    `enhance ${beside(run.enhancing, enhance)}, write SPZ ${beside(run.writing, write)}; ${run.told} words of progress, ` +
    `${number(Math.round(run.memory / 1e6))} MB at most`);
}

async function measurePage() {
  const browser = await launchBrowser();
  const tab = await watchedTab(await browser.newContext({viewport: {width: 1200, height: 800}}), {hushed: /autofocus/i});
  const ready = [];
  for (let k = 0; k < 5; ++k) {
    await tab.goto(pathToFileURL(path.join(web, 'dist/index.html')).href);
    await tab.waitForFunction(() => document.documentElement.dataset.readyAfter);
    ready.push(Number(await tab.evaluate(() => document.documentElement.dataset.readyAfter)));
  }
  console.log(`page: can be used ${median(ready)} ms after it was opened (${Math.max(...ready)} ms at most)`);
  await tab.setInputFiles('#file', splat);
  await tab.waitForFunction(() => document.documentElement.dataset.state === 'shown' || document.documentElement.dataset.trouble);
  const stage = tab.frames().find((frame) => frame !== tab.mainFrame());
  await stage.waitForFunction(() => document.documentElement.dataset.settled === 'true');
  // The stage's clock when it has drawn what a step asked for.
  await stage.evaluate(() => {
    globalThis.drawn = [];
    const {dataset} = document.documentElement;
    let last = dataset.drawnWidening;
    new MutationObserver(() => {
      if (dataset.drawnWidening === last) return;
      last = dataset.drawnWidening;
      const context = document.getElementById('canvas').getContext('webgl2');
      context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));  // waits for the graphics card
      globalThis.drawn.push(performance.timeOrigin + performance.now());
    }).observe(document.documentElement, {attributeFilter: ['data-drawn-widening']});
  });
  const own = [];
  const whole = [];
  for (let k = 0; k < 20; ++k) {
    const {began, took} = await tab.evaluate((value) => {
      const slider = document.getElementById('pixel');
      const began = performance.now();
      slider.value = String(value);
      slider.dispatchEvent(new Event('input', {bubbles: true}));
      return {began: performance.timeOrigin + began, took: performance.now() - began};
    }, -1 + 0.1 * k);
    await stage.waitForFunction((count) => globalThis.drawn.length > count, k);
    own.push(took);
    whole.push((await stage.evaluate(() => globalThis.drawn.at(-1))) - began);
  }
  const stopped = performance.now();
  await stage.waitForFunction(() => document.documentElement.dataset.settled === 'true');
  console.log(`slider: ${median(own).toFixed(1)} ms of the page per step; ${median(whole).toFixed(0)} ms until its picture on a page of ` +
    `1200×800 is drawn, by software (${Math.max(...whole).toFixed(0)} ms at most); ` +
    `all pixels ${(performance.now() - stopped).toFixed(0)} ms after the last`);
  expect('the page can be used after a second', median(ready) <= 1000, `${median(ready)} ms`);
  await browser.close();
}

if (wanted('page')) await measurePage();
if (wanted('20k')) {
  const run = await inBrowser(splat, {words: {}, repeat: 3});
  const theirs = native(splat, {}, 3);
  tell('20k', run, theirs);
  expect('20k by default in 3 s and 3 times', !run.error && run.enhancing <= 3 && run.enhancing <= 3 * theirs[1]);
}
if (wanted('500k')) {
  const file = tiled(500000);
  const run = await inBrowser(file, {words: {method: 'model'}});
  tell('500k', run, native(file, {method: 'model'}));
  expect('500k by the network in 2 GB, with progress', !run.error && run.memory <= 2e9 && run.told > 10);
}
if (wanted('3M')) {
  const file = tiled(3000000);
  tell('3M', await inBrowser(file, {words: {method: 'filter'}}), native(file, {method: 'filter'}));
  const refused = await inBrowser(file, {words: {}});
  console.log(`3M by default: ${refused.error}`);
  expect('3M by default is refused before it starts', /WebAssembly has 4 GB/.test(refused.error ?? ''), refused.error);
}
if (wanted('threads')) {
  tell('20k with threads', await inBrowser(splat, {words: {}, repeat: 3, isolated: true}));
  tell('500k with threads', await inBrowser(tiled(500000), {words: {method: 'model'}, isolated: true}));
}
finish();
