'use strict';
// A pinhole camera in OpenCV axes (x right, y down, z forward) that orbits a target. The frame is the picture it was
// made for; on screen the whole frame is fitted into the region that shows it.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const unit = (a) => {
  const length = Math.hypot(...a);
  return length > 0 ? a.map((x) => x / length) : [0, 0, 1];
};

// `v` turned about the unit vector `axis` (Rodrigues).
function turn(v, axis, angle) {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  const across = cross(axis, v);
  const along = dot(axis, v) * (1 - c);
  return [0, 1, 2].map((k) => v[k] * c + across[k] * s + axis[k] * along);
}

class OrbitCamera {
  // `center` and `radius` say where the object is and how large.
  constructor(center, radius, up) {
    this.center = center;
    this.radius = radius;
    this.up = up;
    this.lookFrom([0.9, 0.45, 0.9]);
  }

  get forward() { return this.axes[2]; }
  get eye() { return add(this.target, this.forward, -this.distance); }

  // From a direction given as right-, up- and towards-the-viewer part of the object's own frame.
  lookFrom([right, above, front]) {
    const side = Math.abs(this.up[0]) < 0.9 ? unit(cross(this.up, [1, 0, 0])) : unit(cross(this.up, [0, 0, 1]));
    const other = cross(side, this.up);
    const away = unit(add(add([0, 0, 0].map((_, k) => right * other[k]), this.up, above), side, front));
    const forward = away.map((x) => -x);
    // Straight down or up, "right" is still right.
    const across = Math.abs(dot(forward, this.up)) > 0.999 ? other : unit(cross(forward, this.up));
    this.axes = [across, cross(forward, across), forward];
    this.frame = {width: 1, height: 1, fx: 1.2071, fy: 1.2071, cx: 0.5, cy: 0.5};  // 45°
    this.target = this.center.slice();
    this.distance = 2.9 * this.radius;
  }

  // A camera of the page: world-to-camera rotation (row-major) and translation, intrinsics in pixels.
  lookThrough(view) {
    const r = view.rotation;
    const t = view.translation;
    this.axes = [r.slice(0, 3), r.slice(3, 6), r.slice(6, 9)];
    this.frame = {width: view.width, height: view.height, fx: view.fx, fy: view.fy, cx: view.cx, cy: view.cy};
    const eye = [0, 1, 2].map((k) => -(r[k] * t[0] + r[3 + k] * t[1] + r[6 + k] * t[2]));
    // Orbit about the point of the line of sight that is nearest to the object.
    const depth = dot(add(this.center, eye, -1), this.forward);
    this.distance = depth > 0.05 * this.radius ? depth : this.radius;
    this.target = add(eye, this.forward, this.distance);
  }

  orbit(yaw, pitch) {
    // Not over the top: the horizon would flip.
    const elevation = Math.asin(Math.max(-1, Math.min(1, dot(this.forward, this.up))));
    const limit = 1.55;
    const allowed = Math.max(-limit - elevation, Math.min(limit - elevation, pitch));
    const step = Math.abs(elevation) > limit ? (pitch * elevation < 0 ? pitch : 0) : allowed;
    this.axes = this.axes.map((a) => turn(turn(a, this.axes[0], step), this.up, yaw));
    // Rounding of many small turns: make it a rotation again.
    const forward = unit(this.axes[2]);
    const right = unit(add(this.axes[0], forward, -dot(this.axes[0], forward)));
    this.axes = [right, cross(forward, right), forward];
  }

  // Turns the picture clockwise, and what counts as up along with it.
  roll(angle) {
    const {forward} = this;
    this.axes = [...this.axes.slice(0, 2).map((a) => turn(a, forward, -angle)), forward];
    this.up = turn(this.up, forward, -angle);
  }

  // Holds `up` upright, looking where it looks.
  level(up) {
    const {forward} = this;
    this.up = up;
    if (Math.abs(dot(forward, up)) > 0.999) return;
    const right = unit(cross(forward, up));
    this.axes = [right, cross(forward, right), forward];
  }

  // By screen pixels, of the plane through the target.
  pan(dx, dy, region) {
    const {fx, fy} = this.intrinsics(region);
    this.target = add(add(this.target, this.axes[0], -dx * this.distance / fx), this.axes[1], -dy * this.distance / fy);
  }

  // Towards the point under (x, y), which stays where it is on screen.
  zoom(factor, x, y, region) {
    const {fx, fy, cx, cy} = this.intrinsics(region);
    const distance = Math.max(0.002 * this.radius, Math.min(60 * this.radius, this.distance * factor));
    const moved = this.distance - distance;
    this.target = add(add(this.target, this.axes[0], moved * (x - cx) / fx), this.axes[1], moved * (y - cy) / fy);
    this.distance = distance;
  }

  // The frame fitted into `region` {x, y, width, height}, in pixels of the screen.
  intrinsics(region) {
    const f = this.frame;
    const scale = Math.min(region.width / f.width, region.height / f.height);
    const left = region.x + (region.width - f.width * scale) / 2;
    const top = region.y + (region.height - f.height * scale) / 2;
    return {
      fx: f.fx * scale, fy: f.fy * scale, cx: left + f.cx * scale, cy: top + f.cy * scale,
      left, top, width: f.width * scale, height: f.height * scale,
    };
  }
}
