// Splats for programs in JavaScript: the engine lives in a worker, and this is what asks it. Nothing here knows whether it
// runs in a browser or in Node: `platform` does.
//
//   platform.compile() → Promise<{module: WebAssembly.Module, threads}>; threads: 1 for the module without
//   platform.spawn(threads) → {post(message, transfer), onMessage(f), onFailure(f), end(), hold(), release()}

export class AnchorsplatError extends Error {
  constructor({code, message}) {
    super(message);
    this.name = 'AnchorsplatError';
    this.code = code;
  }
}

const crashed = (why) => new AnchorsplatError({
  code: 'crashed', message: `the engine stopped (${why}); a new one has been started: open the splat again`});
const badArgument = (message) => new AnchorsplatError({code: 'bad_argument', message});
const stopped = () => new AnchorsplatError({code: 'interrupted', message: 'stopped, as it was asked to'});

// One worker with an engine in it.
class EngineWorker {
  constructor(platform, compiled) {
    this.waiting = new Map();
    this.last = 0;
    this.gone = null;
    this.worker = platform.spawn(compiled.threads);
    this.worker.onMessage((message) => this.receive(message));
    this.worker.onFailure((why) => this.end(crashed(why)));
    this.worker.post(compiled, []);
  }

  ask(request, {data = [], transfer = [], onProgress} = {}) {
    if (this.gone) return Promise.reject(this.gone);
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      if (this.waiting.size === 0) this.worker.hold();
      this.waiting.set(id, {resolve, reject, onProgress});
      try {
        this.worker.post({id, request, data}, transfer);
      } catch (error) {
        this.ended(id);
        reject(badArgument(`this cannot be sent to the engine: ${error.message}`));
      }
    });
  }

  // The call that waits for `id`, which waits no more.
  ended(id) {
    const call = this.waiting.get(id);
    if (this.waiting.delete(id) && this.waiting.size === 0) this.worker.release();
    return call;
  }

  receive(message) {
    if (message.crash !== undefined) return this.end(crashed(message.crash));
    const call = this.waiting.get(message.id);
    if (!call) return;
    if (message.progress) {
      try {
        if (call.onProgress) call.onProgress(message.progress);
      } catch (error) {
        this.ended(message.id).reject(error);  // whoever asked hears of it
      }
      return;
    }
    this.ended(message.id);
    const {answer, blocks} = message;
    if (answer.error) call.reject(new AnchorsplatError(answer.error));
    else call.resolve({answer, blocks});
  }

  // Ends it at once, whatever it is about.
  end(why) {
    if (this.gone) return;
    this.gone = why;
    this.worker.end();
    for (const call of this.waiting.values()) call.reject(why);
    this.waiting.clear();
  }
}

// Options as the words of the command line, which the engine checks: {pixelSize: 0.01, clean: true} → --pixel-size=0.01 --clean.
export function wordsOf(options, besides = []) {
  const words = [];
  for (const [key, value] of Object.entries(options)) {
    // Not an option here: the engine would answer with the text of the command line.
    if (key === 'help') throw badArgument('help is in index.d.mts');
    if (besides.includes(key) || value === undefined || value === null || value === false) continue;
    const option = `--${key.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`)}`;
    const text = Array.isArray(value) ? value.map((x) => x ?? '-').join(key === 'size' ? 'x' : ',') : String(value);
    words.push(...(value === true ? [option] : text === '' ? [option, ''] : [`${option}=${text}`]));
  }
  return words;
}

// What a program hands over: looked at here, so that its mistake is an error with a sentence and not one of this file's lines.
function optionsOf(options, what) {
  if (options === undefined || options === null) return {};
  if (typeof options !== 'object' || Array.isArray(options)) throw badArgument(`the options of ${what} are an object`);
  for (const name of ['onProgress', 'onMessage']) {
    if (options[name] !== undefined && options[name] !== null && typeof options[name] !== 'function') throw badArgument(`${name} is a function`);
  }
  const {signal, cameras} = options;
  if (signal !== undefined && signal !== null && typeof signal.addEventListener !== 'function') throw badArgument('signal is an AbortSignal');
  if (cameras !== undefined && cameras !== null && !(cameras instanceof Cameras)) throw badArgument('cameras are what readCameras() has read');
  return options;
}

// Edits in their order, [{up: 'z'}, {filterFloaters: true}], as words. Numbers count along the axes of the columns.
function wordsOfEdits(actions, axes = 'RDF') {
  const list = Array.isArray(actions) ? actions : [actions];
  if (!list.every((action) => typeof action === 'object' && action !== null && !Array.isArray(action))) {
    throw badArgument("edits are a list of objects, like [{up: 'z'}, {filterFloaters: true}]");
  }
  const words = list.flatMap((action) => wordsOf(action, ['dryRun', 'actionAxes']));
  return words.length > 0 ? [`--action-axes=${axes}`, ...words] : words;
}

const bytesOf = (data) => {
  if (data instanceof Uint8Array) return data;
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  if (ArrayBuffer.isView(data)) return new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  if (data && typeof data.arrayBuffer === 'function') return data;  // a Blob is read in the worker
  throw badArgument('the bytes of a file are a Uint8Array, an ArrayBuffer or a Blob');
};

const COLUMNS = ['means', 'logScales', 'quats', 'opacityLogits', 'sh'];

// One engine and all that is opened with it.
export class Engine {
  constructor(platform) {
    this.platform = platform;
    this.compiled = null;
    this.worker = null;
  }

  async newWorker() {
    this.compiled ??= this.platform.compile();
    return new EngineWorker(this.platform, await this.compiled);
  }

  async home() {
    if (!this.worker) this.worker = this.newWorker();
    let worker = await this.worker;
    if (worker.gone) {
      this.worker = this.newWorker();
      worker = await this.worker;
    }
    return worker;
  }

  async open(data, options) {
    const {name, format, onMessage} = optionsOf(options, 'open');
    const bytes = bytesOf(data);
    const worker = await this.home();
    const {answer} = await worker.ask({verb: 'open', name: name ?? data.name ?? '', format: format ?? ''}, {data: [bytes]});
    tellMessages(answer, onMessage);
    return new Splat(this, worker, answer);
  }

  async fromColumns(columns) {
    if (typeof columns !== 'object' || columns === null) throw badArgument(`a splat's columns are an object of ${COLUMNS.join(', ')}`);
    const blocks = COLUMNS.map((name) => columns[name]);
    if (!blocks.every((block) => block instanceof Float32Array)) {
      throw badArgument(`a splat's columns are Float32Arrays: ${COLUMNS.join(', ')}`);
    }
    const worker = await this.home();
    const {answer} = await put(worker, blocks, {gaussians: columns.count ?? blocks[3].length, sh_degree: columns.shDegree ?? 0,
      render_mode: columns.renderMode ?? null, comments: columns.comments ?? [], origin: columns.origin ?? [0, 0, 0]});
    return new Splat(this, worker, answer);
  }

  async readCameras(files) {
    const list = Array.isArray(files) ? files : [files];
    const parts = await Promise.all(list.map(async (file) => {
      if (typeof file !== 'object' || file === null || typeof file.name !== 'string') throw badArgument('files of cameras are {name, data}');
      const {name, data} = file;
      const bytes = bytesOf(data);
      return {name, bytes: bytes instanceof Uint8Array ? bytes : new Uint8Array(await bytes.arrayBuffer())};
    }));
    const worker = await this.home();
    const {answer} = await worker.ask({verb: 'cameras', files: parts.map(({name, bytes}) => ({name, bytes: bytes.length}))},
      {data: parts.map(({bytes}) => bytes)});
    return new Cameras(worker, answer, parts);
  }

  async formats() { return (await (await this.home()).ask({verb: 'formats'})).answer.formats; }

  async close() {
    if (!this.worker) return;
    const worker = await this.worker;
    this.worker = null;
    worker.end(stopped());
  }
}

// Cameras that an engine has, and their files, for another one that is to have them.
export class Cameras {
  constructor(worker, answer, parts) {
    this.worker = worker;
    this.handle = answer.cameras;
    this.count = answer.views;
    this.parts = parts;
  }
}

function tellMessages(answer, onMessage) {
  if (onMessage) for (const message of answer.messages) onMessage(message);
}

// `blocks`: the five columns. Those that came from an engine are moved, a program's own are copied.
function put(worker, blocks, described, transfer = []) {
  const data = blocks.map((block) => (block instanceof ArrayBuffer ? new Uint8Array(block) : bytesOf(block)));
  return worker.ask({verb: 'put', ...described}, {data, transfer});
}

const describedBy = ({gaussians, sh_degree, render_mode, comments, origin}) => ({gaussians, sh_degree, render_mode, comments, origin});

// A splat that the engine holds. It does not change: what makes another one returns it.
export class Splat {
  constructor(engine, worker, answer) {
    this.engine = engine;
    this.worker = worker;
    this.handle = answer.cloud;
    this.count = answer.gaussians;
    this.shDegree = answer.sh_degree;
    this.renderMode = answer.render_mode;
    this.comments = answer.comments;
    this.origin = answer.origin;
    this.format = answer.format;
  }

  async ask(request, options) {
    if (this.handle === null) throw badArgument('this splat has been closed');
    return this.worker.ask({cloud: this.handle, ...request}, options);
  }

  // The engine's number of something that goes with this splat.
  numberOf(other, what) {
    if (other.handle === null) throw badArgument(`${what} has been closed`);
    if (other.worker !== this.worker) throw badArgument(`${what} belongs to an engine that has ended`);
    return other.handle;
  }

  async info() { return (await this.ask({verb: 'info'})).answer; }

  // In a worker of its own: `signal` ends it at once, and its memory goes back when it is done.
  async enhance(options) {
    const {cameras, seed = 0, signal, onProgress, onMessage, ...rest} = optionsOf(options, 'enhance');
    if (signal && signal.aborted) throw stopped();
    const columns = await this.ask({verb: 'columns'});
    const work = await this.engine.newWorker();
    const stop = () => work.end(stopped());
    if (signal) signal.addEventListener('abort', stop);
    if (signal && signal.aborted) stop();
    try {
      const {answer: there} = await put(work, columns.blocks, describedBy(columns.answer), columns.blocks);
      const request = {verb: 'enhance', cloud: there.cloud, words: wordsOf(rest), seed};
      if (cameras) {
        const files = cameras.parts.map(({name, bytes}) => ({name, bytes: bytes.length}));
        const {answer} = await work.ask({verb: 'cameras', files}, {data: cameras.parts.map(({bytes}) => bytes)});
        request.cameras = answer.cameras;
      }
      const {answer} = await work.ask(request, {onProgress});
      tellMessages(answer, onMessage);
      const made = await work.ask({verb: 'columns', cloud: answer.cloud});
      work.end(stopped());  // what it has is not needed beside what the other one gets
      const {answer: kept} = await put(this.worker, made.blocks, describedBy(made.answer), made.blocks);
      return {splat: new Splat(this.engine, this.worker, kept), report: answer.report};
    } finally {
      if (signal) signal.removeEventListener('abort', stop);
      work.end(stopped());
    }
  }

  // Turned, moved, scaled, cropped, cleaned, in this order; `world` says where points of this one are in the new one.
  async edit(actions, options) {
    const {axes, onMessage} = optionsOf(options, 'edit');
    const {answer} = await this.ask({verb: 'edit', words: wordsOfEdits(actions, axes ?? undefined)});
    tellMessages(answer, onMessage);
    return {splat: new Splat(this.engine, this.worker, answer), actions: answer.actions, world: answer.world};
  }

  // What each edit would take away.
  async countEdits(actions, options) {
    const {axes} = optionsOf(options, 'countEdits');
    const words = [...wordsOfEdits(actions, axes ?? undefined), '--dry-run'];
    return (await this.ask({verb: 'edit', words})).answer.actions;
  }

  // Variance that the filter adds to a Gaussian whose training pixel has the size 1: world units², times that size squared.
  async filterGain(upscale = 4) {
    return (await this.ask({verb: 'filter', upscale})).answer.gain;
  }

  async write(format, options) {
    if (typeof format !== 'string') throw badArgument('a format is a word, like "spz"');
    const {onMessage, ...rest} = optionsOf(options, 'write');
    const {answer, blocks} = await this.ask({verb: 'write', format, words: wordsOf(rest)});
    tellMessages(answer, onMessage);
    return new Uint8Array(blocks[0]);
  }

  // The page of `anchorsplat view`: one HTML file.
  async page(options) {
    const {before, name = '', cameras, onMessage, ...rest} = optionsOf(options, 'page');
    const request = {verb: 'page', after: this.handle, name, words: wordsOf(rest)};
    if (before !== undefined && before !== null) {
      if (!(before instanceof Splat)) throw badArgument('before is a splat');
      request.before = this.numberOf(before, 'the splat before');
    }
    if (cameras) request.cameras = this.numberOf(cameras, 'the set of cameras');
    const {answer, blocks} = await this.ask(request);
    tellMessages(answer, onMessage);
    return new Uint8Array(blocks[0]);
  }

  async render(options) {
    const {cameras, transparent = false, onProgress, onMessage, ...rest} = optionsOf(options, 'render');
    const request = {verb: 'render', transparent, words: wordsOf(rest)};
    if (cameras) request.cameras = this.numberOf(cameras, 'the set of cameras');
    const {answer, blocks} = await this.ask(request, {onProgress});
    tellMessages(answer, onMessage);
    const {views, height, width, channels} = answer;
    return {views, height, width, channels, pixels: new Float32Array(blocks[0])};
  }

  async columns() {
    const {blocks} = await this.ask({verb: 'columns'});
    const columns = {count: this.count, shDegree: this.shDegree, renderMode: this.renderMode, comments: this.comments, origin: this.origin};
    COLUMNS.forEach((name, k) => { columns[name] = new Float32Array(blocks[k]); });
    return columns;
  }

  async close() {
    if (this.handle === null) return;
    const cloud = this.handle;
    this.handle = null;
    if (!this.worker.gone) await this.worker.ask({verb: 'release', cloud});
  }
}
