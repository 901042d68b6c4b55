// Front-to-back compositing of a run of tiles, with a workgroup per tile and a thread per pixel: counterpart of
// render/blend.cc. View.counts: pixels per plane of `picture`, first tile and number of tiles of this dispatch, first
// pixel row in `picture` and `kept`.

@group(0) @binding(1) var<storage, read> seen: array<Seen>;
@group(0) @binding(2) var<storage, read> ranges: array<u32>;
@group(0) @binding(3) var<storage, read> pairs: array<u32>;
@group(0) @binding(4) var<storage, read_write> picture: array<f32>;
@group(0) @binding(5) var<storage, read_write> kept: array<vec2u>;

const BATCH = 256u;
var<workgroup> places: array<vec2f, 256>;  // relative to the tile's corner
var<workgroup> shapes: array<vec4f, 256>;  // u, log2_opacity
var<workgroup> colors: array<vec4f, 256>;  // rgb, depth
var<workgroup> open_pixels: atomic<u32>;

@compute @workgroup_size(256)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group);
  if (number >= view.counts.z) { return; }
  let tile = view.counts.y + number;
  let corner = vec2u(tile % view.size.z, tile / view.size.z) * 16u;
  let local = vec2u(lane % 16u, lane / 16u);
  let pixel = corner + local;
  let inside = pixel.x < view.size.x && pixel.y < view.size.y;
  let center = vec2f(local) + 0.5;
  let first = ranges[number];
  let last = ranges[number + 1u];
  var transmittance = 1.0;
  var rgb_depth = vec4f(0.0);
  var weights = 0.0;
  var contributors = 0u;
  var done = !inside;
  for (var base = first; base < last; base += BATCH) {
    if (lane == 0u) { atomicStore(&open_pixels, 0u); }
    workgroupBarrier();
    if (!done) { atomicStore(&open_pixels, 1u); }
    let i = base + lane;
    if (i < last) {
      let g = seen[pairs[i]];
      places[lane] = (g.at - vec2f(corner)) + g.at_low;
      shapes[lane] = vec4f(g.u, g.log2_opacity);
      colors[lane] = vec4f(g.rgb, g.depth);
    }
    if (workgroupUniformLoad(&open_pixels) == 0u) { break; }
    let n = min(BATCH, last - base);
    for (var j = 0u; j < n && !done; j++) {
      let shape = shapes[j];
      let d = center - places[j];
      let log2_alpha = Log2Alpha(shape, d.x, d.y);
      if (log2_alpha < view.cuts.y) { continue; }
      let alpha = min(Exp2(log2_alpha), view.cuts.w);
      let weight = alpha * transmittance;
      let next = transmittance * (1.0 - alpha);
      if (next <= view.cuts.z) {
        done = true;
        break;
      }
      rgb_depth += weight * colors[j];
      weights += weight;
      transmittance = next;
      contributors = base - first + j + 1u;
    }
    workgroupBarrier();
  }
  if (!inside) { return; }
  let plane = view.counts.x;
  let to = (pixel.y - view.counts.w) * view.size.x + pixel.x;
  let rgb = rgb_depth.xyz + transmittance * view.background.xyz;
  picture[to] = rgb.x;
  picture[to + plane] = rgb.y;
  picture[to + 2u * plane] = rgb.z;
  picture[to + 3u * plane] = 1.0 - transmittance;
  // Divided by the sum of weights, as 1 − T is imprecise where little is visible.
  picture[to + 4u * plane] = select(0.0, rgb_depth.w / max(weights, 1e-37), weights > 0.0);
  kept[to] = vec2u(bitcast<u32>(transmittance), contributors);
}
