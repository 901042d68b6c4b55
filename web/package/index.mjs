// The package's door: the engine of this process or page, made when it is first needed. index.d.ts says what there is.
import {AnchorsplatError, Engine, Splat} from './client.mjs';

export {AnchorsplatError, Splat};

const isNode = typeof process !== 'undefined' && process.versions != null && process.versions.node != null;

const nodePlatform = {
  async compile() {
    const {readFile} = await import('node:fs/promises');
    return WebAssembly.compile(await readFile(new URL('./engine.wasm', import.meta.url)));
  },
  spawn() {
    const worker = new nodeWorker(new URL('./worker.js', import.meta.url));
    worker.unref();  // a program that waits for nothing may end
    return {
      post: (message, transfer) => worker.postMessage(message, transfer),
      onMessage: (f) => worker.on('message', f),
      onFailure: (f) => worker.on('error', (error) => f(error.message)),
      end: () => { worker.terminate(); },
      hold: () => worker.ref(),
      release: () => worker.unref(),
    };
  },
};

const browserPlatform = {
  async compile() {
    const response = await fetch(new URL('./engine.wasm', import.meta.url));
    if (!response.ok) throw new AnchorsplatError({code: 'not_found', message: `engine.wasm: the server says ${response.status}`});
    return WebAssembly.compile(await response.arrayBuffer());
  },
  spawn() {
    const worker = new Worker(new URL('./worker.js', import.meta.url));
    return {
      post: (message, transfer) => worker.postMessage(message, transfer),
      onMessage: (f) => { worker.onmessage = (event) => f(event.data); },
      onFailure: (f) => { worker.onerror = (event) => f(event.message || 'the worker could not be started'); },
      end: () => worker.terminate(),
      hold() {},
      release() {},
    };
  },
};

const nodeWorker = isNode ? (await import('node:worker_threads')).Worker : null;
let shared = null;
const engine = () => (shared ??= new Engine(isNode ? nodePlatform : browserPlatform));

// A splat file of any format that anchorsplat reads.
export const open = (data, options) => engine().open(data, options);
export const fromColumns = (columns) => engine().fromColumns(columns);
export const readCameras = (files) => engine().readCameras(files);
export const formats = () => engine().formats();

// One file in, another one out.
export async function convert(data, {to, from, name, ...options}) {
  const splat = await open(data, {format: from, name});
  try {
    return await splat.write(to, options);
  } finally {
    await splat.close();
  }
}

// Ends the engine and gives its memory back; the next call starts another one.
export async function close() {
  const ended = shared;
  shared = null;
  if (ended) await ended.close();
}
