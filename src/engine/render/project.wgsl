// Projects the Gaussians of a block of the cloud and finds their tiles: counterpart of render/project.cc, formula by
// formula. Positions are wide (render/accurate.wgsl), shapes are floats.

@group(0) @binding(1) var<storage, read> means: array<f32>;
@group(0) @binding(2) var<storage, read> log_scales: array<f32>;
@group(0) @binding(3) var<storage, read> quats: array<vec4f>;
@group(0) @binding(4) var<storage, read> opacity_logits: array<f32>;
@group(0) @binding(5) var<storage, read_write> seen: array<Seen>;
@group(0) @binding(6) var<storage, read_write> rects: array<vec2u>;
@group(0) @binding(7) var<storage, read_write> radii: array<vec2i>;

const LARGEST_LOG_SCALE = 44.0f;  // core/gaussian_cloud.h
const TILE = 16.0;

// One row of world-to-camera times the mean.
fn PlaceAlong(row: vec4f, low: vec4f, mean: vec3f) -> vec2f {
  var sum = vec2f(row.w, low.w);
  sum = WideSum(sum, WideProduct(vec2f(row.x, low.x), vec2f(mean.x, 0.0)));
  sum = WideSum(sum, WideProduct(vec2f(row.y, low.y), vec2f(mean.y, 0.0)));
  return WideSum(sum, WideProduct(vec2f(row.z, low.z), vec2f(mean.z, 0.0)));
}

// −Inf is the scale 0.
fn Scale(log_scale: f32) -> f32 {
  if (bitcast<u32>(log_scale) == 0xff800000u) { return 0.0; }
  return Exp(max(log_scale, -100.0));
}

@compute @workgroup_size(256)
fn project(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let i = GroupNumber(group) * 256u + lane;  // index in the block
  if (i >= view.counts.z) { return; }
  let row = view.counts.y + i;
  rects[row] = vec2u(0u);
  radii[row] = vec2i(0);

  // Usable, and within the range of the computations below.
  let mean = vec3f(means[3u * i], means[3u * i + 1u], means[3u * i + 2u]);
  let log_scale = vec3f(log_scales[3u * i], log_scales[3u * i + 1u], log_scales[3u * i + 2u]);
  let quat = quats[i];
  let logit = opacity_logits[i];
  let farthest = max(Magnitude(mean.x), max(Magnitude(mean.y), Magnitude(mean.z)));
  let longest_quat = max(max(Magnitude(quat.x), Magnitude(quat.y)), max(Magnitude(quat.z), Magnitude(quat.w)));
  if (farthest >= INFINITE || longest_quat >= INFINITE || Magnitude(logit) > INFINITE) { return; }
  var longest_log_scale = 0u;  // of those above 1: bits of positive floats sort like them, NaN last
  for (var k = 0u; k < 3u; k++) {
    let bits = bitcast<u32>(log_scale[k]);
    if (Magnitude(log_scale[k]) > INFINITE) { return; }
    if ((bits >> 31u) == 0u) { longest_log_scale = max(longest_log_scale, bits); }
  }
  if (longest_log_scale > bitcast<u32>(LARGEST_LOG_SCALE)) { return; }
  let zero_quat = longest_quat == 0u;
  if (farthest > bitcast<u32>(1e9f) || longest_log_scale > bitcast<u32>(30.0f) ||
      (!zero_quat && (longest_quat < bitcast<u32>(1e-12f) || longest_quat > bitcast<u32>(1e11f)))) {
    LeaveToCpu(row);
    return;
  }

  // Position.
  let z = PlaceAlong(view.r2, view.r2_low, mean);
  if (z.x < view.planes.x || (z.x == view.planes.x && z.y < 0.0)) { return; }
  if (z.x > view.planes.y || (z.x == view.planes.y && z.y > 0.0)) { return; }
  if (z.x < 1e-9) {
    LeaveToCpu(row);
    return;
  }
  let wide_x = WideQuotient(PlaceAlong(view.r0, view.r0_low, mean), z);
  let wide_y = WideQuotient(PlaceAlong(view.r1, view.r1_low, mean), z);
  let at_x = WideSum(WideProduct(vec2f(view.f.x, view.f_low.x), wide_x), vec2f(view.f.z, view.f_low.z));
  let at_y = WideSum(WideProduct(vec2f(view.f.y, view.f_low.y), wide_y), vec2f(view.f.w, view.f_low.w));
  let at = vec2f(at_x.x, at_y.x);
  let ratio = vec2f(wide_x.x, wide_y.x);
  let inverse_z = 1.0 / z.x;

  // Shape: B = J·R·R_q·S, of which both rows are `b0` and `b1`.
  let norm2 = dot(quat, quat);
  let q = select(quat * (1.0 / sqrt(select(norm2, 1.0, zero_quat))), vec4f(1.0, 0.0, 0.0, 0.0), zero_quat);
  let w = q.x;
  let x2 = 2.0 * q.y;
  let y2 = 2.0 * q.z;
  let z2 = 2.0 * q.w;
  let c0 = vec3f(1.0 - z2 * q.w - y2 * q.z, x2 * q.z + z2 * w, x2 * q.w - y2 * w);
  let c1 = vec3f(x2 * q.z - z2 * w, 1.0 - z2 * q.w - x2 * q.y, y2 * q.w + x2 * w);
  let c2 = vec3f(x2 * q.w + y2 * w, y2 * q.w - x2 * w, 1.0 - y2 * q.z - x2 * q.y);
  let s = vec3f(Scale(log_scale.x), Scale(log_scale.y), Scale(log_scale.z));
  let limits = JacobianLimits();
  let clamped = clamp(ratio, limits.xz, limits.yw);
  let a0 = view.f.x * inverse_z * (view.r0.xyz - clamped.x * view.r2.xyz);
  let a1 = view.f.y * inverse_z * (view.r1.xyz - clamped.y * view.r2.xyz);
  let b0 = s * vec3f(dot(a0, c0), dot(a0, c1), dot(a0, c2));
  let b1 = s * vec3f(dot(a1, c0), dot(a1, c1), dot(a1, c2));
  let longest = max(max(max(abs(b0.x), abs(b0.y)), max(abs(b0.z), abs(b1.x))), max(abs(b1.y), abs(b1.z)));
  if (longest > 1e8) {
    LeaveToCpu(row);
    return;
  }
  let minors = vec3f(DifferenceOfProducts(b0.y, b1.z, b0.z, b1.y), DifferenceOfProducts(b0.z, b1.x, b0.x, b1.z),
                     DifferenceOfProducts(b0.x, b1.y, b0.y, b1.x));
  let sharp_det = dot(minors, minors);
  let sharp = vec2f(dot(b0, b0), dot(b1, b1));
  let trace = sharp.x + sharp.y;
  let dilation = view.planes.z;
  let from_dilation = view.planes.w;
  let xx = sharp.x + dilation;
  let yy = sharp.y + dilation;
  let xy = dot(b0, b1);
  let det = sharp_det + dilation * (trace + dilation);
  let from_det = sharp_det + from_dilation * (trace + from_dilation);
  let compensated = view.flags.x != 0u;
  if (select(det, from_det, compensated) < 1e-30) {
    LeaveToCpu(row);
    return;
  }

  // Opacity. Beyond ±87 it is 0 or 1, also for infinite logits.
  var compensation = 1.0;
  if (compensated) { compensation = sqrt(from_det / det); }
  var bounded = 87.0;
  if (Magnitude(logit) < INFINITE) { bounded = clamp(logit, -87.0, 87.0); }
  else if (bitcast<u32>(logit) == 0xff800000u) { bounded = -87.0; }
  let opacity = compensation / (1.0 + Exp(-bounded));
  let log2_opacity = Log2(max(opacity, 1e-37));
  let room = log2_opacity - view.cuts.y;               // log2(opacity / min_alpha)
  let reach2 = 1.38629436 * max(room, 0.0);            // σ² where α = min_alpha

  // Radius and square of the profile.
  var radius: vec2f;
  if (view.flags.y == 0u) {
    let half_trace = 0.5 * (xx + yy);
    let slant = 0.5 * (xx - yy);
    radius = vec2f(ceil(3.0 * sqrt(half_trace + sqrt(max(0.01, slant * slant + xy * xy)))));
  } else {
    if (room < 0.0) { return; }
    radius = ceil(min(3.33, sqrt(reach2)) * sqrt(vec2f(xx, yy)));
  }
  if (any(at + radius <= vec2f(0.0)) || any(at - radius >= vec2f(view.size.xy))) { return; }
  radii[row] = vec2i(min(radius, vec2f(2147483520.0)));
  if (room < 0.0) { return; }

  // Tiles of the square, intersected with those of pixel centres in the ellipse's box, with a margin against rounding.
  let half = sqrt(reach2 * vec2f(xx, yy));
  let margin = 1e-6 * (abs(at) + half) + 1e-6;
  let box0 = at - half - 0.5 - margin;
  let box1 = at + half - 0.5 + margin;
  let low = max(floor((at - radius) / TILE), floor(box0 / TILE));
  let high = min(ceil((at + radius) / TILE), floor(box1 / TILE) + 1.0);
  let tiles = vec2f(view.size.zw);
  let first = vec2u(clamp(low, vec2f(0.0), tiles));
  let last = vec2u(clamp(high, vec2f(0.0), tiles));
  if (any(first >= last)) { return; }

  // The conic's Cholesky factor.
  const SCALE = 0.849321800288019;  // sqrt(½·log2 e)
  let root_yy = sqrt(yy);
  let by_yy = SCALE / root_yy;
  let by_det = 1.0 / sqrt(det);
  var g: Seen;
  g.at = at;
  g.at_low = vec2f(at_x.y, at_y.y);
  g.depth = z.x;
  g.log2_opacity = log2_opacity;
  g.compensation = compensation;
  g.u = vec3f(SCALE * root_yy * by_det, -by_yy * by_det * xy, by_yy);
  seen[row] = g;
  rects[row] = vec2u(first.x | (first.y << 16u), last.x | (last.y << 16u));
}
