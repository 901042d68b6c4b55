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

// Texels per Gaussian, and the size of the texture that holds `count` of them.
function textureShape(count, texels) {
  return {texels, width: TEXTURE_WIDTH, height: Math.ceil(count * texels / TEXTURE_WIDTH)};
}

// One splat: its description, its worker, and — after load() — the arrays for its textures. Depth orders arrive by
// `onOrder`; while one is being made, only the latest further wish is kept.
class Splat {
  constructor(description, workerSource, onOrder, onError) {
    this.description = description;
    const bytes = 3 * ((description.degree + 1) ** 2 - 1);
    this.geometryShape = textureShape(description.count, 2);
    this.harmonicsShape = textureShape(description.count, Math.ceil(bytes / 16));
    this.sorting = false;
    this.waiting = null;
    this.sortId = 0;
    this.onOrder = onOrder;
    this.onError = onError;
    this.worker = startWorker(workerSource);
    this.worker.onerror = (event) => onError(new Error(event.message || 'the sorting worker stopped'));
  }

  load() {
    const {geometryShape, harmonicsShape} = this;
    return new Promise((resolve, reject) => {
      this.worker.onmessage = ({data}) => {
        if (data.type === 'failed') reject(new Error(data.message));
        if (data.type !== 'loaded') return;
        this.worker.onmessage = (message) => this.receive(message.data);
        resolve(data);
      };
      this.worker.onerror = (event) => reject(new Error(event.message || 'the decoding worker stopped'));
      this.worker.postMessage({
        type: 'load',
        description: this.description,
        pieces: this.description.pieces.map(elementText),
        geometrySize: 4 * geometryShape.width * geometryShape.height,
        harmonicsSize: 4 * harmonicsShape.width * harmonicsShape.height,
        harmonicsTexels: harmonicsShape.texels,
      });
    });
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
    if (data.type === 'failed') return this.onError(new Error(data.message));
    this.sorting = false;
    this.onOrder(this, data.order, data.count);
    if (this.waiting) {
      const wish = this.waiting;
      this.waiting = null;
      this.send(wish);
    }
  }
}
