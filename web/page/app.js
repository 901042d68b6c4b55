// The page: a splat comes in, is shown, enhanced and saved. The stage is the page of `anchorsplat view`, in a frame.

const byId = (id) => document.getElementById(id);
const show = (element, visible) => { element.hidden = !visible; };
const number = (value) => value.toLocaleString('en');

// A worker with the engine: from what this file carries, or from beside it.
function workerWith(threads) {
  if (threads > 1) return new Worker('worker-threads.js');
  const url = URL.createObjectURL(new Blob([byId('engine-worker').textContent], {type: 'text/javascript'}));
  const worker = new Worker(url);
  URL.revokeObjectURL(url);
  return worker;
}

// The module with threads, where the host isolates this page from other origins and has it; else null.
function moduleWithThreads() {
  if (!globalThis.crossOriginIsolated || !location.protocol.startsWith('http')) return null;
  return new Promise((resolve) => {
    const worker = workerWith(2);
    const end = (compiled) => {
      worker.terminate();
      resolve(compiled);
    };
    worker.onmessage = ({data}) => end(data.compiled ?? null);
    worker.onerror = () => end(null);
    worker.postMessage({compile: 'engine-threads.wasm'});
  });
}

const platform = {
  async compile() {
    const processors = Math.min(8, navigator.hardwareConcurrency || 1);
    const shared = processors > 1 ? await moduleWithThreads() : null;
    document.documentElement.dataset.threads = String(shared ? processors : 1);
    if (shared) return {module: shared, threads: processors};
    const element = byId('engine-module');
    const packed = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
    element.remove();
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
    return {module: await WebAssembly.compile(await new Response(stream).arrayBuffer()), threads: 1};
  },
  spawn(threads) {
    const worker = workerWith(threads);
    return {
      post: (message, transfer) => worker.postMessage(message, transfer),
      onMessage: (f) => { worker.onmessage = (event) => f(event.data); },
      onFailure: (f) => { worker.onerror = (event) => f(event.message || 'its worker could not be started'); },
      end: () => worker.terminate(),
      hold() {},
      release() {},
    };
  },
};
const engine = new Engine(platform);

let input = null;     // {splat, info, name, bytes, original, originalInfo}: the splat as it is edited, and as it was opened
let result = null;    // {splat, report}
let cameras = null;
let gain = 0;         // of the filter at this zoom
let chosen = false;   // the person has moved the pixel size
let running = null;   // AbortController of what is being enhanced
let session = 0;      // of the splat that is open: what belongs to an older one is dropped
let openings = 0;     // files that were to be opened: the last one counts

function sizeText(bytes) {
  const units = ['bytes', 'kB', 'MB', 'GB'];
  let k = 0;
  for (; bytes >= 1000 && k < 3; ++k) bytes /= 1000;
  return `${bytes.toFixed(k === 0 || bytes >= 99.95 ? 0 : 1)} ${units[k]}`;
}

function trouble(error) {
  const text = error ? error.message || String(error) : '';
  byId('trouble').textContent = text;
  show(byId('trouble'), text !== '');
  if (text) byId('trouble').scrollIntoView({block: 'nearest'});
  document.documentElement.dataset.trouble = text;
  if (error && !input) {
    show(byId('panel'), true);
    for (const id of ['edit', 'work', 'save']) show(byId(id), false);
  }
}

function busy(text) {
  byId('busy').firstElementChild.textContent = text;
  show(byId('busy'), text !== '');
}

// The stage.

const viewer = byId('viewer');
let stageUrl = null;
let look = null;

// Shows a page in the frame, from where the one before it looked if that was of the same splat, or `change` says where
// that is now.
async function stage(bytes, {same = true, change = (before) => before} = {}) {
  look = viewer.hidden || !same ? null : await lookOfStage();
  if (look) look = change(look);
  if (stageUrl) URL.revokeObjectURL(stageUrl);
  stageUrl = URL.createObjectURL(new Blob([bytes], {type: 'text/html'}));
  const ready = heard((data) => data.ready);
  show(viewer, true);
  show(byId('welcome'), false);
  viewer.src = stageUrl;
  stageIsNew(await ready);
  if (look) viewer.contentWindow.postMessage({look}, '*');
}

// The next message of the frame that `has` something; null when it says nothing for long.
function heard(has, wait = 60000) {
  return new Promise((resolve) => {
    const end = (value) => {
      removeEventListener('message', listen);
      clearTimeout(timer);
      resolve(value);
    };
    const listen = ({source, data}) => {
      if (source === viewer.contentWindow && data && has(data)) end(data);
    };
    const timer = setTimeout(() => end(null), wait);
    addEventListener('message', listen);
  });
}

async function lookOfStage() {
  const answer = heard((data) => data.look, 500);
  viewer.contentWindow.postMessage({tell: 'look'}, '*');
  const told = await answer;
  return told ? told.look : null;
}

// Colour that depends on the view is most of a page: large scenes are shown with less of it. What is saved has all.
const shownDegree = (splat) => Math.min(splat.shDegree, splat.count > 1.5e6 ? 0 : splat.count > 5e5 ? 1 : 3);

async function showInput(how) {
  await stage(await input.splat.page({name: input.name, title: input.name, shDegree: shownDegree(input.splat)}), how);
  preview();
}

// The filter of this pixel size, at once: the frame adds its variance to every Gaussian.
function preview() {
  if (!input || result) return;
  viewer.contentWindow.postMessage({widening: gain * (pixelSize() ?? 0) ** 2}, '*');
}

// Rewords a message of the command line for this page, as a sentence.
function sentence(text) {
  const here = text.replace(/Pass --cameras or --pixel-size(, or --mode \w+ to enhance it anyway)?/, 'Use the slider or training cameras')
    .replace(/\. --(filter-strength F|mode \w+) enhances it anyway/, '').replace(/, or pass --mode to trust them$/, '')
    .replace(/ \(--[^)]*\)/g, '').replace(/--pixel-size/g, 'the slider').replace(/--cameras/g, 'training cameras')
    .replace(/--region/g, 'only a part').replace(/--max-gaussians/g, 'Gaussians at most');
  return here.charAt(0).toUpperCase() + here.slice(1) + (/[.?!]$/.test(here) ? '' : '.');
}

// The pixel size.

// Where the slider is 0: what the engine would take.
const estimate = () => input.info.treatment.pixel ?? input.info.reading?.pixel ?? null;
// Nothing is known of very small or odd splats: then a person's eye goes by the size of the Gaussians.
const middle = () => estimate() ?? (Math.max(input.info.largest_axis.p50, 1e-9) || 1e-3);
function pixelSize() {
  const octaves = Number(byId('pixel').value);
  return chosen ? middle() * 2 ** octaves : estimate();
}

function tellPixelSize() {
  const size = pixelSize();
  const source = chosen ? '' : ' (estimated)';
  byId('pixel-value').textContent = size === null ? 'not known' : `${size.toPrecision(3)}${source}`;
  if (cameras) {
    byId('cameras-about').textContent = `${number(cameras.count)} cameras: ` + (chosen
      ? 'not used, as the slider says one size for all. Estimate takes them again.'
      : 'Enhance takes the size of every Gaussian\'s pixel from them. The preview shows one size for all.');
  }
}

// What the file is, in words.

function describe({info, originalInfo, name, bytes}) {
  byId('name').textContent = name;
  const about = byId('about');
  about.replaceChildren();
  const say = (text, className = '') => {
    const line = document.createElement('p');
    line.textContent = text;
    line.className = className;
    about.append(line);
  };
  say(isEdited()
    ? `${number(info.gaussians)} Gaussians, edited; the file has ${number(originalInfo.gaussians)} (${info.format}, ${sizeText(bytes)}). Colour of SH degree ${info.sh_degree}.`
    : `${number(info.gaussians)} Gaussians, ${info.format}, ${sizeText(bytes)}, colour of SH degree ${info.sh_degree}.`);
  if (info.render_mode) say(`It says that it was trained as ${info.render_mode}.`);
  else say(`It looks like ${info.looks_in_words}.`);
  say(sentence(`Can be sharpened: ${info.treatment_in_words}`));
  if (info.reading) {
    const {pixel, low, high, strangeness} = info.reading;
    say(`A pixel of its training pictures covered about ${pixel.toPrecision(3)} of its units ` +
      `(likely ${low.toPrecision(2)} to ${high.toPrecision(2)}).`);
    if (strangeness > 1) say('Few splats are like it, so that may be wrong: look for yourself with the slider.');
  } else {
    say('How large a pixel of its training pictures was cannot be told: the slider decides.');
  }
  if (info.problems.length > 0) {
    const list = document.createElement('ul');
    for (const problem of info.problems) {
      const item = document.createElement('li');
      item.textContent = sentence(problem);
      list.append(item);
    }
    about.append(list);
  }
  for (const credit of info.credits) say(credit, 'quiet');
}

// What a person does.

async function openFile(file) {
  const mine = ++openings;
  trouble(null);
  busy(`Reading ${file.name}…`);
  try {
    const splat = await engine.open(file, {name: file.name});
    const info = await splat.info();
    if (mine !== openings) return await splat.close();
    ++session;
    if (running) running.abort();
    const old = new Set(input ? [input.splat, input.original, result && result.splat] : []);
    input = {splat, info, name: file.name, bytes: file.size, original: splat, originalInfo: info};
    forgetEdits();
    result = null;
    chosen = false;
    dropCameras();
    // Far enough for what the page says is likely, also where a smaller pixel is taken instead.
    byId('pixel').max = String(Math.max(2.5, info.reading ? Math.ceil(Math.log2(info.reading.high / estimate())) + 1 : 0));
    byId('pixel').value = '0';
    byId('done').textContent = '';
    for (const before of old) if (before) await before.close().catch(() => {});
    gain = await splat.filterGain(Number(byId('upscale').value));
    describe(input);
    show(byId('panel'), true);
    for (const id of ['edit', 'work', 'save']) show(byId(id), true);
    tellPixelSize();
    offer();
    await showInput({same: false});
    document.documentElement.dataset.state = 'shown';
  } catch (error) {
    if (mine === openings) trouble(error);
  } finally {
    if (mine === openings) busy('');
  }
}

// Cameras belong to the splat that they were opened for.
function dropCameras() {
  cameras = null;
  byId('cameras').value = '';
  byId('cameras-about').textContent = '';
}

// A splat, or cameras for the one that is open, or both.
const isCameraFile = (file) => /\.(json|txt|bin)$/i.test(file.name);
async function takeFiles(files) {
  const splats = files.filter((file) => !isCameraFile(file));
  const cameraFiles = files.filter(isCameraFile);
  if (splats.length > 1) {
    return trouble(new Error(`One splat at a time: ${splats.map((file) => file.name).join(', ')} are ${splats.length}.`));
  }
  if (splats.length === 1) await openFile(splats[0]);
  if (cameraFiles.length === 0 || byId('trouble').textContent) return;
  if (!input) return trouble(new Error(`${cameraFiles[0].name} looks like cameras: open the splat first that was trained with them.`));
  if (running) return trouble(new Error('Cameras are for the next run: stop this one, or wait for it.'));
  await takeCameras(cameraFiles);
}

function offer() {
  byId('which').querySelector('[value="result"]').disabled = !result;
  byId('which').querySelector('[value="input"]').textContent = isEdited() ? 'the edited splat' : 'the splat as it is';
  byId('which').value = result ? 'result' : 'input';
  byId('enhance').disabled = !input || running !== null;
  // What is being made is made with these.
  for (const id of ['upscale', 'quality', 'pixel', 'pixel-auto', 'cameras', 'region', 'most']) byId(id).disabled = running !== null || working;
  show(byId('stop'), running !== null);
  show(byId('progress'), running !== null);
  offerEdits();
}

function told({task, done, total, note}) {
  const bar = byId('progress').querySelector('progress');
  if (total > 0) bar.value = done / total;
  else bar.removeAttribute('value');
  byId('progress').querySelector('span').textContent = [task, note].filter(Boolean).join(', ');
}

async function enhance() {
  const mine = session;
  const messages = [];
  trouble(null);
  running = new AbortController();
  const byKeyboard = document.activeElement === byId('enhance');
  told({task: 'starting', done: 0, total: 0, note: ''});
  useTool(null);
  offer();
  if (byKeyboard) byId('stop').focus();
  const began = performance.now();
  try {
    const method = byId('quality').value;
    const options = {upscale: Number(byId('upscale').value), signal: running.signal, onProgress: told,
      onMessage: ({level, text}) => { if (level !== 'info') messages.push(sentence(text)); }};
    if (method === 'filter') options.method = 'filter';
    else options.quality = method;
    if (chosen) options.pixelSize = pixelSize();
    else if (cameras) options.cameras = cameras;
    if (byId('region').value.trim()) options.region = byId('region').value.replace(/\s+/g, '');
    if (byId('most').value) options.maxGaussians = Number(byId('most').value);
    const made = await input.splat.enhance(options);
    if (mine !== session) return await made.splat.close();
    if (result) await result.splat.close();
    result = made;
    const seconds = (performance.now() - began) / 1000;
    byId('done').textContent = `${number(made.splat.count)} Gaussians in ${seconds.toFixed(1)} s. ${messages.join(' ')}`;
    busy('Showing it…');
    await stage(await made.splat.page({before: input.splat, name: input.name, title: input.name, shDegree: shownDegree(made.splat)}));
    document.documentElement.dataset.state = 'enhanced';
  } catch (error) {
    if (mine === session && error.code !== 'interrupted') {
      trouble(error.code === 'bad_argument' ? new Error(sentence(error.message)) : error);
    }
    if (error.code === 'interrupted') byId('done').textContent = 'Stopped; the splat is as it was.';
  } finally {
    running = null;
    busy('');
    const free = document.activeElement === byId('stop') || document.activeElement === document.body;
    offer();
    if (byKeyboard && free) byId('enhance').focus();
  }
}

// Another width or zoom: what was made with the old one is not shown as its result.
async function changed() {
  tellPixelSize();
  if (!result) return preview();
  const old = result;
  result = null;
  offer();
  byId('done').textContent = '';
  await old.splat.close();
  await showInput();
}

async function save() {
  trouble(null);
  byId('download').disabled = true;
  busy('Writing…');
  try {
    const enhanced = byId('which').value === 'result' && result;
    const splat = enhanced ? result.splat : input.splat;
    const format = byId('format').value;
    const stem = input.name.replace(/(\.compressed)?\.[a-z0-9]+$/i, '') || 'splat';
    const what = `${isEdited() ? '-edited' : ''}${enhanced ? `-${byId('upscale').value}x` : ''}`;
    const before = enhanced ? input.splat : isEdited() ? input.original : undefined;
    const bytes = format === 'html'
      ? await splat.page({before, name: input.name, title: input.name,
        openYourOwn: location.protocol.startsWith('http') ? location.href.split(/[?#]/)[0] : undefined})
      : await splat.write(format);
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([bytes]));
    link.download = `${stem}${what}.${format}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  } catch (error) {
    trouble(error);
  } finally {
    byId('download').disabled = false;
    busy('');
  }
}

async function takeCameras(files) {
  cameras = null;
  byId('cameras-about').textContent = '';
  tellPixelSize();
  if (files.length === 0) return;
  if (isMoved()) {
    byId('cameras').value = '';
    byId('cameras-about').textContent = 'The splat has been turned or moved away from its cameras: undo that to use them.';
    return;
  }
  try {
    cameras = await engine.readCameras([...files].map((file) => ({name: file.name, data: file})));
    chosen = false;
    byId('pixel').value = '0';
    if (input) await changed();
  } catch (error) {
    byId('cameras-about').textContent = error.message;
  }
}

byId('choose').onclick = byId('another').onclick = () => byId('file').click();
byId('file').onchange = (event) => {
  if (event.target.files.length > 0) openFile(event.target.files[0]);
  event.target.value = '';
};
byId('enhance').onclick = enhance;
byId('stop').onclick = () => running && running.abort();
byId('download').onclick = save;
byId('cameras').onchange = (event) => takeCameras(event.target.files);
byId('pixel').oninput = () => { chosen = true; changed(); };
byId('region').onchange = byId('most').onchange = changed;
byId('pixel-auto').onclick = () => { chosen = false; byId('pixel').value = '0'; changed(); };
byId('upscale').onchange = async () => {
  gain = await input.splat.filterGain(Number(byId('upscale').value));
  changed();
};

addEventListener('dragover', (event) => {
  event.preventDefault();
  show(byId('drop'), event.dataTransfer.types.includes('Files'));
});
addEventListener('dragleave', (event) => { if (!event.relatedTarget) show(byId('drop'), false); });
addEventListener('drop', (event) => {
  event.preventDefault();
  show(byId('drop'), false);
  if (event.dataTransfer.files.length > 0) takeFiles([...event.dataTransfer.files]);
});
addEventListener('unhandledrejection', (event) => trouble(event.reason));

const SAVED = [['ply', 'PLY'], ['compressed.ply', 'compressed PLY'], ['spz', 'SPZ'], ['sog', 'SOG'], ['glb', 'glTF (.glb)'],
  ['splat', '.splat'], ['html', 'web page, before and after']];
for (const [format, label] of SAVED) byId('format').append(new Option(label, format));
byId('readable').textContent = 'PLY, compressed PLY, SPZ, SOG, .splat, KSPLAT, glTF, or a checkpoint of gsplat';
document.documentElement.dataset.state = 'ready';
document.documentElement.dataset.readyAfter = String(Math.round(performance.now()));
engine.home().catch(trouble);  // compiled while the person looks for a file

// Where it is hosted it works offline, too.
if ('serviceWorker' in navigator && location.protocol.startsWith('http')) navigator.serviceWorker.register('sw.js').catch(() => {});
