'use strict';
// A box around a part of the splat, which a page around this one asks for (web/): edges over the picture, a handle on
// each side that moves it, and one in the middle that moves all of it. What lies outside is drawn faint.

const OUTSIDE = 0.08;  // of the opacity
const AXES = ['x', 'y', 'z'];
const SIDES = [0, 1, 2].flatMap((axis) => [{axis, end: 'low'}, {axis, end: 'high'}]);
const MIDDLE = {axis: null};

class CropBox {
  // `onChange`: called with {low, high, done} after every step of a drag and, `done`, at its end.
  constructor(viewer, onChange) {
    this.viewer = viewer;
    this.onChange = onChange;
    this.low = null;  // in the page's world; null: there is no box
    this.high = null;
    this.layer = null;
    this.handles = [];
  }

  get shown() { return this.low !== null; }

  // Around what the picture is of, a little more.
  begin() {
    const {target, radius, half} = this.viewer.splats.after.description.subject;
    this.least = 1e-4 * radius;
    const reach = half.map((x) => Math.max(1.05 * x, 0.02 * radius));
    this.low = target.map((x, k) => x - reach[k]);
    this.high = target.map((x, k) => x + reach[k]);
    if (!this.layer) this.build();
    show(this.layer, true);
    this.changed(true);
  }

  end() {
    this.low = this.high = null;
    if (this.layer) show(this.layer, false);
    this.viewer.draw();
  }

  changed(done) {
    this.onChange({low: this.low, high: this.high, done});
    this.viewer.draw();
  }

  build() {
    this.layer = document.createElement('div');
    this.layer.id = 'box';
    this.layer.setAttribute('role', 'group');
    this.layer.setAttribute('aria-label', 'Box');
    const {namespaceURI} = document.querySelector('svg');
    const lines = document.createElementNS(namespaceURI, 'svg');
    this.lines = ['far', 'near'].map((name) => {
      const path = document.createElementNS(namespaceURI, 'path');
      path.setAttribute('class', name);
      lines.append(path);
      return path;
    });
    this.layer.append(lines);
    for (const handle of [...SIDES, MIDDLE]) this.layer.append(this.buildHandle(handle));
    byId('canvas').after(this.layer);
  }

  buildHandle({axis, end}) {
    const element = document.createElement('button');
    const name = axis === null ? 'Middle of the box' : `Side of the box: ${end === 'low' ? 'smallest' : 'largest'} ${AXES[axis]}`;
    element.className = axis === null ? 'middle' : AXES[axis];
    element.setAttribute('aria-label', `${name}; arrow keys move it`);
    const handle = {element, axis, end, grip: null};
    element.addEventListener('pointerdown', (event) => {
      element.setPointerCapture(event.pointerId);
      const {x, y} = this.project(this.placeOf(handle));
      handle.grip = [event.clientX - x, event.clientY - y];
    });
    element.addEventListener('pointermove', (event) => {
      if (handle.grip) this.drag(handle, event.clientX - handle.grip[0], event.clientY - handle.grip[1]);
    });
    for (const type of ['pointerup', 'pointercancel']) {
      element.addEventListener(type, () => {
        if (handle.grip) this.changed(true);
        handle.grip = null;
      });
    }
    element.addEventListener('keydown', (event) => this.key(handle, event));
    this.handles.push(handle);
    return element;
  }

  placeOf({axis, end}) {
    const place = this.low.map((x, k) => 0.5 * (x + this.high[k]));
    if (axis !== null) place[axis] = this[end][axis];
    return place;
  }

  // On screen, in CSS pixels; `z` is the camera's, `fx` and `fy` are pixels per tangent.
  project(place) {
    const {camera, ratio} = this.viewer;
    const {fx, fy, cx, cy} = camera.intrinsics(this.viewer.regions()[0]);
    const from = add(place, camera.eye, -1);
    const [x, y, z] = camera.axes.map((axis) => dot(axis, from));
    return {x: (cx + fx * x / z) / ratio, y: (cy + fy * y / z) / ratio, z, fx: fx / ratio, fy: fy / ratio, tangents: [x / z, y / z]};
  }

  // Moves the side so that its handle comes as near to (x, y) as it can.
  drag(handle, x, y) {
    if (handle.axis === null) return this.dragAll(x, y);
    const along = this.viewer.camera.axes.map((axis) => axis[handle.axis]);
    for (let step = 0; step < 4; ++step) {
      const at = this.project(this.placeOf(handle));
      if (!(at.z > this.nearest)) break;
      // Pixels per unit of length; of an axis that points at the viewer there are hardly any, and a pixel must not be a mile.
      const slope = [at.fx * (along[0] - at.tangents[0] * along[2]) / at.z, at.fy * (along[1] - at.tangents[1] * along[2]) / at.z];
      const square = Math.max(dot([...slope, 0], [...slope, 0]), (0.3 * at.fx / at.z) ** 2);
      this.shift(handle, (slope[0] * (x - at.x) + slope[1] * (y - at.y)) / square);
    }
    this.changed(false);
  }

  dragAll(x, y) {
    const at = this.project(this.placeOf(MIDDLE));
    const {axes} = this.viewer.camera;
    const by = add(axes[0].map((a) => a * (x - at.x) * at.z / at.fx), axes[1], (y - at.y) * at.z / at.fy);
    this.low = add(this.low, by);
    this.high = add(this.high, by);
    this.changed(false);
  }

  // A side stays on its side of the other one.
  shift({axis, end}, by) {
    const moved = this[end][axis] + by;
    this[end] = this[end].slice();
    this[end][axis] = end === 'low' ? Math.min(moved, this.high[axis] - this.least) : Math.max(moved, this.low[axis] + this.least);
  }

  key(handle, event) {
    const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key] || [0, 0];
    if (x === 0 && y === 0) return;
    event.preventDefault();
    event.stopPropagation();
    if (handle.axis === null) {
      const at = this.project(this.placeOf(handle));
      const pixels = event.shiftKey ? 50 : 10;
      this.dragAll(at.x + pixels * x, at.y + pixels * y);
    } else {
      const length = this.high[handle.axis] - this.low[handle.axis];
      this.shift(handle, (x - y) * length * (event.shiftKey ? 0.1 : 0.02));
    }
    this.changed(true);
  }

  get nearest() { return 0.01 * this.viewer.camera.distance; }

  // Sides that one looks at from outside; from within all of them count.
  facing() {
    const {eye} = this.viewer.camera;
    const faces = SIDES.map(({axis, end}) => (end === 'low' ? eye[axis] < this.low[axis] : eye[axis] > this.high[axis]));
    return faces.some(Boolean) ? faces : faces.map(() => true);
  }

  // Where a line from `a` to `b` is before the viewer; '' where it is nowhere.
  lineOf(a, b) {
    let [from, to] = [a, b];
    const [near, far] = [this.project(a).z - this.nearest, this.project(b).z - this.nearest];
    if (near <= 0 && far <= 0) return '';
    const cut = add(a, add(b, a, -1), near / (near - far));
    if (near <= 0) from = cut;
    if (far <= 0) to = cut;
    const [p, q] = [this.project(from), this.project(to)];
    return `M${p.x.toFixed(1)} ${p.y.toFixed(1)}L${q.x.toFixed(1)} ${q.y.toFixed(1)}`;
  }

  // Puts everything where the camera sees it.
  place() {
    if (!this.shown) return;
    const faces = this.facing();
    const paths = {far: '', near: ''};
    const sides = (axis, second) => faces[2 * axis + second];
    for (let axis = 0; axis < 3; ++axis) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      for (const [i, j] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
        const a = this.low.slice();
        a[u] = [this.low, this.high][i][u];
        a[v] = [this.low, this.high][j][v];
        const b = a.slice();
        b[axis] = this.high[axis];
        paths[sides(u, i) || sides(v, j) ? 'near' : 'far'] += this.lineOf(a, b);
      }
    }
    this.lines[0].setAttribute('d', paths.far);
    this.lines[1].setAttribute('d', paths.near);
    this.handles.forEach((handle, k) => {
      const at = this.project(this.placeOf(handle));
      const {element} = handle;
      show(element, at.z > this.nearest);
      element.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px)`;
      element.classList.toggle('far', handle.axis !== null && !faces[k]);
    });
  }

  // For the shader of a splat whose positions begin at `center`.
  seenFrom(center) {
    if (!this.shown) return {low: [0, 0, 0], high: [0, 0, 0], outside: 1};
    return {low: add(this.low, center, -1), high: add(this.high, center, -1), outside: OUTSIDE};
  }
}
