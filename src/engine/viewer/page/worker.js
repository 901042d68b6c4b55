'use strict';
// Everything that takes long: undoing the page's packing (quantized_cloud.h says how a splat is packed), and putting
// the Gaussians into depth order whenever the camera turns. One worker per splat.
//
// in   {type: 'begin', description}                       out
//      {type: 'part', first, count, pieces: [base64]}          {type: 'unpacked', geometry, harmonics}
//      {type: 'sort', id, forward: [3], offset, near}          {type: 'sorted', id, order, count}
//                                                              {type: 'failed', message}

let means = null;    // Float32Array [N,3], relative to the splat's centre
let depths = null;   // Float32Array [N]
let keys = null;     // Uint16Array [N]
let description = null;
let arrived = 0;     // Gaussians that are there: those of the parts so far

function bytesFromBase64(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpackPlanes(count, pieces) {
  const planes = new Uint8Array(count * description.planes);
  let at = 0;
  for (let k = 0; k < pieces.length; ++k) {
    const piece = await inflate(bytesFromBase64(pieces[k]));
    pieces[k] = null;
    if (piece.length > planes.length - at) throw new Error('more data than the page promises');
    planes.set(piece, at);
    at += piece.length;
  }
  if (at !== planes.length) throw new Error(`${at} bytes of data where the page promises ${planes.length}`);
  return planes;
}

// Two RGBA32UI texels per Gaussian: mean (3 floats), rotation code | log-scale codes 0 and 1, log-scale 2 and opacity,
// f_dc r and g, f_dc b — 16 bits each, the first one low.
function packGeometry(first, n, planes, into) {
  const d = description;
  const floats = new Float32Array(into.buffer);
  const scalar = (plane, i) => (planes[plane * n + i] << (d.scalarBits - 8)) | planes[(plane + 1) * n + i];
  const top = 2 ** d.meanBits - 1;
  for (let i = 0; i < n; ++i) {
    const out = 8 * i;
    for (let axis = 0; axis < 3; ++axis) {
      const p = 3 * axis * n + i;
      const code = (planes[p] << (d.meanBits - 8)) | (planes[p + n] << (d.meanBits - 16)) | planes[p + 2 * n];
      const x = d.spread * Math.sinh(d.reach * (2 * code / top - 1));
      means[3 * (first + i) + axis] = x;
      floats[out + axis] = x;
    }
    const r = 23 * n + i;
    into[out + 3] = planes[r] | (planes[r + n] << 8) | (planes[r + 2 * n] << 16) | (planes[r + 3 * n] << 24);
    into[out + 4] = scalar(9, i) | (scalar(11, i) << 16);
    into[out + 5] = scalar(13, i) | (scalar(15, i) << 16);
    into[out + 6] = scalar(17, i) | (scalar(19, i) << 16);
    into[out + 7] = scalar(21, i);
  }
}

// ceil(bytes/16) RGBA32UI texels per Gaussian, four coefficients per word, coefficient-major.
function packHarmonics(n, planes, texels, into) {
  const bytes = new Uint8Array(into.buffer);
  for (let k = 0; k < description.planes - 27; ++k) {
    const plane = (27 + k) * n;
    for (let i = 0; i < n; ++i) bytes[16 * texels * i + k] = planes[plane + i];
  }
}

function begin(whole) {
  description = whole;
  means = new Float32Array(3 * whole.count);
  depths = new Float32Array(whole.count);
  keys = new Uint16Array(whole.count);
}

async function unpack({first, count, pieces, geometrySize, harmonicsSize, harmonicsTexels}) {
  const planes = await unpackPlanes(count, pieces);
  const geometry = new Uint32Array(geometrySize);
  packGeometry(first, count, planes, geometry);
  const harmonics = new Uint32Array(harmonicsSize);
  if (harmonicsTexels > 0) packHarmonics(count, planes, harmonicsTexels, harmonics);
  arrived = first + count;
  postMessage({type: 'unpacked', geometry, harmonics}, [geometry.buffer, harmonics.buffer]);
}

// Farthest first, by camera z as the renderer sorts; what is nearer than the near plane is left out. A counting sort
// over 16 bits of depth: two passes, no comparisons.
function sort({id, forward, offset, near}) {
  const n = arrived;
  const [fx, fy, fz] = forward;
  let nearest = Infinity;
  let farthest = -Infinity;
  let count = 0;
  for (let i = 0; i < n; ++i) {
    const z = fx * means[3 * i] + fy * means[3 * i + 1] + fz * means[3 * i + 2] + offset;
    depths[i] = z;
    if (!(z >= near)) continue;
    ++count;
    if (z < nearest) nearest = z;
    if (z > farthest) farthest = z;
  }
  const starts = new Uint32Array(65537);
  const scale = farthest > nearest ? 65535 / (farthest - nearest) : 0;
  for (let i = 0; i < n; ++i) {
    if (!(depths[i] >= near)) continue;
    const key = ((farthest - depths[i]) * scale) | 0;
    keys[i] = key;
    ++starts[key + 1];
  }
  for (let k = 0; k < 65536; ++k) starts[k + 1] += starts[k];
  const order = new Uint32Array(count);
  for (let i = 0; i < n; ++i) {
    if (depths[i] >= near) order[starts[keys[i]]++] = i;
  }
  postMessage({type: 'sorted', id, order, count}, [order.buffer]);
}

onmessage = async ({data}) => {
  try {
    if (data.type === 'begin') begin(data.description);
    if (data.type === 'part') await unpack(data);
    if (data.type === 'sort') sort(data);
  } catch (error) {
    postMessage({type: 'failed', message: error.message || String(error)});
  }
};
