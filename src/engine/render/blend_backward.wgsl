// Counterpart of blend_backward.cc, which has the formulas. Appended to view.wgsl, alpha.wgsl and constants: whether
// absolute sums are computed (ABSOLUTE), Gaussians between barriers (GROUP), numbers per thread and Gaussian (VALUES),
// and sums per slot (SUMS).
//
// A workgroup is a tile, a thread four adjacent pixels. Group by group, farthest first:
//   1. every thread sums its pixels' contributions to each Gaussian: six numbers, about the point of the tile nearest to
//      the mean, where sums have the magnitude of their terms;
//   2. every thread adds those of GROUP threads for one Gaussian and converts them, linearly, to the sums of
//      BlendGradient, while the next group is loaded;
//   3. the partial sums are added and written to the Gaussian's slot.
// This needs two barriers per group, uses all of workgroup memory, and has a fixed order.

struct BlendBackward {
  background: vec4f,
  size: vec4u,   // width, height in pixels; tiles_x; first tile of the run
  box: vec4u,    // x0, y0, x1, y1 of pixels with a gradient, half-open; nothing outside is read
  run: vec4u,    // tiles of the run; first tile in `ranges`; slots; offset of scan.wgsl's sums in `starts`
  first_row: u32,  // first pixel row in `upstream`
  unused: u32,
  cuts: vec2f,   // log2(min_alpha), max_alpha
}

@group(0) @binding(0) var<uniform> job: BlendBackward;
@group(0) @binding(1) var<storage, read> seen: array<Seen>;
@group(0) @binding(2) var<storage, read> ranges: array<u32>;
@group(0) @binding(3) var<storage, read> pairs: array<u32>;
@group(0) @binding(4) var<storage, read> kept: array<vec2u>;
@group(0) @binding(5) var<storage, read> upstream: array<vec4f>;  // row-major in the box: ∂L/∂C, ∂L/∂A
@group(0) @binding(6) var<storage, read> rects: array<vec2u>;
@group(0) @binding(7) var<storage, read> starts: array<u32>;  // see gather_slots.wgsl
@group(0) @binding(8) var<storage, read_write> slots: array<f32>;

const THREADS = 64u;
const PARTS = THREADS / GROUP;            // threads per Gaussian in the second step
const STRIDE = VALUES * THREADS + PARTS;  // per Gaussian; odd, to avoid bank conflicts
const TILE = 16.0;
const TWO_LN2 = 1.3862943611198906;

var<workgroup> found: array<f32, GROUP * STRIDE>;
var<workgroup> parts: array<f32, THREADS * SUMS>;
// Two groups: the current and the next.
var<workgroup> shapes: array<vec4f, 2 * GROUP>;  // u_xx, u_xy, u_yy, log2_opacity
var<workgroup> colors: array<vec3f, 2 * GROUP>;
var<workgroup> places: array<vec2f, 2 * GROUP>;  // px from the tile's corner
var<workgroup> members: array<u32, 2 * GROUP>;   // slots
var<workgroup> deepest: atomic<u32>;

struct Member {
  shape: vec4f,
  color: vec3f,
  place: vec2f,
  slot: u32,
}

// The Gaussian at an index of the tile's list.
fn Fetch(pair: u32, tile: vec2u) -> Member {
  let row = pairs[pair];
  let g = seen[row];
  let rect = rects[row];
  let slot = starts[row] + starts[job.run.w + row / 2048u] + TilesBefore(rect, tile) -
             TilesBefore(rect, vec2u(job.size.w % job.size.z, job.size.w / job.size.z));
  return Member(vec4f(g.u, g.log2_opacity), g.rgb, (g.at - vec2f(16u * tile)) + g.at_low, slot);
}

fn Place(member: Member, at: u32) {
  shapes[at] = member.shape;
  colors[at] = member.color;
  places[at] = member.place;
  members[at] = member.slot;
}

@compute @workgroup_size(64)
fn blend_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let number = GroupNumber(group);
  if (number >= job.run.x) { return; }
  let tile_number = job.size.w + number;
  let tile = vec2u(tile_number % job.size.z, tile_number / job.size.z);
  let first = ranges[tile_number - job.run.y];

  // Pixels outside the box have gradient 0, which makes everything 0.
  let column = 4u * (thread % 4u);
  let corner = 16u * tile + vec2u(column, thread / 4u);
  var red = vec4f(0.0);
  var green = vec4f(0.0);
  var blue = vec4f(0.0);
  var transmittance = vec4f(1.0);
  var behind = vec4f(0.0);
  var contributors = vec4u(0u);
  if (corner.y >= job.box.y && corner.y < job.box.w) {
    for (var k = 0u; k < 4u; k++) {
      let x = corner.x + k;
      if (x < job.box.x || x >= job.box.z) { continue; }
      let g = upstream[(corner.y - job.first_row) * (job.box.z - job.box.x) + x - job.box.x];
      if (all(g == vec4f(0.0))) { continue; }
      let end = kept[corner.y * job.size.x + x];
      red[k] = g.x;
      green[k] = g.y;
      blue[k] = g.z;
      transmittance[k] = bitcast<f32>(end.x);
      behind[k] = transmittance[k] * (dot(job.background.xyz, g.xyz) - g.w);
      contributors[k] = end.y;
    }
  }
  if (thread == 0u) { atomicStore(&deepest, 0u); }
  workgroupBarrier();
  let own_last = max(max(contributors.x, contributors.y), max(contributors.z, contributors.w));
  if (own_last > 0u) { atomicMax(&deepest, own_last); }
  let last = workgroupUniformLoad(&deepest);

  let x = vec4f(0.5, 1.5, 2.5, 3.5) + f32(column);
  let y = f32(thread / 4u) + 0.5;
  // In the second step: whose sums, and which of the first step's threads.
  let member = thread / PARTS;
  let part = thread % PARTS;

  var room = 0u;  // half of the groups' memory in use: 0 or GROUP
  var end = (last + GROUP - 1u) / GROUP * GROUP;
  if (thread < GROUP && end > 0u && end - GROUP + thread < last) { Place(Fetch(first + end - GROUP + thread, tile), thread); }
  workgroupBarrier();
  for (; end > 0u; end -= GROUP) {
    let base = end - GROUP;
    var next: Member;
    let fetches = thread < GROUP && base > 0u;
    if (fetches) { next = Fetch(first + base - GROUP + thread, tile); }

    for (var k = 0u; k < GROUP; k++) {
      let j = GROUP - 1u - k;
      let shape = shapes[room + j];
      let at = places[room + j];
      let dx = x - at.x;
      let dy = y - at.y;
      let log2_alpha = vec4f(Log2Alpha(shape, dx.x, dy), Log2Alpha(shape, dx.y, dy), Log2Alpha(shape, dx.z, dy),
                             Log2Alpha(shape, dx.w, dy));
      let added = (log2_alpha >= vec4f(job.cuts.x)) & (contributors > vec4u(base + j));
      var q = vec4f(0.0);
      var r = vec4f(0.0);
      var g = vec4f(0.0);
      var b = vec4f(0.0);
      var along_x = vec4f(0.0);
      var along_y = vec4f(0.0);
      if (any(added)) {
        let color = colors[room + j];
        let uncapped = vec4f(Exp2(log2_alpha.x), Exp2(log2_alpha.y), Exp2(log2_alpha.z), Exp2(log2_alpha.w));
        let alpha = select(vec4f(0.0), min(uncapped, vec4f(job.cuts.y)), added);
        let inverse = 1.0 / (1.0 - alpha);  // 1 if nothing was added
        transmittance *= inverse;
        let weight = alpha * transmittance;
        let own = weight * (red * color.x + (green * color.y + blue * color.z));
        let free = added & (uncapped <= vec4f(job.cuts.y));
        q = select(vec4f(0.0), own - behind * (alpha * inverse), free);
        behind += own;
        // A non-finite gradient affects only what its pixel adds.
        r = select(vec4f(0.0), weight * red, added);
        g = select(vec4f(0.0), weight * green, added);
        b = select(vec4f(0.0), weight * blue, added);
        if (ABSOLUTE) {
          // ∂L/∂mean2d = 2 ln 2·Wᵀ q·(u, v) as in project_backward.wgsl, but per pixel.
          let u = shape.x * dx + shape.y * dy;
          let v = shape.z * dy;
          along_x = abs(q * (shape.x * u));
          along_y = abs(q * (shape.y * u + shape.z * v));
        }
      }
      let to = j * STRIDE + thread;
      found[to] = (q.x + q.y) + (q.z + q.w);
      let from_near = x - clamp(at.x, 0.0, TILE);
      found[to + THREADS] = dot(q, from_near);
      found[to + 2u * THREADS] = dot(q, from_near * from_near);
      found[to + 3u * THREADS] = (r.x + r.y) + (r.z + r.w);
      found[to + 4u * THREADS] = (g.x + g.y) + (g.z + g.w);
      found[to + 5u * THREADS] = (b.x + b.y) + (b.z + b.w);
      if (ABSOLUTE) {
        found[to + (VALUES - 2u) * THREADS] = (along_x.x + along_x.y) + (along_x.z + along_x.w);
        found[to + (VALUES - 1u) * THREADS] = (along_y.x + along_y.y) + (along_y.z + along_y.w);
      }
    }
    workgroupBarrier();

    let mean = places[room + member];
    let near = clamp(mean, vec2f(0.0), vec2f(TILE));
    var s0 = 0.0;
    var sx = 0.0;
    var sy = 0.0;
    var sxx = 0.0;
    var sxy = 0.0;
    var syy = 0.0;
    var rgb = vec3f(0.0);
    var absolute = vec2f(0.0);
    for (var k = 0u; k < GROUP; k++) {
      let source = k * PARTS + part;
      let at = member * STRIDE + source;
      let height = (f32(source / 4u) + 0.5) - near.y;
      let q = found[at];
      let qx = found[at + THREADS];
      s0 += q;
      sx += qx;
      sy += height * q;
      sxx += found[at + 2u * THREADS];
      sxy += height * qx;
      syy += height * (height * q);
      rgb += vec3f(found[at + 3u * THREADS], found[at + 4u * THREADS], found[at + 5u * THREADS]);
      if (ABSOLUTE) {
        absolute += vec2f(found[at + (VALUES - 2u) * THREADS], found[at + (VALUES - 1u) * THREADS]);
      }
    }
    // Converts to the sums of BlendGradient (Whiten in blend_backward.cc). (u, v) is that of the near point.
    let shape = shapes[room + member];
    let from_mean = near - mean;
    let u = shape.x * from_mean.x + shape.y * from_mean.y;
    let v = shape.z * from_mean.y;
    let ou = shape.x * sx + shape.y * sy;
    let ov = shape.z * sy;
    let ouu = shape.x * shape.x * sxx + 2.0 * shape.x * shape.y * sxy + shape.y * shape.y * syy;
    let ouv = shape.z * (shape.x * sxy + shape.y * syy);
    let ovv = shape.z * shape.z * syy;
    let to = part * (GROUP * SUMS) + member * SUMS;
    parts[to] = s0;
    parts[to + 1u] = ou + u * s0;
    parts[to + 2u] = ov + v * s0;
    parts[to + 3u] = ouu + u * (2.0 * ou + u * s0);
    parts[to + 4u] = ouv + v * ou + u * (ov + v * s0);
    parts[to + 5u] = ovv + v * (2.0 * ov + v * s0);
    parts[to + 6u] = rgb.x;
    parts[to + 7u] = rgb.y;
    parts[to + 8u] = rgb.z;
    if (ABSOLUTE) {
      parts[to + SUMS - 2u] = TWO_LN2 * absolute.x;
      parts[to + SUMS - 1u] = TWO_LN2 * absolute.y;
    }
    if (fetches) { Place(next, GROUP - room + thread); }
    workgroupBarrier();

    for (var o = thread; o < GROUP * SUMS; o += THREADS) {
      let j = o / SUMS;
      if (base + j >= last) { continue; }
      var sum = 0.0;
      for (var k = 0u; k < PARTS; k++) { sum += parts[k * (GROUP * SUMS) + o]; }
      let slot = members[room + j];
      slots[job.run.z + 12u * slot + o % SUMS] = sum;
      if (o % SUMS == 0u) { slots[slot] = 1.0; }
    }
    room = GROUP - room;
  }
}
