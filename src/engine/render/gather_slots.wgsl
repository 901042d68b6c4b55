// Counterpart of gradient_slots.cc: assigns slots to (tile, Gaussian) pairs of a run, and sums them. Appended to
// view.wgsl.
//
// Slots are ordered by Gaussian, then tile in row-major order. In a run starting at a tile, the slot of Gaussian i and
// a tile is the sum before i (scan.wgsl) + TilesBefore(tile) − TilesBefore(first tile).

struct GatherSlots {
  size: vec4u,  // Gaussians; tiles_x; first and last tile of the run
  more: vec4u,  // 1: assign, else add; sums per slot; offset of scan.wgsl's sums in `starts`; unused
}

@group(0) @binding(0) var<uniform> job: GatherSlots;
@group(0) @binding(1) var<storage, read> rects: array<vec2u>;

fn TilesOfRun(rect: vec2u) -> u32 {
  return TilesBefore(rect, vec2u(job.size.w % job.size.y, job.size.w / job.size.y)) -
         TilesBefore(rect, vec2u(job.size.z % job.size.y, job.size.z / job.size.y));
}

@group(0) @binding(2) var<storage, read_write> counts: array<u32>;  // [N], then scanned by scan.wgsl
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
@group(0) @binding(4) var<storage, read> touched: array<f32>;     // [slots] 1 if a tile added something, else 0
@group(0) @binding(5) var<storage, read> slots: array<f32>;       // [slots,12]
@group(0) @binding(6) var<storage, read_write> sums: array<f32>;  // [N,12] BlendGradient, absolute sums, 0

// Twelve threads per Gaussian, one per sum, for contiguous reads.
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
