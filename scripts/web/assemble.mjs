// Puts what was compiled together: assemble.mjs MODULE_DIR NOTICES_DIR OUT
//
//   OUT/dist     the page: index.html with all of it inside; sw.js for where it is hosted, and the engine with threads for
//                hosts that isolate it from other origins
//   OUT/npm      the package `anchorsplat`
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';
import {fileURLToPath} from 'node:url';

const [moduleDir, noticesDir, out] = process.argv.slice(2);
const source = path.join(path.dirname(fileURLToPath(import.meta.url)), '../..');
const read = (...parts) => fs.readFileSync(path.join(source, ...parts), 'utf8');
const version = read('CMakeLists.txt').match(/project\(anchorsplat VERSION ([0-9.]+)/)[1];
const engineOf = (name) => ({
  wasm: fs.readFileSync(path.join(moduleDir, `${name}.wasm`)),
  worker: `${fs.readFileSync(path.join(moduleDir, `${name}.js`), 'utf8')}\n${read('web/package/host.js')}`,
});
const {wasm, worker} = engineOf('engine');
const threads = engineOf('engine-threads');
const client = read('web/package/client.js');
const notices = fs.readdirSync(noticesDir).sort()
  .map((name) => `${name}\n${'='.repeat(name.length)}\n\n${fs.readFileSync(path.join(noticesDir, name), 'utf8').trim()}\n`)
  .join('\n\n');
const linked = `anchorsplat is under the Apache licence 2.0. Its module for WebAssembly contains these libraries:\n\n${notices}`;

function fresh(name) {
  const folder = path.join(out, name);
  fs.rmSync(folder, {recursive: true, force: true});
  fs.mkdirSync(folder, {recursive: true});
  return (file, content) => fs.writeFileSync(path.join(folder, file), content);
}

function filled(template, values) {
  return template.replace(/\{\{(\w+)\}\}/g, (mark, key) => {
    if (!(key in values)) throw new Error(`nothing is known for ${mark}`);
    return values[key];
  });
}

// A script inside of HTML must not look as if it ended.
function inline(text, name) {
  if (/<\/script|<!--/i.test(text)) throw new Error(`${name} cannot stand inside of a page`);
  return text;
}
const escaped = (text) => text.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');

const page = fresh('dist');
page('index.html', filled(read('web/page/index.html'), {
  style: read('web/page/page.css'),
  version,
  notices: escaped(linked),
  module: zlib.deflateSync(wasm, {level: 9}).toString('base64'),
  worker: inline(worker, 'the worker'),
  client: inline(client.replace(/^export /gm, ''), 'client.js'),
  app: inline(read('web/page/app.js'), 'app.js'),
  edit: inline(read('web/page/edit.js'), 'edit.js'),
}));
page('sw.js', filled(read('web/page/sw.js'), {version}));
page('worker-threads.js', threads.worker);
page('engine-threads.wasm', threads.wasm);

const npm = fresh('npm');
npm('package.json', `${JSON.stringify({...JSON.parse(read('web/package/package.json')), version}, null, 2)}\n`);
npm('index.mjs', read('web/package/index.mjs'));
npm('index.d.mts', read('web/package/index.d.mts'));
npm('client.mjs', client);
npm('worker.js', worker);
npm('engine.wasm', wasm);
npm('worker-threads.js', threads.worker);
npm('engine-threads.wasm', threads.wasm);
npm('README.md', read('web/package/README.md'));
npm('LICENSE', read('LICENSE'));
npm('NOTICES', linked);

const kilobytes = (bytes) => `${Math.round(bytes / 1000).toLocaleString('en')} kB`;
const compressed = (of) => kilobytes(zlib.gzipSync(Buffer.concat([of.wasm, Buffer.from(of.worker)]), {level: 9}).length);
console.log(`web: module ${kilobytes(wasm.length)}, with its script and compressed ${compressed({wasm, worker})}, ` +
  `${compressed(threads)} with threads; ` +
  `page ${kilobytes(fs.statSync(path.join(out, 'dist/index.html')).size)}`);
