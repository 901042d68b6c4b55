'use strict';
// In a worker, behind the script that Emscripten makes (createEngine): the engine and the messages it is asked by. A classic
// script, so that it runs as it is in a browser, from a blob, and as a module of Node.
//
// in   {module: WebAssembly.Module}                        first
//      {id, request, data: [Uint8Array | Blob]}            src/web/engine.h says what a request is; data is one after the other
// out  {id, answer, blocks: [ArrayBuffer]}
//      {id, progress: {task, done, total, note}}
//      {id, crash: text}                                   the engine is gone, and this worker is of no more use

const port = (() => {
  if (typeof importScripts === 'function') return {post: (m, t) => self.postMessage(m, t), listen: (f) => { self.onmessage = (e) => f(e.data); }};
  const {parentPort} = module.require('node:worker_threads');
  return {post: (m, t) => parentPort.postMessage(m, t), listen: (f) => parentPort.on('message', f)};
})();

let engine = null;
let asked = null;  // id of the call that runs

async function start(compiled) {
  if (typeof globalThis.crypto === 'undefined') globalThis.crypto = module.require('node:crypto').webcrypto;  // Node 18
  engine = await createEngine({
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
}

// Addresses are unsigned: the upper half of the memory is negative otherwise.
const address = (pointer) => pointer >>> 0;

const lengthOf = (parts) => parts.reduce((sum, part) => sum + part.length, 0);

// In the engine's memory; 0 where there is not so much of it.
function copied(parts) {
  const begin = address(engine._anchorsplat_allocate(lengthOf(parts) || 1));
  let at = begin;
  if (begin === 0) return 0;
  for (const part of parts) {
    engine.HEAPU8.set(part, at);
    at += part.length;
  }
  return begin;
}

function call(request, data) {
  const words = new TextEncoder().encode(JSON.stringify(request));
  const from = copied([words]);
  const at = lengthOf(data) < 2 ** 32 ? copied(data) : 0;
  if (from === 0 || at === 0) {
    if (from !== 0) engine._anchorsplat_free(from);
    if (at !== 0) engine._anchorsplat_free(at);
    const message = 'there is not enough memory for this splat';
    return {answer: {error: {code: 'io', message}, messages: []}, blocks: []};
  }
  const length = address(engine._anchorsplat_call(from, words.length, at, lengthOf(data)));
  engine._anchorsplat_free(from);
  engine._anchorsplat_free(at);
  const json = address(engine._anchorsplat_json());
  const answer = JSON.parse(new TextDecoder().decode(engine.HEAPU8.slice(json, json + length)));
  const blocks = [];
  for (let k = 0; k < engine._anchorsplat_blocks(); ++k) {
    const begin = address(engine._anchorsplat_block(k));
    blocks.push(engine.HEAPU8.slice(begin, begin + address(engine._anchorsplat_block_bytes(k))).buffer);
  }
  return {answer, blocks};
}

let before = Promise.resolve();  // one after the other, also while a file is being read
port.listen((message) => {
  before = before.then(async () => {
    asked = message.id;
    try {
      if (message.module) return await start(message.module);
      const data = await Promise.all(message.data.map(async (part) =>
        (typeof part.arrayBuffer === 'function' ? new Uint8Array(await part.arrayBuffer()) : part)));
      const {answer, blocks} = call(message.request, data);
      port.post({id: message.id, answer, blocks}, blocks);
    } catch (error) {
      port.post({id: message.id, crash: String(error && error.message || error)});
    }
  });
});
