// The package's door: the engine of this process or page, made when it is first needed. index.d.mts says what there is.
import {AnchorsplatError, Engine, Splat} from './client.mjs';

export {AnchorsplatError, Splat};

const isNode = typeof process !== 'undefined' && process.versions != null && process.versions.node != null;

// Threads that were asked for; null: as many as are good for it.
let wanted = null;
const MOST = 16;
function threadsOf(mayHave, processors) {
  if (!mayHave) return 1;
  return Math.max(1, Math.min(MOST, wanted ?? Math.min(8, processors)));
}
// Each address as it is written, so that bundlers see it.
const moduleOf = (threads) => (threads > 1 ? new URL('./engine-threads.wasm', import.meta.url) : new URL('./engine.wasm', import.meta.url));

const nodePlatform = {
  async compile() {
    const {readFile} = await import('node:fs/promises');
    const {availableParallelism, cpus} = await import('node:os');
    const threads = threadsOf(true, availableParallelism ? availableParallelism() : cpus().length);
    return {module: await WebAssembly.compile(await readFile(moduleOf(threads))), threads};
  },
  spawn(threads) {
    const worker = new nodeWorker(threads > 1 ? new URL('./worker-threads.js', import.meta.url) : new URL('./worker.js', import.meta.url));
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
    // Memory that threads share is for pages that are isolated from other origins.
    const threads = threadsOf(globalThis.crossOriginIsolated === true, navigator.hardwareConcurrency || 1);
    const url = moduleOf(threads);
    const response = await fetch(url);
    if (!response.ok) throw new AnchorsplatError({code: 'not_found', message: `${url.pathname}: the server says ${response.status}`});
    return {module: await WebAssembly.compile(await response.arrayBuffer()), threads};
  },
  spawn(threads) {
    const worker = threads > 1 ? new Worker(new URL('./worker-threads.js', import.meta.url)) : new Worker(new URL('./worker.js', import.meta.url));
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

// Threads that the engine may use, from the next one on: close() ends the one that there is. 1: the module without threads.
// Results do not depend on it. Unless told otherwise, as many as there are processors, and 8 at most; a page that is not
// isolated from other origins has one.
export function setThreads(threads) {
  if (threads !== null && !(Number.isInteger(threads) && threads >= 1 && threads <= MOST)) {
    throw new AnchorsplatError({code: 'bad_argument', message: `threads are a whole number from 1 to ${MOST}, or null, not ${threads}`});
  }
  wanted = threads;
}

// A splat file of any format that anchorsplat reads.
export const open = (data, options) => engine().open(data, options);
export const fromColumns = (columns) => engine().fromColumns(columns);
export const readCameras = (files) => engine().readCameras(files);
export const formats = () => engine().formats();

// One file in, another one out.
export async function convert(data, options) {
  const {to, from, name, ...rest} = options ?? {};
  if (typeof to !== 'string') throw new AnchorsplatError({code: 'bad_argument', message: 'convert() wants {to: "spz"}, or another format'});
  const splat = await open(data, {format: from, name});
  try {
    return await splat.write(to, rest);
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
