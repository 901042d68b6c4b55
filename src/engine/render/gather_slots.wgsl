// The twin of gradient_slots.cc: where the tiles of a run put what they find about a Gaussian, and the sums of that.
// Compiled behind view.wgsl.
//
// Slots lie as rows of Gaussians one after another, and of each the tiles row by row: in a run that begins with a tile,
// the slot of Gaussian i and one of its tiles is what comes before i (scan.wgsl) + TilesBefore the tile − TilesBefore the
// first one.

struct GatherSlots {
  size: vec4u,  // Gaussians; tiles_x; first and last tile of the run
  more: vec4u,  // 1 where these are the first sums, otherwise they are added; sums of a slot; where the sums of scan.wgsl
                // lie in `starts`; unused
}

@group(0) @binding(0) var<uniform> job: GatherSlots;
@group(0) @binding(1) var<storage, read> rects: array<vec2u>;

fn TilesOfRun(rect: vec2u) -> u32 {
  return TilesBefore(rect, vec2u(job.size.w % job.size.y, job.size.w / job.size.y)) -
         TilesBefore(rect, vec2u(job.size.z % job.size.y, job.size.z / job.size.y));
}

@group(0) @binding(2) var<storage, read_write> counts: array<u32>;  // [N], then what scan.wgsl makes of it
@group(0) @binding(7) var<storage, read_write> many: atomic<u32>;   // Σ counts / 32, which does not overflow

@compute @workgroup_size(256)
fn count_slots(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let i = GroupNumber(group) * 256u + thread;
  if (i >= job.size.x) { return; }
  let count = TilesOfRun(rects[i]);
  counts[i] = count;
  if (count >= 32u) { atomicAdd(&many, count / 32u); }
}

@group(0) @binding(3) var<storage, read> starts: array<u32>;      // scanned
@group(0) @binding(4) var<storage, read> touched: array<f32>;     // [slots] 1 where a tile has added something, or 0
@group(0) @binding(5) var<storage, read> slots: array<f32>;       // [slots,12]
@group(0) @binding(6) var<storage, read_write> sums: array<f32>;  // [N,12] BlendGradient, absolute sums, 0

// Twelve threads a Gaussian, one for each sum, so that what lies side by side is read side by side.
@compute @workgroup_size(256)
fn gather_slots(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let place = GroupNumber(group) * 256u + thread;
  let i = place / 12u;
  if (i >= job.size.x) { return; }
  let which = place % 12u;
  if (which >= job.more.y) {
    sums[place] = 0.0;
    return;
  }
  let first = starts[i] + starts[job.more.z + i / 2048u];
  let last = first + TilesOfRun(rects[i]);
  var sum = 0.0;
  if (job.more.x == 0u) { sum = sums[place]; }
  for (var slot = first; slot < last; slot++) {
    if (touched[slot] != 0.0) { sum += slots[12u * slot + which]; }
  }
  sums[place] = sum;
}
