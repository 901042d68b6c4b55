// The loss of photometric_loss.h and its gradient; ssim_gradient.h has the formulas. A workgroup covers 16 x 16 pixels
// of one channel in two kernels: the first computes the maps P, Q and R of every window, the second sums them into
// gradients.

struct Loss {
  size: vec2u,      // W, H
  tiles: vec2u,     // of 16 x 16 pixels
  map: vec4u,       // x0, y0, x1, y1: pixels whose SSIM counts
  rendered: vec2u,  // strides in floats: next pixel, next channel; likewise below
  wanted: vec2u,
  gradient: vec2u,
  channels: vec2u,  // first, count
  ssim_weight: f32,
  difference_weight: f32,
  window: array<vec4f, 2>,  // first half and centre; it is symmetric
}

@group(0) @binding(0) var<uniform> loss: Loss;
@group(0) @binding(1) var<storage, read> rendered: array<f32>;
@group(0) @binding(2) var<storage, read> wanted: array<f32>;
@group(0) @binding(3) var<storage, read_write> maps: array<f32>;  // [channels, P Q R, H, W]
@group(0) @binding(4) var<storage, read_write> gradient: array<f32>;
@group(0) @binding(5) var<storage, read_write> sums: array<f32>;  // [3, tiles, 3]: 1 - SSIM, |a - b|, (a - b)^2

const SIDE = 16u;
const REACH = 5u;
const AROUND = 26u;  // a side plus the reach of windows
const C1 = 0.0001;
const C2 = 0.0009;
const IGNORED_BELOW = -0.5;  // pixels with a smaller target are ignored

var<workgroup> pixels: array<vec2f, 676>;    // a, a - b
var<workgroup> moments: array<vec4f, 416>;   // of 26 rows, filtered along rows: a, a - b, (a - b)^2, ab
var<workgroup> around: array<f32, 2028>;     // P, Q and R
var<workgroup> along: array<f32, 1248>;      // the same, filtered along rows
var<workgroup> reduced: array<vec2f, 256>;

fn Weight(tap: u32) -> f32 { return loss.window[tap / 4u][tap % 4u]; }

struct Place {
  corner: vec2u,  // of the tile, pixels
  channel: u32,
  slot: u32,      // of the sums
}

fn PlaceOf(number: u32) -> Place {
  let tiles = loss.tiles.x * loss.tiles.y;
  let tile = number % tiles;
  let channel = loss.channels.x + number / tiles;
  return Place(SIDE * vec2u(tile % loss.tiles.x, tile / loss.tiles.x), channel, 3u * (channel * tiles + tile));
}

// (a, b) of a pixel; 0 outside the image, equal where ignored.
fn Pair(at: vec2i, channel: u32) -> vec2f {
  if (any(at < vec2i(0)) || any(at >= vec2i(loss.size))) { return vec2f(0.0); }
  let pixel = u32(at.y) * loss.size.x + u32(at.x);
  let a = rendered[pixel * loss.rendered.x + channel * loss.rendered.y];
  let b = wanted[pixel * loss.wanted.x + channel * loss.wanted.y];
  return vec2f(a, select(b, a, b < IGNORED_BELOW));
}

// Sums all values into reduced[0] in a fixed tree order.
fn Reduce(lane: u32) {
  workgroupBarrier();
  for (var half = 128u; half > 0u; half /= 2u) {
    if (lane < half) { reduced[lane] += reduced[lane + half]; }
    workgroupBarrier();
  }
}

@compute @workgroup_size(256) fn ssim_maps(@builtin(workgroup_id) group: vec3u,
                                           @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group);
  if (number >= loss.tiles.x * loss.tiles.y * loss.channels.y) { return; }
  let place = PlaceOf(number);
  for (var k = lane; k < AROUND * AROUND; k += 256u) {
    let both = Pair(vec2i(place.corner + vec2u(k % AROUND, k / AROUND)) - i32(REACH), place.channel);
    pixels[k] = vec2f(both.x, both.x - both.y);
  }
  workgroupBarrier();
  for (var k = lane; k < SIDE * AROUND; k += 256u) {
    let first = k / SIDE * AROUND + k % SIDE;
    var sum = vec4f(0.0);
    for (var tap = 0u; tap <= 2u * REACH; tap++) {
      let p = pixels[first + tap];
      sum += Weight(min(tap, 2u * REACH - tap)) * vec4f(p, p.y * p.y, p.x * (p.x - p.y));
    }
    moments[k] = sum;
  }
  workgroupBarrier();
  let at = place.corner + vec2u(lane % SIDE, lane / SIDE);
  let inside = all(at < loss.size);
  var off = 0.0;
  var p = 0.0;
  var q = 0.0;
  var r = 0.0;
  if (inside && all(at >= loss.map.xy) && all(at < loss.map.zw)) {
    var mean = vec4f(0.0);
    for (var tap = 0u; tap <= 2u * REACH; tap++) {
      mean += Weight(min(tap, 2u * REACH - tap)) * moments[lane + tap * SIDE];
    }
    let a = mean.x;
    let delta = mean.y;
    let b = a - delta;
    let mean_ab = a * b;
    let delta2 = delta * delta;
    let n1 = 2.0 * mean_ab + C1;
    let e1 = n1 + delta2;
    let variance = mean.z - delta2;
    let n2 = 2.0 * (mean.w - mean_ab) + C2;
    let e2 = n2 + variance;
    let similarity1 = n1 / e1;
    let similarity2 = n2 / e2;
    let off1 = delta2 / e1;
    let off2 = variance / e2;
    off = off1 + off2 - off1 * off2;
    q = -similarity1 * similarity2 / e2;
    r = 2.0 * similarity1 * off2 / e2;
    let through_mean = 2.0 * similarity2 / e1 * (a * off1 - delta);
    p = through_mean - 2.0 * q * delta - b * r;
  }
  if (inside) {
    let plane = loss.size.x * loss.size.y;
    let out = 3u * (place.channel - loss.channels.x) * plane + at.y * loss.size.x + at.x;
    maps[out] = p;
    maps[out + plane] = q;
    maps[out + 2u * plane] = r;
  }
  reduced[lane] = vec2f(off, 0.0);
  Reduce(lane);
  if (lane == 0u) { sums[place.slot] = reduced[0].x; }
}

@compute @workgroup_size(256) fn photometric_gradient(@builtin(workgroup_id) group: vec3u,
                                                      @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group);
  if (number >= loss.tiles.x * loss.tiles.y * loss.channels.y) { return; }
  let place = PlaceOf(number);
  let at = place.corner + vec2u(lane % SIDE, lane / SIDE);
  let inside = all(at < loss.size);
  let both = Pair(vec2i(at), place.channel);
  let difference = both.x - both.y;
  // Not sign(): NaN must stay NaN.
  var g = select(select(difference, -loss.difference_weight, difference < 0.0), loss.difference_weight, difference > 0.0);
  if (loss.ssim_weight != 0.0) {
    let plane = loss.size.x * loss.size.y;
    for (var k = lane; k < AROUND * AROUND; k += 256u) {
      let from_map = vec2i(place.corner + vec2u(k % AROUND, k / AROUND)) - i32(REACH);
      let known = all(from_map >= vec2i(0)) && all(from_map < vec2i(loss.size));
      let start = 3u * (place.channel - loss.channels.x) * plane;
      for (var m = 0u; m < 3u; m++) {
        var value = 0.0;
        if (known) { value = maps[start + m * plane + u32(from_map.y) * loss.size.x + u32(from_map.x)]; }
        around[m * AROUND * AROUND + k] = value;
      }
    }
    workgroupBarrier();
    for (var k = lane; k < 3u * SIDE * AROUND; k += 256u) {
      let first = k / SIDE * AROUND + k % SIDE;
      var sum = 0.0;
      for (var tap = 0u; tap <= 2u * REACH; tap++) { sum += Weight(min(tap, 2u * REACH - tap)) * around[first + tap]; }
      along[k] = sum;
    }
    workgroupBarrier();
    var pqr = vec3f(0.0);
    for (var tap = 0u; tap <= 2u * REACH; tap++) {
      let k = lane + tap * SIDE;
      pqr += Weight(min(tap, 2u * REACH - tap)) *
             vec3f(along[k], along[SIDE * AROUND + k], along[2u * SIDE * AROUND + k]);
    }
    g += loss.ssim_weight * (pqr.x + 2.0 * difference * pqr.y + both.y * pqr.z);
  }
  if (inside) {
    gradient[(at.y * loss.size.x + at.x) * loss.gradient.x + place.channel * loss.gradient.y] = g;
  }
  reduced[lane] = select(vec2f(0.0), vec2f(abs(difference), difference * difference), inside);
  Reduce(lane);
  if (lane == 0u) {
    sums[place.slot + 1u] = reduced[0].x;
    sums[place.slot + 2u] = reduced[0].y;
  }
}
