'use strict';
// The viewer: what is compared, from where, and when to draw.

const LENS_MAGNIFICATION = 4;
const DIFFERENCE_TOP = 0.25;
const NAMES = {before: 'Before', after: 'After', truth: 'Truth'};
const OWN_VIEWS = [
  ['Three quarters', [0.9, 0.45, 0.9]], ['Front', [0, 0.12, 1]], ['Right', [1, 0.12, 0]], ['Back', [0, 0.12, -1]],
  ['Left', [-1, 0.12, 0]], ['Above', [0, 1, 0.001]],
];

class Viewer {
  constructor(description, canvas) {
    this.description = description;
    this.canvas = canvas;
    this.size = {width: 0, height: 0};  // in device pixels
    this.renderer = new Renderer(canvas, description.constants);
    this.pictures = new Pictures(this.renderer, (...what) => this.drawPicture(...what), () => this.request());
    const source = elementText('worker-source');
    const order = (splat, indices, count) => {
      this.renderer.setOrder(splat, indices, count);
      this.draw();
    };
    this.splats = {};
    for (const name of ['before', 'after']) {
      if (description[name]) this.splats[name] = new Splat(description[name], source, order, fail);
    }
    this.pairs = this.splats.before ? [['before', 'after']] : [['after', 'after']];
    if (description.views.some((view) => view.picture)) {
      this.pairs.push(['after', 'truth']);
      if (this.splats.before) this.pairs.push(['before', 'truth']);
    }
    this.pair = 0;
    this.mode = 'slider';
    this.side = 1;        // which of the pair A / B shows
    this.split = 0.5;
    this.lens = null;     // [x, y] in CSS pixels
    this.view = null;     // index of the view the camera is still at
    this.truths = new Map();
    this.backgrounds = [description.background];
    for (const shade of [0, 1, 0.5, 0.16]) {
      if (!this.backgrounds.some((b) => b.every((x) => Math.abs(x - shade) < 0.02))) this.backgrounds.push([shade, shade, shade]);
    }
    this.backgroundIndex = 0;
    this.box = new CropBox(this, (box) => window.parent.postMessage({box}, '*'));
    this.widening = 0;    // of `after`, beside itself as `before`: the filter, while a person looks for its width
    this.frameRequested = false;
    this.stale = true;    // something was asked for that is not on screen
    this.ready = false;
  }

  async load() {
    const splats = Object.values(this.splats);
    // What came first is shown while the rest is still to come.
    await Promise.all(splats.map((splat) => new Promise((resolve, reject) => {
      this.renderer.addSplat(splat);
      splat.load((part) => {
        this.renderer.addPart(splat, part);
        this.partArrived();
        resolve();
      }).catch((error) => {
        reject(error);
        if (this.camera) fail(error);
      });
    })));
    const after = this.splats.after.description;
    this.camera = new OrbitCamera(after.center, after.radius, this.description.up);
    const names = this.description.views.map((view, k) => view.name || `View ${k + 1}`);
    fillViews([...names, ...OWN_VIEWS.map(([name]) => name)], this.description.views.map((view) => view.picture), this);
    this.pairs.forEach(([first, second], k) => {
      const option = document.createElement('option');
      option.value = String(k);
      option.textContent = first === second ? 'nothing' : `${NAMES[first].toLowerCase()} and ${NAMES[second].toLowerCase()}`;
      byId('pair').append(option);
    });
    show(byId('compare'), this.pairs.length > 1);
    byId('legend-top').textContent = `${DIFFERENCE_TOP}+ apart`;
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    for (const ring of document.querySelectorAll('.ring span')) ring.textContent = `×${LENS_MAGNIFICATION}`;
    this.goTo(this.openingView());
  }

  partArrived() {
    const splats = Object.values(this.splats);
    const sum = (value) => splats.reduce((total, splat) => total + value(splat), 0);
    const share = sum((splat) => splat.arrived) / sum((splat) => splat.description.count);
    byId('arriving').textContent = `${Math.floor(100 * share)} % loaded`;
    show(byId('arriving'), share < 1);
    document.documentElement.dataset.arrived = String(share);
    if (this.camera) this.cameraChanged();
  }

  // The first view, unless it looks straight down or up and another one does not.
  openingView() {
    const {views} = this.description;
    const level = views.findIndex((view) => Math.abs(dot(view.rotation.slice(6, 9), this.camera.up)) < 0.6);
    return Math.max(0, level);
  }

  get comparing() { return !this.box.shown && this.pairs[this.pair][0] !== this.pairs[this.pair][1]; }  // the box is of one splat
  get ratio() { return Math.min(devicePixelRatio || 1, 2); }
  get lensRadius() { return Math.round(Math.max(78, Math.min(150, 0.23 * Math.min(innerWidth, innerHeight)))); }

  // What a person can do.

  goTo(k) {
    const views = this.description.views;
    if (k >= views.length + OWN_VIEWS.length) return;
    if (k < views.length) this.camera.lookThrough(views[k]);
    else this.camera.lookFrom(OWN_VIEWS[k - views.length][1]);
    this.view = k;
    if (this.pairs[this.pair].includes('truth') && !this.truthHere()) this.pair = 0;
    this.cameraChanged();
  }

  orbit(yaw, pitch) {
    this.camera.orbit(yaw, pitch);
    this.leaveView();
  }

  // `angle` null: back to the up of the page.
  roll(angle) {
    if (angle === null) this.camera.level(this.description.up);
    else this.camera.roll(angle);
    this.leaveView();
  }

  pan(dx, dy, x, y) {
    this.camera.pan(dx * this.ratio, dy * this.ratio, this.regionAt(x, y));
    this.leaveView();
  }

  zoom(factor, x, y) {
    this.camera.zoom(factor, x * this.ratio, y * this.ratio, this.regionAt(x, y));
    this.leaveView();
  }

  // A true picture was taken from one place: elsewhere there is nothing to compare with.
  leaveView() {
    this.view = null;
    if (this.pairs[this.pair].includes('truth')) this.pair = 0;
    this.cameraChanged();
  }

  setMode(mode) {
    if (!this.comparing) return;
    this.mode = mode;
    this.draw();
  }

  blink(side) {
    if (!this.comparing) return;
    this.side = side !== undefined ? side : this.mode === 'blink' ? 1 - this.side : this.side;
    this.mode = 'blink';
    this.draw();
  }

  setSplit(split) {
    if (!this.comparing) return;
    this.mode = 'slider';
    this.split = Math.max(0, Math.min(1, split));
    this.draw();
  }

  // Shows the only splat of a page with this variance added to its Gaussians, beside itself as it is.
  preview(widening) {
    if (!this.splats.before) {
      this.splats.before = this.splats.after;
      this.pairs = [['before', 'after']];
      this.pair = 0;
    }
    this.widening = widening;
    document.documentElement.dataset.widening = String(widening);
    this.draw();
  }

  // Where one looks from and how, for a page that takes over from another one.
  get look() {
    const {axes, frame, target, distance, up} = this.camera;
    return {axes, frame, target, distance, up, mode: this.mode, side: this.side, split: this.split,
      background: this.backgroundIndex};
  }

  set look({axes, frame, target, distance, up, mode, side, split, background}) {
    Object.assign(this.camera, {axes, frame, target, distance, up});
    Object.assign(this, {mode, side, split, backgroundIndex: Math.min(background, this.backgrounds.length - 1), view: null});
    this.cameraChanged();
  }

  setPair(k) {
    this.pair = k;
    if (this.pairs[k].includes('truth') && !this.truthHere()) {
      this.goTo(this.description.views.findIndex((view) => view.picture));
    }
    this.draw();
  }

  toggleTruth() {
    const k = this.pairs.findIndex((pair) => pair.includes('truth'));
    if (k >= 0) this.setPair(this.pair >= k ? 0 : k);
  }

  toggleLens() {
    const {x, y, width, height} = this.regions()[0];
    this.lens = this.lens ? null : [(x + width / 2) / this.ratio, (y + height / 2) / this.ratio];
    this.draw();
  }

  moveLens(x, y) {
    if (!this.lens) return;
    this.lens = [x, y];
    this.draw();
  }

  shiftLens(dx, dy) { this.moveLens(this.lens[0] + dx, this.lens[1] + dy); }

  insideLens(x, y) {
    return this.lens !== null &&
      this.lensPlaces().some(([lx, ly]) => Math.hypot(x - lx, y - ly) < this.lensRadius);
  }

  nextBackground() {
    this.backgroundIndex = (this.backgroundIndex + 1) % this.backgrounds.length;
    this.draw();
  }

  nextUp() {
    const all = [[0, -1, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0]];
    const k = all.findIndex((up) => dot(up, this.camera.up) > 0.99);
    this.camera.up = all[(k + 1) % all.length];
    this.camera.lookFrom(OWN_VIEWS[0][1]);
    this.leaveView();
  }

  toggleBare() {
    document.body.classList.toggle('bare');
    this.draw();
  }

  toggleHelp() {
    this.closeMenus();
    byId('help').showModal();
  }

  toggleViews() {
    const open = byId('views').hidden;
    show(byId('views'), open);
    byId('open-views').setAttribute('aria-expanded', String(open));
  }

  closeMenus() {
    if (!byId('views').hidden) this.toggleViews();
  }

  // Where things are, in device pixels unless said otherwise.

  // The parts of the screen that the first and the second picture have to themselves.
  halves() {
    const {width, height} = this.size;
    const whole = {x: 0, y: 0, width, height};
    if (this.mode !== 'side' || !this.comparing) return [whole, whole];
    if (width > height) {
      const middle = Math.round(width / 2);
      return [{...whole, width: middle}, {...whole, x: middle, width: width - middle}];
    }
    const middle = Math.round(height / 2);
    return [{...whole, height: middle}, {...whole, y: middle, height: height - middle}];
  }

  // Where in them the camera's frame is fitted: one above the other on a phone, clear of what is drawn over them.
  regions() {
    const halves = this.halves();
    if (halves[1].y === 0 || document.body.classList.contains('bare')) return halves;
    const top = (byId('card').getBoundingClientRect().bottom + 4) * this.ratio;
    const bottom = (innerHeight - byId('modes').getBoundingClientRect().top + 4) * this.ratio;
    const height = Math.max(0.5 * halves[0].height, halves[0].height - Math.max(top, bottom));
    return [{...halves[0], y: halves[0].height - height, height}, {...halves[1], height}];
  }

  inSecond(x, y) {
    const [, second] = this.halves();
    return (second.x > 0 && x * this.ratio >= second.x) || (second.y > 0 && y * this.ratio >= second.y);
  }

  regionAt(x, y) { return this.regions()[this.inSecond(x, y) ? 1 : 0]; }

  // Centres of the lens in CSS pixels, one, or one in each half: the same place of the object twice.
  lensPlaces() {
    const [first, second] = this.regions();
    const shift = [(second.x - first.x) / this.ratio, (second.y - first.y) / this.ratio];
    if (shift[0] === 0 && shift[1] === 0) return [this.lens];
    const [x, y] = this.lens;
    const place = this.inSecond(x, y) ? [x - shift[0], y - shift[1]] : [x, y];
    return [place, [place[0] + shift[0], place[1] + shift[1]]];
  }

  truthHere() {
    const view = this.view === null ? undefined : this.description.views[this.view];
    return view && view.picture ? view.picture : null;
  }

  // The texture of the true picture at this view; null while it is being decoded.
  truthTexture() {
    const picture = this.truthHere();
    if (!picture) return null;
    const id = picture.element;
    if (!this.truths.has(id)) {
      this.truths.set(id, null);
      const image = new Image();
      image.onload = () => {
        this.truths.set(id, this.renderer.pictureTexture(image));
        this.draw();
      };
      image.onerror = () => fail(new Error('a picture in this file cannot be decoded'));
      image.src = `data:${picture.type};base64,${elementText(id)}`;
    }
    return this.truths.get(id);
  }

  // Drawing.

  // Where the picture begins, as the renderer has it: scenes may have any unit.
  near(splat) {
    const {near, nearShare} = this.description.constants;
    const {target, radius} = splat.description.subject;
    return Math.min(near, nearShare * Math.max(Math.hypot(...add(this.camera.eye, target, -1)), radius));
  }

  cameraChanged() {
    const {camera} = this;
    for (const splat of Object.values(this.splats)) {
      const depth = dot(camera.forward, add(splat.description.center, camera.eye, -1));
      splat.requestOrder(camera.forward, depth, this.near(splat));
    }
    this.draw();
  }

  draw() {
    document.documentElement.dataset.settled = 'false';
    this.stale = true;
    this.request();
  }

  request() {
    if (this.frameRequested) return;
    this.frameRequested = true;
    requestAnimationFrame(() => {
      this.frameRequested = false;
      try {
        this.frame();
      } catch (error) {
        fail(error);
      }
    });
  }

  // Picture k of `name`, the scene seen through `intrinsics`, for Pictures.
  wanted(k, name, intrinsics, tangents, clip, width, height) {
    const {axes, eye} = this.camera;
    const see = name === 'truth' ? {texture: this.truthTexture(), intrinsics}
      : {axes, eye, intrinsics, tangents, near: this.near(this.splats[name]), widening: name === 'after' ? this.widening : 0,
        box: this.box.seenFrom(this.splats[name].description.center)};
    const splat = name === 'truth' ? null : this.splats[name];
    const key = JSON.stringify([name, width, height, ...(splat ? [splat.orders, see] : [this.view, see.texture !== null, intrinsics])]);
    return {k, key, clip, width, height, count: splat ? splat.visible : 0, splat, see};
  }

  drawPicture({splat, see}, target, across, down, first, count) {
    const {fx, fy, cx, cy, left, top, width, height} = see.intrinsics;
    const intrinsics = {fx: fx * across, fy: fy * down, cx: cx * across, cy: cy * down,
      left: left * across, top: top * down, width: width * across, height: height * down};
    if (splat) this.renderer.drawSplat(target, splat, {...see, intrinsics, first, count, share: across * down});
    else if (see.texture) this.renderer.drawPicture(target, see.texture, intrinsics);
  }

  frame() {
    const {canvas, renderer, ratio} = this;
    if (this.pictures.busy) {
      placeOverlay(this);
      return;  // another frame comes when the graphics card is free
    }
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (this.size.width !== width || this.size.height !== height) {
      this.size = {width, height};
      this.stale = true;
    }
    const mode = this.comparing ? this.mode : 'blink';
    const side = this.comparing ? this.side : 1;
    const pair = this.pairs[this.pair];
    const regions = this.regions();
    const halves = this.halves();
    const splitX = Math.round(this.split * width);
    const places = this.lens ? this.lensPlaces() : [];
    const lensSize = 2 * Math.ceil(this.lensRadius * ratio);

    const wanted = [];
    for (const k of [0, 1]) {
      let clip = halves[k];
      if (mode === 'slider') {
        clip = k === 0 ? {...clip, width: splitX} : {...clip, x: splitX, width: width - splitX};
      }
      if (mode === 'blink' && side !== k) continue;
      const intrinsics = this.camera.intrinsics(regions[k]);
      const tangents = this.tangents(intrinsics, halves[k]);
      if (clip.width > 0) wanted.push(this.wanted(k, pair[k], intrinsics, tangents, clip, width, height));
      if (places.length === 0) continue;
      const place = places[Math.min(k, places.length - 1)].map((c) => c * ratio);
      wanted.push(this.wanted(2 + k, pair[k], this.closer(intrinsics, place, lensSize), tangents,
        {x: 0, y: 0, width: lensSize, height: lensSize}, lensSize, lensSize));
    }
    const pictures = this.pictures.update(wanted);
    if (!pictures.drawn && !this.stale) return;
    this.stale = false;

    const nowhere = [0, 0, 0];
    const lenses = places.map(([x, y]) => [x * ratio, y * ratio, this.lensRadius * ratio]);
    const splits = {slider: [splitX, -1], side: [halves[1].x, halves[1].y], difference: [-1, -1],
      blink: side === 0 ? [2 * width, -1] : [-1, -1]};
    renderer.show({
      targets: pictures.targets, width, height, fewer: pictures.fewer,
      split: splits[mode], difference: mode === 'difference', differenceTop: DIFFERENCE_TOP,
      // A true picture brings its own background.
      background: this.backgrounds[pair.includes('truth') ? 0 : this.backgroundIndex], lenses: [...lenses, nowhere, nowhere].slice(0, 2), lensSize,
    });
    placeOverlay(this);
    document.documentElement.dataset.pixels = pictures.whole ? 'all' : 'fewer';
    document.documentElement.dataset.drawnWidening = String(this.widening);
    this.settle(pictures.whole);
  }

  // How far x/z and y/z may go in the Jacobian: what is seen and a margin, as the renderer has it.
  tangents({fx, fy, cx, cy}, {x, y, width, height}) {
    const margin = 0.5 * this.description.constants.frustumMargin;
    return [(x - cx - margin * width) / fx, (x - cx + (1 + margin) * width) / fx,
      (y - cy - margin * height) / fy, (y - cy + (1 + margin) * height) / fy];
  }

  // Under the lens: the scene itself four times closer, not the picture's pixels four times larger.
  closer({fx, fy, cx, cy, left, top, width, height}, [x, y], size) {
    const m = LENS_MAGNIFICATION;
    const place = (value, origin) => (value - origin) * m + size / 2;
    return {fx: fx * m, fy: fy * m, cx: place(cx, x), cy: place(cy, y),
      left: place(left, x), top: place(top, y), width: width * m, height: height * m};
  }

  // The page says when what is on screen is final: for those who take pictures of it.
  settle(whole) {
    const splats = Object.values(this.splats);
    const waiting = splats.some((splat) => splat.sorting) ||
      (this.pairs[this.pair].includes('truth') && !this.truthTexture());
    if (waiting) return;
    if (!this.ready) {
      this.ready = true;
      setState('ready');
      document.documentElement.dataset.readyAfter = String(Math.round(performance.now()));
      this.draw();  // measures of the overlay are known only now that it is visible
      return;
    }
    if (!whole || splats.some((splat) => !splat.complete)) return;
    document.documentElement.dataset.settled = 'true';
  }
}

function fail(error) {
  console.warn(error);
  setState('error', `This page cannot be shown. ${error.message || error}`);
}

async function main() {
  byId('reload').addEventListener('click', () => location.reload());
  addEventListener('error', (event) => {
    // A part that was cut is a script that makes no sense; loadPart says so in better words.
    if (awaitedParts > 0 && !(event.error && !(event.error instanceof SyntaxError))) return;
    fail(event.error || new Error(event.message));
  });
  addEventListener('unhandledrejection', (event) => fail(event.reason));
  try {
    if (typeof DecompressionStream === 'undefined') {
      throw new Error('It needs a browser of 2023 or later (Chrome or Edge 80, Safari 16.4, Firefox 113).');
    }
    const description = readDescription();
    fillCard(description);
    const canvas = byId('canvas');
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      fail(new Error('The graphics card was reset or is out of memory.'));
    });
    const viewer = new Viewer(description, canvas);
    await viewer.load();
    new PointerControl(canvas, viewer);
    listenToKeys(viewer);
    listenToDivider(viewer);
    listenToButtons(viewer);
    listenToParent(viewer);
  } catch (error) {
    fail(error);
  }
}
