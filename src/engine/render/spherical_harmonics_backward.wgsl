// Counterpart of spherical_harmonics_backward.cc. Appended to view.wgsl. Arrays start at the first Gaussian of the
// dispatch.
//
// A workgroup is 64 Gaussians. Rows of coefficients pass through workgroup memory, for contiguous reads and writes; in
// between, each thread has a row.

@group(0) @binding(1) var<storage, read> seen: array<Seen>;
@group(0) @binding(2) var<storage, read> sums: array<vec4f>;  // [N,12] from gather_slots.wgsl
@group(0) @binding(3) var<storage, read> means: array<f32>;
@group(0) @binding(4) var<storage, read> sh: array<f32>;
@group(0) @binding(5) var<storage, read_write> mean_gradients: array<f32>;  // adds the part through the direction
@group(0) @binding(6) var<storage, read_write> sh_gradients: array<f32>;

const ROWS = 64u;
const ROW = 49u;  // floats; odd, to avoid bank conflicts
var<workgroup> rows: array<f32, ROWS * ROW>;
var<workgroup> taught: array<u32, ROWS>;  // 1 if a row has a gradient; many occluded ones have none

const SH0 = 0.28209479177387814;
const SH1 = 0.48860251190291992;
const SH2 = vec3f(1.0925484305920792, 0.94617469575755997, 0.31539156525251999);
const SH2_DIAGONAL = 0.54627421529603959;
const SH3_0 = 0.59004358992664352;
const SH3_1 = 2.8906114426405538;
const SH3_2 = 0.45704579946446572;
const SH3_3 = 2.2852289973223288;
const SH3_4 = 1.865881662950577;
const SH3_5 = 1.1195289977703462;
const SH3_6 = 1.4453057213202769;

// Compares bits, as float comparisons may ignore NaN.
fn IsSome(g: vec3f) -> bool { return any((bitcast<vec3u>(g) & vec3u(0x7fffffffu)) != vec3u(0u)); }

// ∂L/∂(factor of Y_k): the coefficient along the colour's gradient.
fn Along(row: u32, k: u32, g: vec3f) -> f32 {
  let at = row + 3u * k;
  return rows[at] * g.x + (rows[at + 1u] * g.y + rows[at + 2u] * g.z);
}

// Replaces coefficient k by its gradient.
fn Put(row: u32, k: u32, basis: f32, g: vec3f) {
  let at = row + 3u * k;
  rows[at] = basis * g.x;
  rows[at + 1u] = basis * g.y;
  rows[at + 2u] = basis * g.z;
}

@compute @workgroup_size(64)
fn spherical_harmonics_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let first = GroupNumber(group) * ROWS;
  if (first >= view.counts.z) { return; }
  let count = min(ROWS, view.counts.z - first);
  let stride = view.counts.w;
  let degree = view.flags.z;
  let used = 3u * (degree + 1u) * (degree + 1u);
  let i = first + thread;

  var g = vec3f(0.0);
  if (thread < count) {
    // Channels clamped at 0 pass no gradient. Rows of culled Gaussians are undefined, but have no sums.
    g = vec3f(sums[3u * i + 1u].zw, sums[3u * i + 2u].x);
    if (IsSome(g)) { g = select(vec3f(0.0), g, seen[i].rgb > vec3f(0.0)); }
  }
  let learns = IsSome(g);
  taught[thread] = select(0u, 1u, learns);
  workgroupBarrier();

  // As many rows at once as threads can cover.
  let side_by_side = ROWS / stride;
  let own_row = thread / stride;
  let column = thread % stride;
  if (degree > 0u && own_row < side_by_side && column < used) {
    for (var row = own_row; row < count; row += side_by_side) {
      if (taught[row] != 0u) { rows[row * ROW + column] = sh[(first + row) * stride + column]; }
    }
  }
  workgroupBarrier();

  if (learns) {
    let row = thread * ROW;
    // Subtract in two steps: far from the origin floats lack the precision.
    let mean = vec3f(means[3u * i], means[3u * i + 1u], means[3u * i + 2u]);
    let offset = (mean - view.center.xyz) - view.center_low.xyz;
    let inverse = 1.0 / sqrt(dot(offset, offset));
    let direction = offset * inverse;
    let x = direction.x;
    let y = direction.y;
    let z = direction.z;
    var slope = vec3f(0.0);
    if (degree > 0u) {
      slope = SH1 * vec3f(-Along(row, 3u, g), -Along(row, 1u, g), Along(row, 2u, g));
      Put(row, 1u, -SH1 * y, g);
      Put(row, 2u, SH1 * z, g);
      Put(row, 3u, -SH1 * x, g);
    }
    let xx = x * x;
    let yy = y * y;
    let zz = z * z;
    let xy = x * y;
    let difference = xx - yy;
    if (degree > 1u) {
      let c4 = SH2.x * Along(row, 4u, g);
      let c5 = -SH2.x * Along(row, 5u, g);
      let c6 = 2.0 * SH2.y * Along(row, 6u, g);
      let c7 = -SH2.x * Along(row, 7u, g);
      let c8 = 2.0 * SH2_DIAGONAL * Along(row, 8u, g);
      slope += vec3f(c4 * y + c7 * z + c8 * x, c4 * x + c5 * z - c8 * y, c5 * y + c6 * z + c7 * x);
      Put(row, 4u, SH2.x * xy, g);
      Put(row, 5u, -SH2.x * (y * z), g);
      Put(row, 6u, SH2.y * zz - SH2.z, g);
      Put(row, 7u, -SH2.x * (x * z), g);
      Put(row, 8u, SH2_DIAGONAL * difference, g);
    }
    if (degree > 2u) {
      let ring = SH3_2 - SH3_3 * zz;
      let c9 = -3.0 * SH3_0 * Along(row, 9u, g);
      let c10 = SH3_1 * Along(row, 10u, g);
      let c11 = Along(row, 11u, g);
      let c12 = Along(row, 12u, g);
      let c13 = Along(row, 13u, g);
      let c14 = SH3_6 * Along(row, 14u, g);
      let c15 = -3.0 * SH3_0 * Along(row, 15u, g);
      slope.x += 2.0 * c9 * xy + c10 * (y * z) + c13 * ring + 2.0 * c14 * (x * z) + c15 * difference;
      slope.y += c9 * difference + c10 * (x * z) + c11 * ring - 2.0 * c14 * (y * z) - 2.0 * c15 * xy;
      slope.z += c10 * xy - 2.0 * SH3_3 * (c11 * (y * z) + c13 * (x * z)) + c12 * (3.0 * SH3_4 * zz - SH3_5) +
                 c14 * difference;
      Put(row, 9u, -SH3_0 * y * (3.0 * xx - yy), g);
      Put(row, 10u, SH3_1 * (xy * z), g);
      Put(row, 11u, y * ring, g);
      Put(row, 12u, z * (SH3_4 * zz - SH3_5), g);
      Put(row, 13u, x * ring, g);
      Put(row, 14u, SH3_6 * z * difference, g);
      Put(row, 15u, -SH3_0 * x * (xx - 3.0 * yy), g);
    }
    Put(row, 0u, SH0, g);
    if (degree > 0u) {
      // The component along the ray has no effect.
      let along = inverse * (slope - dot(slope, direction) * direction);
      for (var k = 0u; k < 3u; k++) { mean_gradients[3u * i + k] += along[k]; }
    }
  }
  workgroupBarrier();

  if (own_row < side_by_side) {
    for (var row = own_row; row < count; row += side_by_side) {
      var value = 0.0;
      if (taught[row] != 0u && column < used) { value = rows[row * ROW + column]; }
      sh_gradients[(first + row) * stride + column] = value;
    }
  }
}
