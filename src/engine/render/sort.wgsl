// One pass of a stable radix sort of u32 keys with their rows, 4 bits: count digits per block of 2048, scan the counts
// (render/scan.wgsl), scatter. Positions follow from the keys alone, so all devices and runs agree. The number of items
// comes from a buffer, so the host need not know it.

struct Sort {
  shift: u32,    // of the digit
  size_at: u32,  // sizes[size_at] items
  sums_at: u32,  // Scan::sums_at of the counts
}
@group(0) @binding(0) var<uniform> sort: Sort;
@group(0) @binding(1) var<storage, read> sizes: array<u32>;
@group(0) @binding(2) var<storage, read> keys_in: array<u32>;
@group(0) @binding(3) var<storage, read> rows_in: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> rows_out: array<u32>;
@group(0) @binding(6) var<storage, read> places: array<u32>;        // [16, blocks], scanned
@group(0) @binding(7) var<storage, read_write> counts: array<u32>;  // [16, blocks], unscanned

const ITEMS = 8u;
const BLOCK = 2048u;

fn Digit(key: u32) -> u32 { return (key >> sort.shift) & 15u; }

var<workgroup> found: array<atomic<u32>, 16>;

@compute @workgroup_size(256)
fn sort_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let size = sizes[sort.size_at];
  let blocks = (size + BLOCK - 1u) / BLOCK;
  let block = GroupNumber(group);
  if (lane < 16u) { atomicStore(&found[lane], 0u); }
  workgroupBarrier();
  for (var k = 0u; k < ITEMS; k++) {
    let i = block * BLOCK + k * 256u + lane;
    if (i < size) { atomicAdd(&found[Digit(keys_in[i])], 1u); }
  }
  workgroupBarrier();
  if (lane < 16u && block < blocks) { counts[lane * blocks + block] = atomicLoad(&found[lane]); }
}

// Number of items with each digit before a thread's own: 16 counters of 16 bits, scanned over threads.
var<workgroup> low: array<vec4u, 256>;   // digits 0 … 7, two per word
var<workgroup> high: array<vec4u, 256>;  // digits 8 … 15

fn CountOf(digit: u32, below_8: vec4u, from_8: vec4u) -> u32 {
  let word = select(from_8, below_8, digit < 8u)[(digit >> 1u) & 3u];
  return (word >> ((digit & 1u) * 16u)) & 0xffffu;
}

@compute @workgroup_size(256)
fn sort_scatter(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let size = sizes[sort.size_at];
  let blocks = (size + BLOCK - 1u) / BLOCK;
  let block = GroupNumber(group);
  let first = block * BLOCK + lane * ITEMS;
  var below_8 = vec4u(0u);
  var from_8 = vec4u(0u);
  var keys: array<u32, 8>;
  var ranks: array<u32, 8>;  // among the thread's items of the same digit
  for (var k = 0u; k < ITEMS; k++) {
    if (first + k < size) {
      keys[k] = keys_in[first + k];
      let digit = Digit(keys[k]);
      ranks[k] = CountOf(digit, below_8, from_8);
      let one = 1u << ((digit & 1u) * 16u);
      if (digit < 8u) {
        below_8[(digit >> 1u) & 3u] += one;
      } else {
        from_8[(digit >> 1u) & 3u] += one;
      }
    }
  }
  low[lane] = below_8;
  high[lane] = from_8;
  workgroupBarrier();
  for (var step = 1u; step < 256u; step *= 2u) {
    var before_low = vec4u(0u);
    var before_high = vec4u(0u);
    if (lane >= step) {
      before_low = low[lane - step];
      before_high = high[lane - step];
    }
    workgroupBarrier();
    low[lane] += before_low;
    high[lane] += before_high;
    workgroupBarrier();
  }
  let before_low = low[lane] - below_8;
  let before_high = high[lane] - from_8;
  for (var k = 0u; k < ITEMS; k++) {
    if (first + k < size) {
      let digit = Digit(keys[k]);
      let entry = digit * blocks + block;
      let to = places[entry] + places[sort.sums_at + entry / BLOCK] + CountOf(digit, before_low, before_high) + ranks[k];
      keys_out[to] = keys[k];
      rows_out[to] = rows_in[first + k];
    }
  }
}
