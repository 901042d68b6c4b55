// The npm package under Node, beside the program of this machine: test.mjs PACKAGE REFERENCE MUTANTS
//
// PACKAGE    build/web/npm
// REFERENCE  folder that web_reference may write its answers to; the program is $WEB_REFERENCE
// MUTANTS    what web_mutants has written
// Prints what was measured and every failed expectation; exit code 1 if there is one.
import fs from 'node:fs';
import path from 'node:path';
import {execFileSync} from 'node:child_process';
import {pathToFileURL} from 'node:url';
import {expect, finish} from '../browser.mjs';

const [packageDir, reference, mutants] = process.argv.slice(2).map((p) => path.resolve(p));
const {AnchorsplatError, close, convert, formats, fromColumns, open, readCameras, setThreads} =
  await import(pathToFileURL(path.join(packageDir, 'index.mjs')));
async function refused(name, promise, code) {
  try {
    await promise;
    expect(name, false, 'was taken');
  } catch (error) {
    expect(name, error instanceof AnchorsplatError && error.code === code && error.message.length > 10, `${error.code}: ${error.message}`);
  }
}

const EXAMPLE = 'examples/biplane/input.ply';
const bytes = fs.readFileSync(EXAMPLE);
const cameraFile = 'examples/biplane/transforms_lr.json';

// What this machine's own processor makes of the same requests. A splat's number is the line that made it: they count from 1.
const wordsOf = {filter: ['--method=filter'], network: []};
const requests = [
  {verb: 'open', name: 'input.ply', data: EXAMPLE},
  {verb: 'enhance', cloud: 1, words: wordsOf.filter},
  {verb: 'enhance', cloud: 1, words: wordsOf.network},
  {verb: 'columns', cloud: 1}, {verb: 'columns', cloud: 2}, {verb: 'columns', cloud: 3},
  {verb: 'render', cloud: 1, words: ['--size=512x512', '--orbit=2']},
  {verb: 'render', cloud: 3, words: ['--size=512x512', '--orbit=2']},
  {verb: 'info', cloud: 1},
  ...['ply', 'compressed.ply', 'spz', 'sog', 'splat', 'glb'].map((format) => ({verb: 'write', cloud: 2, format, words: []})),
  {verb: 'edit', cloud: 1, words: ['--action-axes=RDF', '--filter-box=-0.2,-,-,-,-,-', '--up=0.1,0.2,1', '--filter-floaters=0.8']},
  {verb: 'columns', cloud: 4},
];
fs.rmSync(reference, {recursive: true, force: true});
fs.mkdirSync(reference, {recursive: true});
fs.writeFileSync(path.join(reference, 'requests'), requests.map((r) => JSON.stringify(r)).join('\n'));
execFileSync(process.env.WEB_REFERENCE, [path.join(reference, 'requests'), reference]);
const native = requests.map((_, k) => JSON.parse(fs.readFileSync(path.join(reference, `${k}.json`))));
const block = (k, j = 0) => fs.readFileSync(path.join(reference, `${k}-${j}.bin`));
const floats = (buffer) => new Float32Array(buffer.buffer.slice(buffer.byteOffset, buffer.byteOffset + buffer.length));
for (const [k, answer] of native.entries()) expect(`the native answer ${k}`, !answer.error, JSON.stringify(answer.error));

// Largest difference, relative to the larger of the value and 1e-3 of the column's largest; `far`, where given, counts those
// beyond 1e-5.
function apart(a, b, far = {count: 0}) {
  if (a.length !== b.length) return Infinity;
  let top = 0;
  for (const x of a) if (Number.isFinite(x)) top = Math.max(top, Math.abs(x));
  let most = 0;
  for (let i = 0; i < a.length; ++i) {
    if (a[i] === b[i] || (Number.isNaN(a[i]) && Number.isNaN(b[i]))) continue;
    const difference = Math.abs(a[i] - b[i]) / Math.max(Math.abs(a[i]), Math.abs(b[i]), 1e-3 * top);
    if (difference > 1e-5) ++far.count;
    most = Math.max(most, difference);
  }
  return most;
}
function psnr(a, b) {
  if (a.length !== b.length) return -Infinity;
  let sum = 0;
  for (let i = 0; i < a.length; ++i) sum += (a[i] - b[i]) ** 2;
  return sum === 0 ? Infinity : -10 * Math.log10(sum / a.length);
}
const NAMES = ['means', 'logScales', 'quats', 'opacityLogits', 'sh'];
async function compareColumns(what, splat, k) {
  const columns = await splat.columns();
  const far = {count: 0};
  let most = 0;
  let values = 0;
  for (const [j, name] of NAMES.entries()) {
    most = Math.max(most, apart(columns[name], floats(block(k, j)), far));
    values += columns[name].length;
  }
  console.log(`${what}: ${splat.count} Gaussians, largest relative difference from native ${most.toExponential(1)}, ` +
    `beyond 1e-5 in ${far.count} of ${values} values`);
  return {most, far: far.count / values};
}

setThreads(1);
const splat = await open(bytes, {name: 'input.ply'});
expect('it is read bit by bit', (await compareColumns('read', splat, 3)).most === 0);
const info = await splat.info();
const theirs = native[8];
expect('info says the same', info.gaussians === theirs.gaussians && info.format === theirs.format &&
  info.looks_in_words === theirs.looks_in_words && info.treatment.method === theirs.treatment.method &&
  JSON.stringify(info.problems) === JSON.stringify(theirs.problems));
// What a reading goes by has limits that a Gaussian is on either side of, which hangs on last bits; a reading is sure of a fifth.
expect('info reads the same', info.reading.looks === theirs.reading.looks && Math.abs(info.reading.pixel / theirs.reading.pixel - 1) < 1e-2,
  `${info.reading.pixel} ${theirs.reading.pixel}`);

const cropped = [{filterBox: [-0.2, null, null, null, null, null]}, {up: [0.1, 0.2, 1]}, {filterFloaters: 0.8}];
const edited = await splat.edit(cropped);
expect('edits take away the same', JSON.stringify(edited.actions) === JSON.stringify(native[15].actions) && edited.actions[0].taken > 0,
  JSON.stringify(edited.actions));
expect('what would be taken away is the same', JSON.stringify(await splat.countEdits(cropped)) === JSON.stringify(edited.actions));
expect('edited as native', (await compareColumns('edited', edited.splat, 16)).most <= 1e-6);
expect('the world moves as native', edited.world.rotation.every((x, k) => Math.abs(x - native[15].world.rotation[k]) < 1e-12));
await refused('an edit of nothing', splat.edit({filterBox: [9, 9, 9, 10, 10, 10]}), 'bad_argument');
await refused('edits that are none', splat.edit('--up=z'), 'bad_argument');

const progress = [];
const {splat: filtered} = await splat.enhance({method: 'filter'});
expect('the filter is the native one', (await compareColumns('filter', filtered, 4)).most <= 1e-5);
const began = performance.now();
const {splat: sharp, report} = await splat.enhance({onProgress: (p) => progress.push(p)});
const seconds = (performance.now() - began) / 1000;
expect('the default is the network', report.method === native[2].report.method, report.method);
expect('progress was told', progress.length > 0);
// Which copies are merged hangs on the last bits of exp(), which is the C library's: now and then it is another one.
const more = Math.abs(sharp.count - native[2].gaussians);
console.log(`default: ${sharp.count} Gaussians, ${native[2].gaussians} native`);
expect('the network makes as many', more <= 1e-3 * sharp.count, `${sharp.count} ${native[2].gaussians}`);
if (more === 0) {
  // What is near zero beside the rest of its row, a part of a quaternion or a logit, has fewer digits that agree.
  const {most, far} = await compareColumns('default', sharp, 5);
  expect('the network is the native one', far <= 1e-3 && most <= 1e-2, `${far} ${most}`);
}
console.log(`default: ${seconds.toFixed(2)} s, ${native[2].seconds.toFixed(2)} s native on one thread with SSE4: ` +
  `${(seconds / native[2].seconds).toFixed(2)} times`);
for (const [what, of, k, least] of [['input', splat, 6, 80], ['enhanced', sharp, 7, 80]]) {
  const picture = await of.render({size: [512, 512], orbit: 2});
  const same = psnr(picture.pixels, floats(block(k)));
  console.log(`render of the ${what}: ${same.toFixed(1)} dB from native`);
  expect(`a render of the ${what} is the native one`, same >= least, String(same));
}

// Files: what either writes, the other reads alike.
for (const [k, format] of ['ply', 'compressed.ply', 'spz', 'sog', 'splat', 'glb'].entries()) {
  const ours = await filtered.write(format);
  const other = block(9 + k);
  const [a, b] = await Promise.all([open(ours, {format}), open(other, {format})]);
  const [x, y] = [await a.columns(), await b.columns()];
  let most = 0;
  let differing = 0;
  for (const name of NAMES) {
    most = Math.max(most, apart(x[name], y[name]));
    for (let i = 0; i < x[name].length; ++i) differing += x[name][i] !== y[name][i] ? 1 : 0;
  }
  const same = Buffer.compare(Buffer.from(ours), other) === 0;
  console.log(`${format}: ${same ? 'the same bytes' : `${differing} values differ, by ${most.toExponential(1)} at most`}`);
  expect(`${format} holds the same`, same || differing <= 1e-3 * 59 * filtered.count, `${differing} values`);
  await a.close();
  await b.close();
}

// The rest of what the package promises.
const again = await fromColumns(await splat.columns());
expect('columns make the same splat', Buffer.compare(Buffer.from(await again.write('ply')), Buffer.from(await splat.write('ply'))) === 0);
expect('convert makes a file', (await open(await convert(bytes, {to: 'spz', name: 'x.ply'}))).format === 'SPZ');
expect('formats are listed', (await formats()).some(({name, writes}) => name === 'SPZ' && writes));
const cameras = await readCameras({name: 'transforms.json', data: fs.readFileSync(cameraFile)});
const {report: withCameras} = await splat.enhance({method: 'filter', cameras});
expect('cameras are used', withCameras.pixel_size.source === 'cameras', JSON.stringify(withCameras.pixel_size));
expect('a page is one', Buffer.from((await sharp.page({before: splat})).slice(0, 15)).toString() === '<!DOCTYPE html>');
await refused('an option that there is not', splat.enhance({sharpness: 2}), 'bad_argument');
await refused('help', splat.enhance({help: true}), 'bad_argument');

// What a program may get wrong is an error with a sentence, and nothing goes on waiting.
const detached = new Uint8Array(8);
structuredClone(detached, {transfer: [detached.buffer]});
const late = await open(bytes);
await late.close();
for (const [name, wrong] of Object.entries({
  'no bytes': () => open(), 'text for bytes': () => open('x'), 'options that are none': () => open(bytes, 'x'), 'bytes that were given away': () => open(detached),
  'no columns': () => fromColumns(), 'columns that are none': () => fromColumns({}), 'no camera files': () => readCameras(), 'convert to nothing': () => convert(bytes),
  'cameras that are none': () => splat.enhance({cameras: {}}), 'a signal that is none': () => splat.enhance({signal: 5}), 'progress that is no function': () => splat.render({onProgress: 1}),
  'cameras of a picture that are none': () => splat.render({cameras: {}}), 'a splat before that is none': () => splat.page({before: {}}), 'a splat before that is closed': () => splat.page({before: late}),
  'a format that is no word': () => splat.write(3),
})) await refused(name, wrong(), 'bad_argument');
expect('options that are null are none', (await (await open(bytes, null)).info()).gaussians === 20000);
expect('half a character in a name', (await open(bytes, {name: 'a\ud800.ply'})).count === 20000);
const mine = new Error('mine');
expect('what a listener throws comes back', await splat.enhance({onProgress() { throw mine; }}).catch((error) => error) === mine);

// Every option that the types name is one that the engine knows.
const types = fs.readFileSync(path.join(packageDir, 'index.d.mts'), 'utf8');
for (const [kind, ask] of [['Enhance', (o) => splat.enhance(o)], ['Write', (o) => splat.write('ply', o)], ['Render', (o) => splat.render(o)], ['Page', (o) => splat.page(o)]]) {
  const [, body] = types.match(new RegExp(`interface ${kind}Options {([^}]*)}`));
  const keys = [...body.matchAll(/^ {2}(\w+)\?:/gm)].map(([, key]) => key).filter((key) => !/^(cameras|before|signal|on[A-Z].*)$/.test(key));
  expect(`${kind}Options are read`, keys.length > 1, String(keys));
  for (const key of keys) {
    const answer = await ask({[key]: '@'}).catch((error) => error.message);
    expect(`${kind}Options: ${key}`, !/not expected/.test(answer), answer);
  }
}
await refused('a format that there is not', splat.write('jpg'), 'bad_argument');
await refused('a file that is none', open(new Uint8Array(1000), {name: 'x.ply'}), 'bad_file');
await refused('an empty file', open(new Uint8Array(0), {name: 'x.ply'}), 'bad_file');
const stop = new AbortController();
const stopping = splat.enhance({quality: 'good', signal: stop.signal});
setTimeout(() => stop.abort(), 300);
await refused('what was stopped', stopping, 'interrupted');
expect('a splat is there after a stop', (await splat.info()).gaussians === splat.count);
await again.close();
await refused('a splat that was closed', again.info(), 'bad_argument');

// Threads change no bit, however many there are.
const wanted = {network: Buffer.from(await sharp.write('ply')), pictures: (await sharp.render({size: [512, 512], orbit: 2})).pixels};
await close();
for (const threads of [2, 5]) {
  setThreads(threads);
  const other = await open(bytes, {name: 'input.ply'});
  const since = performance.now();
  const {splat: made} = await other.enhance();
  const took = (performance.now() - since) / 1000;
  console.log(`default with ${threads} threads: ${took.toFixed(2)} s, ${(seconds / took).toFixed(2)} times as quick as with one`);
  expect(`${threads} threads make the same splat`, Buffer.compare(Buffer.from(await made.write('ply')), wanted.network) === 0);
  expect(`${threads} threads render the same`, apart((await made.render({size: [512, 512], orbit: 2})).pixels, wanted.pictures) === 0);
  const halt = new AbortController();
  setTimeout(() => halt.abort(), 300);
  await refused(`${threads} threads that were stopped`, other.enhance({quality: 'good', signal: halt.signal}), 'interrupted');
  await close();
}
setThreads(1);
const home = await open(bytes, {name: 'input.ply'});

// Damaged files: each is read or refused with a sentence, and the engine that has read them is the same one at the end.
const damaged = fs.readFileSync(mutants);
let taken = 0;
let refusals = 0;
for (let at = 0; at + 4 <= damaged.length;) {
  const length = damaged.readUInt32LE(at);
  const file = new Uint8Array(damaged.subarray(at + 4, at + 4 + length));
  at += 4 + length;
  try {
    const read = await open(file);
    ++taken;
    await read.close();
  } catch (error) {
    ++refusals;
    if (!(error instanceof AnchorsplatError) || error.code === 'crashed' || /should not be/.test(error.message)) {
      expect('a damaged file is an error', false, `${error.code}: ${error.message} (byte ${at})`);
      if (error.code === 'crashed') fs.writeFileSync(path.join(reference, `crash-${at}.bin`), file);
    }
  }
}
console.log(`${taken + refusals} damaged files: ${refusals} refused with a sentence, ${taken} read`);
expect('damaged files were tried', refusals > 100);
expect('the engine lives on', (await home.info()).gaussians === home.count);
await close();
finish();
