// What densification does with rows on the GPU; who comes and goes is decided on the host (densification.h).

struct Rows {
  count: u32,       // rows, or numbers of all rows, that this dispatch works on
  width: u32,       // numbers of a row
  first: u32,       // the first of the rows in the cloud
  limit: u32,       // rows of the cloud from here on are left as they are
  from_first: u32,  // rows of the cloud that `old` holds: the first and how many
  from_count: u32,
  numbers: vec2f,
}

@group(0) @binding(0) var<uniform> rows: Rows;

// Row r becomes the old row source[r], where that lies in `old`.
@group(0) @binding(1) var<storage, read> source: array<u32>;
@group(0) @binding(2) var<storage, read> old: array<f32>;
@group(0) @binding(3) var<storage, read_write> fresh: array<f32>;

@compute @workgroup_size(256) fn take_rows(@builtin(workgroup_id) group: vec3u,
                                           @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group) * 256u + lane;
  if (number >= rows.count) { return; }
  let row = rows.first + number / rows.width;
  if (row >= rows.limit) { return; }
  let place = source[row] - rows.from_first;  // wraps round to something large where it lies before
  if (place < rows.from_count) { fresh[number] = old[place * rows.width + number % rows.width]; }
}

// Newcomers differ from what they were copied from: [F,8] what is added to their means, their log-scales, their logit.
@group(0) @binding(1) var<storage, read> newcomers: array<f32>;
@group(0) @binding(2) var<storage, read_write> means: array<f32>;
@group(0) @binding(3) var<storage, read_write> log_scales: array<f32>;
@group(0) @binding(4) var<storage, read_write> opacity_logits: array<f32>;

@compute @workgroup_size(256) fn place_newcomers(@builtin(workgroup_id) group: vec3u,
                                                 @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group) * 256u + lane;
  if (number >= rows.count || rows.first + number < rows.limit) { return; }
  let at = 8u * (rows.first + number - rows.limit);
  for (var a = 0u; a < 3u; a++) {
    means[3u * number + a] += newcomers[at + a];
    log_scales[3u * number + a] = newcomers[at + 3u + a];
  }
  opacity_logits[number] = newcomers[at + 6u];
}

// Densification::Gather. `numbers` is half the picture's size.
@group(0) @binding(1) var<storage, read> means2d: array<vec2f>;
@group(0) @binding(2) var<storage, read> radii: array<vec2i>;
@group(0) @binding(3) var<storage, read_write> gathered: array<vec4f>;  // grad2d, count, radii, nothing

@compute @workgroup_size(256) fn gather_gradients(@builtin(workgroup_id) group: vec3u,
                                                  @builtin(local_invocation_index) lane: u32) {
  let row = GroupNumber(group) * 256u + lane;
  if (row >= rows.count) { return; }
  let radius = radii[row];
  if (any(radius <= vec2i(0))) { return; }
  let g = means2d[row] * rows.numbers;
  let side = 2.0 * max(rows.numbers.x, rows.numbers.y);
  let before = gathered[row];
  gathered[row] = vec4f(before.x + sqrt(g.x * g.x + g.y * g.y), before.y + 1.0,
                        max(before.z, f32(max(radius.x, radius.y)) / side), 0.0);
}

// IsUsable of core/gaussian_cloud.h, by bits: shaders may take it for granted that floats are numbers.
@group(0) @binding(1) var<storage, read> mean_bits: array<u32>;
@group(0) @binding(2) var<storage, read> scale_bits: array<u32>;
@group(0) @binding(3) var<storage, read> quat_bits: array<u32>;
@group(0) @binding(4) var<storage, read> logit_bits: array<u32>;
@group(0) @binding(5) var<storage, read> sh_bits: array<u32>;
@group(0) @binding(6) var<storage, read_write> usable: array<u32>;

const INFINITY_BITS = 0x7f800000u;
const LARGEST_LOG_SCALE_BITS = 0x42300000u;  // 44

fn IsFinite(bits: u32) -> bool { return (bits & INFINITY_BITS) != INFINITY_BITS; }
fn IsNumber(bits: u32) -> bool { return (bits & 0x7fffffffu) <= INFINITY_BITS; }

@compute @workgroup_size(256) fn mark_usable(@builtin(workgroup_id) group: vec3u,
                                             @builtin(local_invocation_index) lane: u32) {
  let row = GroupNumber(group) * 256u + lane;
  if (row >= rows.count) { return; }
  var good = IsNumber(logit_bits[row]);
  for (var a = 0u; a < 3u; a++) {
    let scale = scale_bits[3u * row + a];
    let small = scale <= LARGEST_LOG_SCALE_BITS || (scale >= 0x80000000u && IsNumber(scale));
    good = good && IsFinite(mean_bits[3u * row + a]) && small;
  }
  for (var a = 0u; a < 4u; a++) { good = good && IsFinite(quat_bits[4u * row + a]); }
  for (var k = 0u; k < rows.width; k++) { good = good && IsFinite(sh_bits[rows.width * row + k]); }
  usable[row] = select(0u, 1u, good);
}

// CapOpacities. numbers.x is the largest logit.
@group(0) @binding(1) var<storage, read_write> logits: array<f32>;

@compute @workgroup_size(256) fn cap_opacities(@builtin(workgroup_id) group: vec3u,
                                               @builtin(local_invocation_index) lane: u32) {
  let row = GroupNumber(group) * 256u + lane;
  if (row >= rows.count) { return; }
  logits[row] = min(logits[row], rows.numbers.x);
}
