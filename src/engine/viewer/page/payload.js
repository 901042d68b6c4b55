'use strict';
// The data elements of the page, and the worker that unpacks them.

const TEXTURE_WIDTH = 2048;  // texels; every WebGL 2 device has it

function elementText(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`part “${id}” is missing`);
  const text = element.textContent;
  element.remove();  // the page holds its data once
  return text;
}

function readDescription() {
  const description = JSON.parse(elementText('description'));
  if (!description.after || !(description.after.count > 0)) throw new Error('it describes no splat');
  return description;
}

function startWorker(source) {
  const url = URL.createObjectURL(new Blob([source], {type: 'text/javascript'}));
  const worker = new Worker(url);
  URL.revokeObjectURL(url);
  return worker;
}

// Data in files beside the page: scripts, as a page from a disk may load nothing else. Each makes one call of this.
const arrivedParts = new Map();
let awaitedParts = 0;
function anchorsplatPart(token, id, pieces) { arrivedParts.set(`${token} ${id}`, pieces); }

function loadPart({id, file, token}) {
  const name = decodeURIComponent(file);
  const again = 'The page and the folder beside it belong together: please copy both again.';
  return new Promise((resolve, reject) => {
    const script = document.createElement('script');
    ++awaitedParts;
    const end = (settle, value) => {
      --awaitedParts;
      script.remove();
      settle(value);
    };
    script.onerror = () => end(reject, new Error(`“${name}” is missing. ${again}`));
    script.onload = () => {
      const key = `${token} ${id}`;
      const pieces = arrivedParts.get(key);
      arrivedParts.clear();  // the page holds its data once
      if (pieces) end(resolve, pieces);
      else end(reject, new Error(`“${name}” is damaged or of another page. ${again}`));
    };
    script.src = file;
    document.head.append(script);
  });
}

// Texels per Gaussian, and the size of the texture that holds `count` of them.
function textureShape(count, texels) {
  return {texels, width: TEXTURE_WIDTH, height: Math.ceil(count * texels / TEXTURE_WIDTH)};
}

// One splat: its description, its worker, and, while it is loaded, the arrays for its textures part by part. A page in
// one file has one part. Depth orders arrive by `onOrder`; while one is being made, only the latest further wish is kept.
class Splat {
  constructor(description, workerSource, onOrder, onError) {
    this.description = description;
    this.parts = description.parts || [{count: description.count, pieces: description.pieces}];
    const bytes = 3 * ((description.degree + 1) ** 2 - 1);
    this.harmonicsTexels = Math.ceil(bytes / 16);
    this.geometryShape = textureShape(description.count, 2);
    this.harmonicsShape = textureShape(description.count, this.harmonicsTexels);
    this.arrived = 0;  // Gaussians
    this.unpacked = null;
    this.sorting = false;
    this.waiting = null;
    this.sortId = 0;
    this.onOrder = onOrder;
    this.onError = onError;
    this.worker = startWorker(workerSource);
    this.worker.onmessage = ({data}) => this.receive(data);
    this.worker.onerror = (event) => this.stop(new Error(event.message || 'the worker of a splat stopped'));
    this.worker.postMessage({type: 'begin', description});
  }

  get complete() { return this.arrived === this.description.count; }

  // Part after part; `onPart` gets each one's texels: {first, count, geometry, harmonics}.
  async load(onPart) {
    for (const part of this.parts) {
      const pieces = part.file ? await loadPart(part) : part.pieces.map(elementText);
      const first = this.arrived;
      const {geometry, harmonics} = await this.unpack(first, part.count, pieces);
      this.arrived += part.count;
      onPart({first, count: part.count, geometry, harmonics});
    }
  }

  unpack(first, count, pieces) {
    const size = ({width, height}) => 4 * width * height;
    return new Promise((resolve, reject) => {
      this.unpacked = {resolve, reject};
      this.worker.postMessage({
        type: 'part', first, count, pieces,
        geometrySize: size(textureShape(count, 2)),
        harmonicsSize: size(textureShape(count, this.harmonicsTexels)),
        harmonicsTexels: this.harmonicsTexels,
      });
    });
  }

  stop(error) {
    if (this.unpacked) this.unpacked.reject(error);
    else this.onError(error);
  }

  // `row` is the camera's viewing direction in world axes, `depth` the camera z of the splat's centre.
  requestOrder(row, depth, near) {
    const wish = {type: 'sort', forward: row, offset: depth, near};
    if (this.sorting) {
      this.waiting = wish;
    } else {
      this.send(wish);
    }
  }

  send(wish) {
    this.sorting = true;
    this.worker.postMessage({...wish, id: ++this.sortId});
  }

  receive(data) {
    if (data.type === 'failed') return this.stop(new Error(data.message));
    if (data.type === 'unpacked') {
      const {resolve} = this.unpacked;
      this.unpacked = null;
      return resolve(data);
    }
    this.sorting = false;
    this.onOrder(this, data.order, data.count);
    if (this.waiting) {
      const wish = this.waiting;
      this.waiting = null;
      this.send(wish);
    }
  }
}
