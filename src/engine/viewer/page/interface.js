'use strict';
// Hands and eyes: pointers, keys, buttons and the small things drawn over the picture. Knows the viewer only by its
// methods; no drawing here.

const byId = (id) => document.getElementById(id);
const show = (element, visible) => { element.hidden = !visible; };

function sizeText(bytes) {
  const units = ['bytes', 'kB', 'MB', 'GB'];
  let k = 0;
  for (; bytes >= 1000 && k < 3; ++k) bytes /= 1000;
  return `${bytes.toFixed(k === 0 || bytes >= 99.95 ? 0 : 1)} ${units[k]}`;
}

function setState(state, message) {
  if (document.documentElement.dataset.state === 'error') return;  // stays, whatever is still under way
  document.documentElement.dataset.state = state;
  if (message !== undefined) byId('message').querySelector('p').textContent = message;
  show(byId('reload'), state === 'error');
}

// One finger or the left button turns, the right or middle button or shift moves, two fingers move and zoom.
class PointerControl {
  constructor(canvas, viewer) {
    this.canvas = canvas;
    this.viewer = viewer;
    this.pointers = new Map();
    this.inLens = false;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const type of ['pointerup', 'pointercancel']) canvas.addEventListener(type, (event) => this.up(event));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      viewer.zoom(Math.exp(Math.max(-120, Math.min(120, event.deltaY * lines)) * 0.0016), event.clientX, event.clientY);
    }, {passive: false});
  }

  down(event) {
    this.canvas.focus({preventScroll: true});
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.inLens = event.pointerType !== 'mouse' && this.pointers.size === 1 &&
      this.viewer.insideLens(event.clientX, event.clientY);
    this.moves = event.button !== 0 || event.shiftKey;
    this.canvas.classList.add('dragging');
    this.viewer.closeMenus();
  }

  move(event) {
    if (event.pointerType === 'mouse') this.viewer.moveLens(event.clientX, event.clientY);
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before[0];
    const dy = event.clientY - before[1];
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const middle = [(event.clientX + other[0]) / 2, (event.clientY + other[1]) / 2];
      const was = Math.hypot(before[0] - other[0], before[1] - other[1]);
      const now = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
      this.viewer.pan(dx / 2, dy / 2, ...middle);
      if (was > 0 && now > 0) this.viewer.zoom(was / now, ...middle);
    } else if (this.inLens) {
      this.viewer.shiftLens(dx, dy);
    } else if (this.moves) {
      this.viewer.pan(dx, dy, event.clientX, event.clientY);
    } else if (this.pointers.size === 1) {
      this.viewer.orbit(dx * 0.006, -dy * 0.006);
    }
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.pointers.size === 0) this.canvas.classList.remove('dragging');
  }
}

function listenToKeys(viewer) {
  const turn = 0.09;
  const move = 40;
  const center = () => [innerWidth / 2, innerHeight / 2];
  const arrow = (x, y) => (event) =>
    (event.shiftKey ? viewer.pan(-x * move, -y * move, ...center()) : viewer.orbit(x * turn, -y * turn));
  const keys = {
    s: () => viewer.setMode('slider'),
    x: () => viewer.setMode('side'),
    d: () => viewer.setMode('difference'),
    a: () => viewer.blink(0),
    b: () => viewer.blink(1),
    ' ': () => viewer.blink(),
    ',': () => viewer.setSplit(viewer.split - 0.02),
    '.': () => viewer.setSplit(viewer.split + 0.02),
    l: () => viewer.toggleLens(),
    t: () => viewer.toggleTruth(),
    g: () => viewer.nextBackground(),
    u: () => viewer.nextUp(),
    i: () => viewer.toggleBare(),
    '?': () => viewer.toggleHelp(),
    h: () => viewer.toggleHelp(),
    escape: () => viewer.closeMenus(),
    arrowleft: arrow(-1, 0),
    arrowright: arrow(1, 0),
    arrowup: arrow(0, -1),
    arrowdown: arrow(0, 1),
    '+': () => viewer.zoom(0.9, ...center()),
    '=': () => viewer.zoom(0.9, ...center()),
    '-': () => viewer.zoom(1 / 0.9, ...center()),
    '_': () => viewer.zoom(1 / 0.9, ...center()),
    0: () => viewer.goTo(viewer.openingView()),
  };
  for (let k = 1; k <= 9; ++k) keys[k] = () => viewer.goTo(k - 1);
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.documentElement.dataset.state !== 'ready') return;
    if (event.target.closest('select, dialog')) return;
    if (event.key === ' ' && event.target.closest('button')) return;  // the button's own
    const action = keys[event.key.toLowerCase()];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}

function listenToDivider(viewer) {
  const divider = byId('divider');
  let grip = null;
  divider.addEventListener('pointerdown', (event) => {
    divider.setPointerCapture(event.pointerId);
    grip = event.clientX - viewer.split * innerWidth;
  });
  divider.addEventListener('pointermove', (event) => {
    if (grip !== null) viewer.setSplit((event.clientX - grip) / innerWidth);
  });
  for (const type of ['pointerup', 'pointercancel']) divider.addEventListener(type, () => { grip = null; });
  divider.addEventListener('keydown', (event) => {
    const step = {ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1}[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    viewer.setSplit(viewer.split + step);
  });
}

function listenToButtons(viewer) {
  for (const button of document.querySelectorAll('#modes [data-mode]')) {
    button.addEventListener('click', () => {
      const again = button.dataset.mode === 'blink' && viewer.mode === 'blink';
      if (again || button.dataset.mode === 'blink') viewer.blink();
      else viewer.setMode(button.dataset.mode);
    });
  }
  byId('lens').addEventListener('click', () => viewer.toggleLens());
  byId('background').addEventListener('click', () => viewer.nextBackground());
  byId('open-help').addEventListener('click', () => viewer.toggleHelp());
  byId('open-views').addEventListener('click', () => viewer.toggleViews());
  byId('pair').addEventListener('change', (event) => viewer.setPair(Number(event.target.value)));
}

// Name, counts and sizes.
function fillCard(description) {
  byId('title').textContent = description.title || 'Splat';
  document.title = byId('title').textContent;
  for (const [label, splat] of [['Before', description.before], ['After', description.after]]) {
    if (!splat) continue;
    const term = document.createElement('dt');
    term.textContent = description.before ? label : 'Splat';
    const text = document.createElement('dd');
    const unit = document.createElement('span');
    unit.textContent = ' Gaussians';  // left away on a narrow screen
    text.append(splat.fileCount.toLocaleString('en'), unit);
    if (splat.fileBytes !== null) text.append(` · ${sizeText(splat.fileBytes)}`);
    const more = [splat.name, `SH degree ${splat.fileDegree}`];
    if (splat.degree < splat.fileDegree) more.push(`shown with degree ${splat.degree}`);
    if (splat.mode !== 'classic') more.push(splat.mode);
    if (splat.count < splat.fileCount) more.push(`${splat.fileCount - splat.count} with values that are not finite`);
    text.title = term.title = more.join(', ');
    byId('facts').append(term, text);
  }
  // Not in a frame: whoever has put it there has a page of their own around it.
  if (description.ownPage && window.parent === window) {
    byId('own').setAttribute('href', description.ownPage);
    byId('own').hidden = false;
  }
  byId('credits').textContent = description.credits.join('; ');
  byId('credits').hidden = description.credits.length === 0;
}

function fillViews(names, pictures, viewer) {
  names.forEach((name, k) => {
    const button = document.createElement('button');
    const key = document.createElement('kbd');
    key.textContent = k < 9 ? String(k + 1) : '';
    const text = document.createElement('span');
    text.textContent = name;
    button.append(key, text);
    if (pictures[k]) {
      const mark = document.createElement('em');
      mark.textContent = 'truth';
      button.append(mark);
    }
    button.addEventListener('click', () => viewer.goTo(k));
    byId('views').append(button);
  });
}

// A length on screen that is a round number of training pixels.
function drawScale(screenPixels, ratio) {
  const one = screenPixels / ratio;  // one training pixel in CSS pixels
  const steps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
  const n = steps.find((step) => step * one >= 44);
  show(byId('scale'), n !== undefined && n * one < 260);
  if (n === undefined) return;
  byId('scale').querySelector('i').style.width = `${(n * one).toFixed(1)}px`;
  const each = screenPixels < 10 ? screenPixels.toFixed(1) : Math.round(screenPixels);
  byId('scale').querySelector('span').textContent =
    n === 1 ? `1 training pixel, ${each} px here` : `${n} training pixels, ${each} px each`;
}

function placeRing(ring, x, y, radius) {
  ring.style.left = `${x - radius - 1}px`;
  ring.style.top = `${y - radius - 1}px`;
  ring.style.width = ring.style.height = `${2 * radius + 2}px`;
}

// The page over the picture.
function placeOverlay(viewer) {
  viewer.box.place();
  const mode = viewer.comparing ? viewer.mode : 'blink';
  const places = viewer.lens ? viewer.lensPlaces() : [];
  const divider = byId('divider');
  const portrait = innerWidth <= innerHeight;
  show(divider, mode === 'slider' || mode === 'side');
  divider.classList.toggle('fixed', mode === 'side');
  divider.classList.toggle('level', mode === 'side' && portrait);
  const at = mode === 'slider' ? viewer.split * 100 : 50;
  divider.style.left = mode === 'side' && portrait ? '' : `${at}%`;
  divider.style.top = mode === 'side' && portrait ? '50%' : '';
  divider.setAttribute('aria-valuenow', String(Math.round(at)));

  const tags = [byId('tag-first'), byId('tag-second')];
  const card = byId('card').getBoundingClientRect();
  const line = at / 100 * innerWidth;
  const crowded = line - 90 < card.right || line + 90 > byId('tools').getBoundingClientRect().left;
  const top = crowded && mode !== 'difference' ? card.bottom + 10 : 16;
  tags.forEach((tag, k) => {
    tag.textContent = NAMES[viewer.pairs[viewer.pair][k]];
    show(tag, viewer.comparing && (mode === 'slider' || mode === 'side' || (mode === 'blink' && viewer.side === k)));
    tag.style.top = `${mode === 'side' && portrait && k === 1 ? innerHeight / 2 + 12 : top}px`;
    tag.style.left = mode === 'blink' || (mode === 'side' && portrait) ? '50%' : `${at}%`;
    const shift = mode === 'blink' || (mode === 'side' && portrait) ? '-50%' : k === 0 ? 'calc(-100% - 14px)' : '14px';
    tag.style.transform = `translateX(${shift})`;
  });

  const rings = [byId('ring-first'), byId('ring-second')];
  rings.forEach((ring, k) => {
    show(ring, k < places.length);
    if (k < places.length) placeRing(ring, places[k][0], places[k][1], viewer.lensRadius);
  });

  show(byId('legend'), mode === 'difference');
  show(byId('modes'), true);
  for (const button of document.querySelectorAll('#modes [data-mode]')) {
    show(button, viewer.comparing);
    button.setAttribute('aria-pressed', String(button.dataset.mode === mode));
  }
  show(document.querySelector('#modes hr'), viewer.comparing);
  byId('lens').setAttribute('aria-pressed', String(viewer.lens !== null));
  byId('pair').value = String(viewer.pair);
  [...byId('views').children].forEach((button, k) => button.setAttribute('aria-pressed', String(k === viewer.view)));
  const {pixelSize} = viewer.description;
  if (pixelSize !== null) {
    drawScale(pixelSize * viewer.camera.intrinsics(viewer.regions()[0]).fx / viewer.camera.distance, viewer.ratio);
  }
}

// The page that has this one as its stage (web/), if there is one: {widening} and {look} set these, {tell: 'look'} asks,
// {box: true} and {box: false} begin and end a box to crop with, {roll} turns the picture clockwise, in radians, or back (null). It hears
// {ready, subject}, {look}, {box} (CropBox) and {undo} or {redo} from keys.
function listenToParent(viewer) {
  if (window.parent === window) return;
  addEventListener('message', ({source, data}) => {
    if (source !== window.parent || typeof data !== 'object' || data === null) return;
    if (typeof data.widening === 'number') viewer.preview(data.widening);
    if (data.look) viewer.look = data.look;
    if (data.roll !== undefined) viewer.roll(data.roll);
    if (data.box === true) viewer.box.begin();
    if (data.box === false) viewer.box.end();
    if (data.tell === 'look') window.parent.postMessage({look: viewer.look}, '*');
  });
  addEventListener('keydown', (event) => {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || !['z', 'y'].includes(key)) return;
    event.preventDefault();
    window.parent.postMessage(key === 'y' || event.shiftKey ? {redo: true} : {undo: true}, '*');
  });
  window.parent.postMessage({ready: true, subject: viewer.splats.after.description.subject}, '*');
}
