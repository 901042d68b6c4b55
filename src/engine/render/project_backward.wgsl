// Counterpart of project_backward.cc, which has the formulas; recomputes parts of the projection (projection-inl.h).
// Appended to view.wgsl and accurate.wgsl. Two entry points, as a stage has eight buffers and a Gaussian more columns:
// each computes what its columns need. Arrays start at the first Gaussian of the dispatch. Gaussians without sums, such
// as culled ones, have gradient 0.

@group(0) @binding(1) var<storage, read> seen: array<Seen>;
@group(0) @binding(2) var<storage, read> sums: array<vec4f>;  // [N,12] from gather_slots.wgsl
@group(0) @binding(3) var<storage, read> log_scales: array<f32>;
@group(0) @binding(4) var<storage, read> quats: array<vec4f>;
@group(0) @binding(5) var<storage, read> opacity_logits: array<f32>;

struct Gradients {
  mean: vec3f,
  log_scales: vec3f,
  quat: vec4f,
  means2d: vec2f,
}

// −Inf is the scale 0.
fn Scale(log_scale: f32) -> f32 {
  if (bitcast<u32>(log_scale) == 0xff800000u) { return 0.0; }
  return Exp(max(log_scale, -100.0));
}

// Compares bits, as float comparisons may ignore NaN.
fn HasSums(i: u32) -> bool {
  let bits = bitcast<vec4u>(sums[3u * i]) | vec4u(bitcast<vec2u>(sums[3u * i + 1u].xy), 0u, 0u);
  return any((bits & vec4u(0x7fffffffu)) != vec4u(0u));
}

fn Backward(i: u32) -> Gradients {
  let g = seen[i];
  let inverse_z = 1.0 / g.depth;
  let ratio = (((g.at - view.f.zw) + g.at_low) - view.f_low.zw) / view.f.xy;
  let rx = view.r0.xyz;
  let ry = view.r1.xyz;
  let rz = view.r2.xyz;

  // The unit quaternion and its rotation, by columns. Not by the squared norm, which underflows to 0 for short
  // quaternions.
  let stored = quats[i];
  let largest = max(max(abs(stored.x), abs(stored.y)), max(abs(stored.z), abs(stored.w)));
  let zero_quat = largest == 0.0;
  let scaled = select(stored / largest, vec4f(1.0, 0.0, 0.0, 0.0), zero_quat);
  let inverse_length = 1.0 / length(scaled);
  let inverse_norm = select(inverse_length / largest, 0.0, zero_quat);
  let unit = scaled * inverse_length;
  let qw = unit.x;
  let qx = unit.y;
  let qy = unit.z;
  let qz = unit.w;
  let c0 = vec3f(1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy + qz * qw), 2.0 * (qx * qz - qy * qw));
  let c1 = vec3f(2.0 * (qx * qy - qz * qw), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz + qx * qw));
  let c2 = vec3f(2.0 * (qx * qz + qy * qw), 2.0 * (qy * qz - qx * qw), 1.0 - 2.0 * (qx * qx + qy * qy));
  let s = vec3f(Scale(log_scales[3u * i]), Scale(log_scales[3u * i + 1u]), Scale(log_scales[3u * i + 2u]));

  // A = J·R, B = A·R_q·S, by rows for image x and y.
  let limits = JacobianLimits();
  let clamped = clamp(ratio, limits.xz, limits.yw);
  let focal = view.f.xy * inverse_z;
  let ax = focal.x * (rx - clamped.x * rz);
  let ay = focal.y * (ry - clamped.y * rz);
  let bx = s * vec3f(dot(ax, c0), dot(ax, c1), dot(ax, c2));
  let by = s * vec3f(dot(ay, c0), dot(ay, c1), dot(ay, c2));

  const TWO_LN2 = 1.3862943611198906;
  const FOUR_LN2_SQUARED = 1.9218120556728056;
  let w_xx = g.u.x;
  let w_xy = g.u.y;
  let w_yy = g.u.z;
  let sums0 = sums[3u * i];
  let sums1 = sums[3u * i + 1u];
  let q = sums0.x;
  let means2d = TWO_LN2 * vec2f(w_xx * sums0.y, w_xy * sums0.y + w_yy * sums0.z);

  // ∂L/∂B = Wᵀ·M, M = 4 ln²2·(Σ q·(u, v)(u, v)ᵀ)·(W·B); the logarithms of the scales have the diagonal of (W·B)ᵀ·M.
  let quu = FOUR_LN2_SQUARED * sums0.w;
  let quv = FOUR_LN2_SQUARED * sums1.x;
  let qvv = FOUR_LN2_SQUARED * sums1.y;
  let wbx = vec3f(DifferenceOfProducts(w_xx, bx.x, -w_xy, by.x), DifferenceOfProducts(w_xx, bx.y, -w_xy, by.y),
                  DifferenceOfProducts(w_xx, bx.z, -w_xy, by.z));
  let wby = w_yy * by;
  let mx = quu * wbx + quv * wby;
  let my = quv * wbx + qvv * wby;
  var g_scales = mx * wbx + my * wby;
  var g_bx = w_xx * mx;
  var g_by = w_xy * mx + w_yy * my;
  if (view.flags.x != 0u) {
    // ∂ln o/∂Σ = ½ (Σ_from⁻¹ − Σ₂⁻¹), and ∂/∂B is twice that times B. With the minors m = b_x × b_y, det·(B·Bᵀ +
    // δ·I)⁻¹·B has the rows δ·b_x + b_y × m and δ·b_y + m × b_x, without the differences of products that lose
    // precision for needles. If the determinant is 0, so is the opacity.
    let minors = vec3f(DifferenceOfProducts(bx.y, by.z, bx.z, by.y), DifferenceOfProducts(bx.z, by.x, bx.x, by.z),
                       DifferenceOfProducts(bx.x, by.y, bx.y, by.x));
    let sharp_det = dot(minors, minors);
    let trace = dot(bx, bx) + dot(by, by);
    let dilation = view.planes.z;
    let from_dilation = view.planes.w;
    let from_det = sharp_det + from_dilation * (trace + from_dilation);
    let by_det = q / (sharp_det + dilation * (trace + dilation));
    let by_from = select(0.0, q / from_det, from_det > 0.0);
    let by_dilation = by_from * from_dilation - by_det * dilation;
    let by_sharp = by_from - by_det;
    g_bx += by_dilation * bx + by_sharp * cross(by, minors);
    g_by += by_dilation * by + by_sharp * cross(minors, bx);
    let m2 = minors * minors;
    g_scales += by_dilation * (bx * bx + by * by) + by_sharp * (m2.yzx + m2.zxy);
  }

  // ∂L/∂E with E = A·R_q; ∂L/∂R_q = Aᵀ·∂L/∂E, by rows.
  let ex = g_bx * s;
  let ey = g_by * s;
  let g0 = ax.x * ex + ay.x * ey;
  let g1 = ax.y * ex + ay.y * ey;
  let g2 = ax.z * ex + ay.z * ey;
  // The quaternion: first as if its norm were 1, then along the sphere.
  let turn = vec3f(g2.y - g1.z, g0.z - g2.x, g1.x - g0.y);
  let sum_xy = g0.y + g1.x;
  let sum_xz = g0.z + g2.x;
  let sum_yz = g1.z + g2.y;
  let g_quat = 2.0 * vec4f(dot(unit.yzw, turn),
                           qw * turn.x + (qy * sum_xy + qz * sum_xz - 2.0 * qx * (g1.y + g2.z)),
                           qw * turn.y + (qx * sum_xy + qz * sum_yz - 2.0 * qy * (g0.x + g2.z)),
                           qw * turn.z + (qx * sum_xz + qy * sum_yz - 2.0 * qz * (g0.x + g1.y)));
  let quat = inverse_norm * (g_quat - dot(unit, g_quat) * unit);

  // ∂L/∂A = ∂L/∂E·R_qᵀ. A is f/z·(R_x − u·R_z): through z, and through u where it is not clamped.
  let g_ax = ex.x * c0 + ex.y * c1 + ex.z * c2;
  let g_ay = ey.x * c0 + ey.y * c1 + ey.z * c2;
  let g_ratio = select(vec2f(0.0), -vec2f(dot(g_ax, rz), dot(g_ay, rz)), clamped == ratio);
  let g_at = focal * (g_ratio * inverse_z + means2d);
  let g_z = -((dot(g_ax, ax) + dot(g_ay, ay)) * inverse_z + dot(g_at, ratio));
  return Gradients(g_at.x * rx + g_at.y * ry + g_z * rz, g_scales, quat, means2d);
}

@group(0) @binding(6) var<storage, read_write> log_scale_gradients: array<f32>;
@group(0) @binding(7) var<storage, read_write> quat_gradients: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> opacity_logit_gradients: array<f32>;

@compute @workgroup_size(256)
fn project_backward_shapes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let i = GroupNumber(group) * 256u + thread;
  if (i >= view.counts.z) { return; }
  var log_scale = vec3f(0.0);
  var quat = vec4f(0.0);
  var logit = 0.0;
  if (HasSums(i)) {
    let gradients = Backward(i);
    log_scale = gradients.log_scales;
    quat = gradients.quat;
    // ∂ln sigmoid(x)/∂x = 1/(1 + e^x). Infinities are clamped.
    var bounded = opacity_logits[i];
    let bits = bitcast<u32>(bounded);
    if ((bits & 0x7fffffffu) > bitcast<u32>(87.0f)) { bounded = select(87.0, -87.0, bits >> 31u == 1u); }
    logit = sums[3u * i].x / (1.0 + Exp(bounded));
  }
  for (var k = 0u; k < 3u; k++) { log_scale_gradients[3u * i + k] = log_scale[k]; }
  quat_gradients[i] = quat;
  opacity_logit_gradients[i] = logit;
}

// spherical_harmonics_backward.wgsl adds the means' part through the colours.
@group(0) @binding(5) var<storage, read_write> mean_gradients: array<f32>;
@group(0) @binding(6) var<storage, read_write> means2d: array<vec2f>;

@compute @workgroup_size(256)
fn project_backward_places(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let i = GroupNumber(group) * 256u + thread;
  if (i >= view.counts.z) { return; }
  var mean = vec3f(0.0);
  var mean2d = vec2f(0.0);
  if (HasSums(i)) {
    let gradients = Backward(i);
    mean = gradients.mean;
    mean2d = gradients.means2d;
  }
  for (var k = 0u; k < 3u; k++) { mean_gradients[3u * i + k] = mean[k]; }
  means2d[i] = mean2d;
}

@group(0) @binding(3) var<storage, read_write> means2d_abs: array<vec2f>;

@compute @workgroup_size(256)
fn copy_absolute(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let i = GroupNumber(group) * 256u + thread;
  if (i < view.counts.z) { means2d_abs[i] = sums[3u * i + 2u].yz; }
}
