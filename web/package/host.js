'use strict';
// In a worker, behind the script that Emscripten makes (createEngine): the engine and the messages it is asked by. A classic
// script, so that it runs as it is in a browser, from a blob, and as a module of Node.
//
// in   {module: WebAssembly.Module, threads}              first; threads: 1, or as many as a module with threads is to have
//      {compile: url}                                      instead of it: of a module that lies beside this script
//      {id, request, data: [Uint8Array | Blob]}            src/doors/web/engine.h says what a request is; data is one after the other
// out  {id, answer, blocks: [ArrayBuffer]}
//      {id, progress: {task, done, total, note}}
//      {compiled: WebAssembly.Module}
//      {id, crash: text}                                   the engine is gone, and this worker is of no more use
//
// Threads of the module run this script, too: Emscripten's part of it knows them by their name.

const node = typeof module === 'object' && module.require ? module.require('node:worker_threads') : null;
const isThread = node ? node.workerData === 'em-pthread' : self.name.startsWith('em-pthread');
const port = node
  ? {post: (m, t) => node.parentPort.postMessage(m, t), listen: (f) => node.parentPort.on('message', f)}
  : {post: (m, t) => self.postMessage(m, t), listen: (f) => { self.onmessage = (e) => f(e.data); }};

let engine = null;
let asked = null;  // id of the call that runs

async function start(compiled, threads) {
  if (typeof globalThis.crypto === 'undefined') globalThis.crypto = module.require('node:crypto').webcrypto;  // Node 18
  engine = await createEngine({
    threads,
    mainScriptUrlOrBlob: node ? undefined : self.location.href,  // what its threads run
    instantiateWasm(imports, done) {
      WebAssembly.instantiate(compiled, imports).then((instance) => done(instance, compiled));
      return {};
    },
    // The engine may tell as often as it likes: ten times a second are enough for a person.
    tell: (() => {
      let last = 0;
      return (task, done, total, note) => {
        const now = Date.now();
        if (done !== 0 && now - last < 100) return;
        last = now;
        port.post({id: asked, progress: {task, done, total, note}});
      };
    })(),
  });
  engine._anchorsplat_threads(threads);
}

// The engine's memory as it is now: another thread may have made it larger, and a module without threads makes another one.
const bytes = () => (engine.wasmMemory ? new Uint8Array(engine.wasmMemory.buffer) : engine.HEAPU8);

// Addresses are unsigned: the upper half of the memory is negative otherwise.
const address = (pointer) => pointer >>> 0;

const lengthOf = (parts) => parts.reduce((sum, part) => sum + part.length, 0);

// In the engine's memory; 0 where there is not so much of it.
function copied(parts) {
  const begin = address(engine._anchorsplat_allocate(lengthOf(parts) || 1));
  let at = begin;
  if (begin === 0) return 0;
  for (const part of parts) {
    bytes().set(part, at);
    at += part.length;
  }
  return begin;
}

function call(request, data) {
  // Half a character is none of a text that another program could read.
  const whole = (key, value) => (typeof value === 'string' ? value.replace(/\p{Surrogate}/gu, '\ufffd') : value);
  const words = new TextEncoder().encode(JSON.stringify(request, whole));
  const from = copied([words]);
  const at = lengthOf(data) < 2 ** 32 ? copied(data) : 0;
  if (from === 0 || at === 0) {
    if (from !== 0) engine._anchorsplat_free(from);
    if (at !== 0) engine._anchorsplat_free(at);
    const message = 'not enough memory for this splat';
    return {answer: {error: {code: 'io', message}, messages: []}, blocks: []};
  }
  const length = address(engine._anchorsplat_call(from, words.length, at, lengthOf(data)));
  engine._anchorsplat_free(from);
  engine._anchorsplat_free(at);
  const json = address(engine._anchorsplat_json());
  const answer = JSON.parse(new TextDecoder().decode(bytes().slice(json, json + length)));
  const blocks = [];
  for (let k = 0; k < engine._anchorsplat_blocks(); ++k) {
    const begin = address(engine._anchorsplat_block(k));
    blocks.push(bytes().slice(begin, begin + address(engine._anchorsplat_block_bytes(k))).buffer);
  }
  return {answer, blocks};
}

let before = Promise.resolve();  // one after the other, also while a file is being read
if (!isThread) port.listen((message) => {
  before = before.then(async () => {
    asked = message.id;
    try {
      if (message.module) return await start(message.module, message.threads);
      if (message.compile) {
        const response = await fetch(new URL(message.compile, self.location.href));
        if (!response.ok) throw new Error(`${message.compile}: the server says ${response.status}`);
        return port.post({compiled: await WebAssembly.compile(await response.arrayBuffer())});
      }
      const data = await Promise.all(message.data.map(async (part) =>
        (typeof part.arrayBuffer === 'function' ? new Uint8Array(await part.arrayBuffer()) : part)));
      const {answer, blocks} = call(message.request, data);
      port.post({id: message.id, answer, blocks}, blocks);
    } catch (error) {
      port.post({id: message.id, crash: String(error && error.message || error)});
    }
  });
});
