'use strict';
// When which picture is drawn, and with how many pixels. What a graphics card draws in a moment is drawn whole and at once.
// Where that takes longer, whatever moves is drawn with fewer pixels, and what stands still for a while with all of them:
// some Gaussians at a time, so that the next movement need not wait for the rest. What has not changed is not drawn again.

const BUDGET = 40;            // ms of the graphics card for what moves, and for a slice of what stands still
const COMFORT = 30;           // ms that are aimed at
const STILL = 150;            // ms without a change, until all pixels are drawn
const LEAST_SLICE = 4096;     // Gaussians
const FIRST_SLICE = 65536;    // before anything is known
const COARSEST = 4;           // pixels of the screen per pixel drawn, along either axis; from there on corners cost more than pixels
const FEWEST = 3;             // the same of the screen's own buffer, while a picture is coarse
const PICTURES = 4;           // first, second, and the same under the lens; as many coarse ones follow

// How much the graphics card does in `BUDGET`: learnt from how long it took, as it says by fences.
class Pace {
  constructor(gl, onFree) {
    this.gl = gl;
    this.onFree = onFree;
    this.slices = [FIRST_SLICE, FIRST_SLICE];  // Gaussians at once, of the pictures and of those under the lens
    this.coarseness = 0;                       // not known yet
    this.work = null;                          // what the graphics card is at
  }

  // `learn` gets the time that everything asked of the graphics card from `began` until now took.
  watch(began, learn) {
    const {gl} = this;
    this.work = {sync: gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), began, learn};
    gl.flush();
    this.poll();
  }

  poll() {
    setTimeout(() => {
      if (this.busy) this.poll();
      else this.onFree();
    }, 2);
  }

  get busy() {
    const {gl, work} = this;
    if (!work) return false;
    const lost = !work.sync || gl.isContextLost();
    if (!lost && gl.getSyncParameter(work.sync, gl.SYNC_STATUS) !== gl.SIGNALED) return true;
    this.work = null;
    if (lost) return false;
    gl.deleteSync(work.sync);
    work.learn(performance.now() - work.began);
    return false;
  }

  learnSlice(kind, count, time) {
    const fit = Math.max(LEAST_SLICE, Math.floor(count * COMFORT / Math.max(time, 1)));
    const now = this.slices[kind];
    if (time > BUDGET) this.slices[kind] = Math.min(now, fit);
    else if (count >= now / 2) this.slices[kind] = Math.max(now, Math.min(fit, 4 * now));
  }

  // The first guess: as many pixels fewer as there are slices.
  coarsenessFor(kind, count) {
    if (this.coarseness === 0) this.coarseness = Math.ceil(Math.sqrt(count / this.slices[kind]));
    this.coarseness = Math.max(2, Math.min(COARSEST, this.coarseness));
    return this.coarseness;
  }

  learnCoarseness(time) {
    if (time > BUDGET) this.coarseness = Math.max(this.coarseness + 1, Math.round(this.coarseness * Math.sqrt(time / COMFORT)));
    else if (time < BUDGET / 3) --this.coarseness;
  }
}

// What a target holds: the picture of `key` inside of `clip`, as far as it is drawn.
class Held {
  constructor() {
    this.key = null;
    this.clip = null;
    this.drawn = 0;  // Gaussians
    this.whole = false;
  }

  begun({key, clip}) {
    const c = this.clip;
    return this.key === key && clip.x >= c.x && clip.y >= c.y && clip.x + clip.width <= c.x + c.width &&
      clip.y + clip.height <= c.y + c.height;
  }

  has(picture) { return this.whole && this.begun(picture); }
}

class Pictures {
  // `draw(picture, target, across, down, first, count)` draws that many Gaussians, or a picture that has none, with
  // intrinsics that are `across` and `down` times as large. `again()` asks for an update soon.
  constructor(renderer, draw, again) {
    this.renderer = renderer;
    this.draw = draw;
    this.again = again;
    this.pace = new Pace(renderer.gl, again);
    this.held = Array.from({length: 2 * PICTURES}, () => new Held());
    this.asked = '';
    this.changed = 0;
    this.timer = 0;
  }

  get busy() { return this.pace.busy; }

  // Draws of `wanted` what is missing, as far as there is time. A picture: {k, key, clip, width, height, count}; `key`
  // says all that it depends on but its clip. Returns {drawn, whole, targets, fewer}: whether there is anything new to show,
  // whether it is with all pixels, which target has each of the four, and how many times fewer pixels the screen needs.
  update(wanted) {
    const now = performance.now();
    const asked = JSON.stringify(wanted.map(({k, key, clip}) => [k, key, clip]));
    if (asked !== this.asked) {
      this.asked = asked;
      this.changed = now;
    }
    const missing = wanted.filter((picture) => !this.held[picture.k].has(picture));
    const rough = missing.filter((picture) => !this.held[PICTURES + picture.k].has(picture));
    const kind = missing.some(({k}) => k < 2) ? 0 : 1;
    const count = missing.reduce((sum, picture) => sum + this.left(picture), 0);
    const slice = this.pace.slices[kind];
    let drawn = false;
    if (missing.length > 0 && (count <= slice || (rough.length === 0 && now - this.changed >= STILL))) {
      this.sharpen(missing, slice);
      this.pace.watch(now, (time) => this.pace.learnSlice(kind, Math.min(count, slice), time));
      drawn = count <= slice;
    } else if (rough.length > 0) {
      const coarseness = this.pace.coarsenessFor(kind, count);
      for (const picture of rough) this.roughen(picture, coarseness);
      this.pace.watch(now, (time) => this.pace.learnCoarseness(time));
      drawn = true;
    } else if (missing.length > 0) {
      clearTimeout(this.timer);
      this.timer = setTimeout(this.again, STILL - (now - this.changed) + 1);
    }
    const targets = Array.from({length: PICTURES}, (_, k) => k);
    let whole = true;
    for (const picture of wanted) {
      if (this.held[picture.k].has(picture)) continue;
      targets[picture.k] += PICTURES;
      whole = false;
    }
    return {drawn, whole, targets, fewer: whole ? 1 : Math.max(1, Math.min(FEWEST, this.pace.coarseness))};
  }

  // Gaussians that are still to be drawn.
  left(picture) { return picture.count - (this.held[picture.k].begun(picture) ? this.held[picture.k].drawn : 0); }

  // Goes on with what is missing, by `room` Gaussians at most.
  sharpen(missing, room) {
    for (const picture of missing) {
      const {k, key, clip, width, height, count} = picture;
      const held = this.held[k];
      if (held.begun(picture)) {
        this.renderer.select(k);
      } else {
        Object.assign(held, {key, clip, drawn: 0, whole: false});
        this.renderer.begin(k, width, height, clip);
      }
      const part = Math.min(room, count - held.drawn);
      this.draw(picture, k, 1, 1, held.drawn, part);
      held.drawn += part;
      room -= part;
      held.whole = held.drawn === count;
      if (!held.whole) return;
    }
  }

  roughen(picture, coarseness) {
    const {k, key, clip, width, height, count} = picture;
    const columns = Math.ceil(width / coarseness);
    const rows = Math.ceil(height / coarseness);
    const [across, down] = [columns / width, rows / height];
    // A pixel more on every side: those of the screen are between them.
    const x = Math.floor(clip.x * across) - 1;
    const y = Math.floor(clip.y * down) - 1;
    this.renderer.begin(PICTURES + k, columns, rows, {x, y,
      width: Math.ceil((clip.x + clip.width) * across) + 1 - x, height: Math.ceil((clip.y + clip.height) * down) + 1 - y});
    this.draw(picture, PICTURES + k, across, down, 0, count);
    Object.assign(this.held[PICTURES + k], {key, clip, drawn: count, whole: true});
  }
}
