// gpu_browser_test.mjs FOLDER: all kernels through the compiler of headless Chromium, and what `gpu_recording FOLDER` has
// recorded told to Chromium's software adapter, whose answers must be those of the recording.
import fs from 'node:fs';
import path from 'node:path';
import {expect, finish, launchBrowser, serve} from './browser.mjs';

const folder = path.resolve(process.argv[2]);
const root = path.dirname(path.dirname(path.resolve(process.argv[1])));
const recording = JSON.parse(fs.readFileSync(path.join(folder, 'recording.json')));

// The characters of a constant that a C++ file declares as string literals.
function constantOf(text, name) {
  const [, literals] = new RegExp(String.raw`string_view ${name} =\s*((?:"(?:[^"\\]|\\.)*"\s*)+);`).exec(text);
  return [...literals.matchAll(/"(?:[^"\\]|\\.)*"/g)].map(([literal]) => JSON.parse(literal)).join('');
}

// Kernels as the sources declare them: `GpuKernel kName = {"entry", {wgsl::kFooBarWgsl, kConstant, …}}` with foo_bar.wgsl
// beside it.
function kernelsOfSources() {
  const kernels = [];
  const prelude = fs.readFileSync(path.join(root, 'src/engine/gpu/prelude.wgsl'), 'utf8');
  for (const file of fs.readdirSync(path.join(root, 'src'), {recursive: true})) {
    if (!file.endsWith('.cc') || file.endsWith('_test.cc')) continue;
    const text = fs.readFileSync(path.join(root, 'src', file), 'utf8');
    for (const [, entry, sources] of text.matchAll(/GpuKernel \w+\s*=?\s*\{\s*"(\w+)",\s*\{([^}]*)\}/g)) {
      const room = path.dirname(path.join(root, 'src', file)); // kernels lie beside what runs them
      const parts = sources.split(',').map((source) => {
        const embedded = /^wgsl::k(\w+)Wgsl$/.exec(source.trim());
        if (!embedded) return constantOf(text, source.trim());
        const name = embedded[1].replace(/(?!^)[A-Z]/g, '_$&').toLowerCase();
        return fs.readFileSync(path.join(room, `${name}.wgsl`), 'utf8');
      });
      kernels.push({entry, text: prelude + parts.join('')});
    }
  }
  return kernels;
}

// In the page: a device of the adapter that the switches name, or why there is none.
async function open() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) return {problem: navigator.gpu ? 'no adapter' : 'no navigator.gpu'};
  window.device = await adapter.requestDevice();
  window.problems = [];
  device.addEventListener('uncapturederror', (event) => problems.push(event.error.message));
  device.lost.then((info) => problems.push(`the device is lost: ${info.message}`));
  return {name: [adapter.info.vendor, adapter.info.architecture, adapter.info.description].filter(Boolean).join(' ')};
}

// In the page: what the compiler says against a kernel, '' for nothing.
async function compile({entry, text}) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({code: text});
  const messages = [...(await module.getCompilationInfo()).messages];
  try {
    await device.createComputePipelineAsync({layout: 'auto', compute: {module, entryPoint: entry}});
  } catch (error) {
    messages.push({type: 'error', message: error.message});
  }
  const error = await device.popErrorScope();
  if (error) messages.push({type: 'error', message: error.message});
  return messages.filter(({type}) => type === 'error').map(({lineNum, message}) => `${lineNum ?? ''} ${message}`).join('; ');
}

// In the page: the recording, call by call. Returns how each of the reads differs from what was read then.
async function replay() {
  const recording = await (await fetch('recording.json')).json();
  const data = await (await fetch('recording.bin')).arrayBuffer();
  const usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC | GPUBufferUsage.COPY_DST;
  const buffers = recording.buffers.map((size) => device.createBuffer({size, usage}));
  const pipelines = recording.kernels.map(({entry, text}) => device.createComputePipeline(
    {layout: 'auto', compute: {module: device.createShaderModule({code: text}), entryPoint: entry}}));
  let encoder = device.createCommandEncoder();
  const submit = () => {
    device.queue.submit([encoder.finish()]);
    encoder = device.createCommandEncoder();
  };
  const differences = [];
  const of = {
    write(buffer, offset, at, bytes) {
      submit();  // a queue writes before what is handed over later
      device.queue.writeBuffer(buffers[buffer], offset, data, at, bytes);
    },
    clear(buffer, offset, bytes) {
      encoder.clearBuffer(buffers[buffer], offset, bytes);
    },
    copy(from, fromOffset, to, toOffset, bytes) {
      encoder.copyBufferToBuffer(buffers[from], fromOffset, buffers[to], toOffset, bytes);
    },
    run(kernel, at, bytes, bindings, groups) {
      const entries = bindings.map(([binding, buffer, offset, size]) =>
        ({binding, resource: {buffer: buffers[buffer], offset, size}}));
      if (bytes > 0) {
        const parameters = device.createBuffer({size: 256, usage: GPUBufferUsage.UNIFORM, mappedAtCreation: true});
        new Uint8Array(parameters.getMappedRange()).set(new Uint8Array(data, at, bytes));
        parameters.unmap();
        entries.push({binding: 0, resource: {buffer: parameters}});
      }
      const pass = encoder.beginComputePass();
      pass.setPipeline(pipelines[kernel]);
      pass.setBindGroup(0, device.createBindGroup({layout: pipelines[kernel].getBindGroupLayout(0), entries}));
      pass.dispatchWorkgroups(Math.min(groups, 65535), Math.ceil(groups / 65535));
      pass.end();
    },
    async read(buffer, offset, at, bytes) {
      const staging = device.createBuffer({size: bytes, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ});
      encoder.copyBufferToBuffer(buffers[buffer], offset, staging, 0, bytes);
      submit();
      await staging.mapAsync(GPUMapMode.READ);
      const now = staging.getMappedRange().slice(0);
      staging.destroy();
      const words = new Uint32Array(data, at, bytes / 4), floats = new Float32Array(data, at, bytes / 4);
      const wordsNow = new Uint32Array(now), floatsNow = new Float32Array(now);
      // Numbers of Gaussians and pairs are no floats that are not tiny.
      const whole = words.every((word) => word < 1 << 23);
      let differing = 0, difference = 0, size = 0;
      for (let i = 0; i < words.length; ++i) {
        if (words[i] === wordsNow[i]) {
          if (!whole && Number.isFinite(floats[i])) size += floats[i] ** 2;
          continue;
        }
        const apart = Math.abs(floatsNow[i] - floats[i]);
        if (whole || !(apart <= 1e-4 * Math.max(1, Math.abs(floats[i])))) ++differing;
        if (!whole) difference += apart ** 2, size += floats[i] ** 2;
      }
      differences.push({values: words.length, whole, differing, l2: difference === 0 ? 0 : Math.sqrt(difference / size)});
    },
  };
  for (const [what, ...words] of recording.calls) await of[what](...words);
  submit();
  await device.queue.onSubmittedWorkDone();
  return {differences, problems};
}

const server = await serve((name) => {
  if (name === '/recording.json' || name === '/recording.bin') return path.join(folder, name);
  return name === '/' ? path.join(root, 'scripts/gpu_browser_test.html') : '';
});
const browser = await launchBrowser(['--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader']);
const tab = await browser.newPage();
tab.setDefaultTimeout(0);
await tab.goto(server.home);
const {name, problem} = await tab.evaluate(open);
expect('an adapter', !problem, problem);
if (!problem) {
  console.log(`${(await browser.version())}, ${name}`);
  const kernels = kernelsOfSources();
  expect('kernels in the sources', kernels.length > 10, `${kernels.length}`);
  for (const kernel of kernels) {
    const complaint = await tab.evaluate(compile, kernel);
    expect(`${kernel.entry} compiles`, complaint === '', complaint);
  }
  const ran = new Set(recording.kernels.map(({entry}) => entry));
  const rest = [...new Set(kernels.map(({entry}) => entry))].filter((entry) => !ran.has(entry));
  console.log(`${kernels.length} kernels are in the sources; ${ran.size} of them run here` +
    (rest.length ? `, these are only compiled: ${rest.join(', ')}` : ''));
  const {differences, problems} = await tab.evaluate(replay);
  for (const problem of problems) expect('no complaint', false, problem);
  expect('something is read', differences.length > 10, `${differences.length}`);
  differences.forEach(({values, whole, differing, l2}, i) => {
    // Of pictures a few values may lie on a cut-off; gradients are near as a whole.
    const near = whole ? differing === 0 : differing <= 5e-5 * values || l2 <= 1e-3;
    expect(`read ${i}`, near, `${differing} of ${values} ${whole ? 'numbers' : 'floats'} differ, relative L2 ${l2}`);
  });
  const worst = Math.max(...differences.map(({l2}) => l2));
  console.log(`${recording.calls.length} calls, ${differences.length} answers, worst relative L2 ${worst.toExponential(1)}`);
}
await browser.close();
server.close();
finish();
