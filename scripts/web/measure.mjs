// How long the package takes under Node, and how much memory: measure.mjs PACKAGE SPLAT GAUSSIANS [METHOD]
//
// Copies of SPLAT side by side are one splat of about so many GAUSSIANS; METHOD is a --method of enhance, or its default.
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [packageDir, file, wanted, method] = process.argv.slice(2);
const {close, fromColumns, open} = await import(pathToFileURL(path.resolve(packageDir, 'index.mjs')));
const one = await (await open(fs.readFileSync(file), {name: file})).columns();
const copies = Math.max(1, Math.round(Number(wanted) / one.count));
const side = Math.ceil(Math.sqrt(copies));
const repeated = (values) => {
  const all = new Float32Array(copies * values.length);
  for (let k = 0; k < copies; ++k) all.set(values, k * values.length);
  return all;
};
const means = repeated(one.means);
for (let k = 0; k < copies; ++k) {
  for (let i = 0; i < one.count; ++i) {
    means[3 * (k * one.count + i)] += 3 * (k % side);
    means[3 * (k * one.count + i) + 2] += 3 * Math.floor(k / side);
  }
}
await close();

const seconds = async (work) => {
  const began = performance.now();
  const result = await work();
  return [result, ((performance.now() - began) / 1000).toFixed(1)];
};
const megabytes = () => `${Math.round(process.resourceUsage().maxRSS / 1000).toLocaleString('en')} MB at most so far`;
const splat = await fromColumns({...one, count: copies * one.count, means, logScales: repeated(one.logScales),
  quats: repeated(one.quats), opacityLogits: repeated(one.opacityLogits), sh: repeated(one.sh)});
let told = 0;
const [{splat: made, report}, enhancing] = await seconds(() =>
  splat.enhance({...(method ? {method} : {}), onProgress: () => { ++told; }}));
console.log(`${splat.count} Gaussians by ${report.method}: ${made.count} after ${enhancing} s, ${told} words of progress, ${megabytes()}`);
const [bytes, writing] = await seconds(() => made.write('spz'));
console.log(`written as SPZ: ${Math.round(bytes.length / 1e6)} MB in ${writing} s, ${megabytes()}`);
await close();
