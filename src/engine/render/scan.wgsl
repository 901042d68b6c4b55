// Exclusive sums of u32, in place, up to 2^32 items: each block of 2048 by a workgroup, then the blocks' totals by one.
// The sum before item i is items[i] + items[scan.sums_at + i / 2048]. Appended to workgroup_sums.wgsl.

struct Scan {
  size_at: u32,   // number of items: `tables`·⌈sizes[size_at] / 2048⌉ or, if `tables` is 0, sizes[size_at]
  tables: u32,
  sums_at: u32,   // offset of the blocks' totals in `items`
  total_at: u32,  // index of the total in `totals`
}
@group(0) @binding(0) var<uniform> scan: Scan;
@group(0) @binding(1) var<storage, read> sizes: array<u32>;
@group(0) @binding(2) var<storage, read_write> items: array<u32>;
@group(0) @binding(3) var<storage, read_write> totals: array<u32>;

const ITEMS = 8u;
const BLOCK = 2048u;

fn Length() -> u32 {
  let size = sizes[scan.size_at];
  if (scan.tables == 0u) { return size; }
  return scan.tables * ((size + BLOCK - 1u) / BLOCK);
}

@compute @workgroup_size(256)
fn scan_blocks(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let length = Length();
  let block = GroupNumber(group);
  let first = block * BLOCK + lane * ITEMS;
  var own: array<u32, 8>;
  var sum = 0u;
  for (var k = 0u; k < ITEMS; k++) {
    if (first + k < length) { own[k] = items[first + k]; }
    sum += own[k];
  }
  var before = SumBefore(lane, sum);
  for (var k = 0u; k < ITEMS; k++) {
    if (first + k < length) { items[first + k] = before; }
    before += own[k];
  }
  if (lane == 255u && block * BLOCK < length) { items[scan.sums_at + block] = before; }
}

@compute @workgroup_size(256)
fn scan_sums(@builtin(local_invocation_index) lane: u32) {
  let blocks = (Length() + BLOCK - 1u) / BLOCK;
  let each = (blocks + 255u) / 256u;
  let first = min(lane * each, blocks);
  let last = min(first + each, blocks);
  var sum = 0u;
  for (var b = first; b < last; b++) { sum += items[scan.sums_at + b]; }
  var before = SumBefore(lane, sum);
  for (var b = first; b < last; b++) {
    let own = items[scan.sums_at + b];
    items[scan.sums_at + b] = before;
    before += own;
  }
  if (lane == 255u) { totals[scan.total_at] = before; }
}
