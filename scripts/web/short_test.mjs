// A few seconds of the npm package under Node, for `make test`: short_test.mjs PACKAGE
//
// PACKAGE  build/web/npm, as `make npm` leaves it. Exit code 77 where it is not there: the test did not run.
// What it does is compared with the native program by test.mjs, in `make web-test`.
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';
import {expect, finish} from '../browser.mjs';

const index = path.resolve(process.argv[2], 'index.mjs');
if (!fs.existsSync(index)) {
  console.log(`${index} is not there: make npm makes it`);
  process.exit(77);
}
const {AnchorsplatError, close, open, setThreads} = await import(pathToFileURL(index));
const bytes = fs.readFileSync('examples/biplane/input.ply');
setThreads(1);
const splat = await open(bytes, {name: 'input.ply'});
expect('a splat is read', splat.count === 20000 && splat.shDegree === 3, `${splat.count} ${splat.shDegree}`);
const {splat: sharp, report} = await splat.enhance();
expect('it is enhanced by the network', report.method === 'model' && sharp.count > 3 * splat.count, `${report.method} ${sharp.count}`);
const again = await open(await sharp.write('spz'));
expect('what is written is read', again.count === sharp.count && again.format === 'SPZ', `${again.count} ${again.format}`);
const {pixels} = await sharp.render({size: [64, 64], orbit: 1});
expect('a render shows it', pixels.some((value) => value > 0.1) && pixels.every(Number.isFinite));
for (const [name, damaged] of [['half of a file', bytes.subarray(0, bytes.length / 2)], ['no splat', bytes.subarray(1000, 2000)]]) {
  const error = await open(damaged, {name: 'damaged.ply'}).catch((why) => why);
  expect(`${name} is refused`, error instanceof AnchorsplatError && error.code === 'bad_file', String(error.message));
}
await close();
finish();
