// Colours of the visible Gaussians of a block of the cloud: counterpart of render/spherical_harmonics.cc.

@group(0) @binding(1) var<storage, read> means: array<f32>;
@group(0) @binding(2) var<storage, read> sh: array<f32>;
@group(0) @binding(3) var<storage, read_write> rects: array<vec2u>;
@group(0) @binding(4) var<storage, read_write> seen: array<Seen>;

fn Coefficient(at: u32) -> vec3f { return vec3f(sh[at], sh[at + 1u], sh[at + 2u]); }

fn Difference(mean: f32, center: f32, low: f32) -> f32 {
  let d = TwoSum(mean, -center);
  return d.x + (d.y - low);
}

@compute @workgroup_size(256)
fn color(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let i = GroupNumber(group) * 256u + lane;
  if (i >= view.counts.z) { return; }
  let row = view.counts.y + i;
  if (rects[row].y == 0u) { return; }
  let degree = view.flags.z;
  let at = i * view.counts.w;
  // Overflowing sums and non-finite values are left to the CPU.
  var largest = 0u;
  for (var k = 0u; k < 3u * (degree + 1u) * (degree + 1u); k++) { largest = max(largest, Magnitude(sh[at + k])); }
  if (largest > bitcast<u32>(1e30f)) {
    rects[row] = vec2u(0u);
    LeaveToCpu(row);
    return;
  }
  let direction = vec3f(Difference(means[3u * i], view.center.x, view.center_low.x),
                        Difference(means[3u * i + 1u], view.center.y, view.center_low.y),
                        Difference(means[3u * i + 2u], view.center.z, view.center_low.z));
  let d = direction * (1.0 / sqrt(dot(direction, direction)));
  let x = d.x;
  let y = d.y;
  let z = d.z;
  var c = 0.28209479177387814 * Coefficient(at);
  if (degree > 0u) {
    c += -0.4886025119029199 * y * Coefficient(at + 3u) + 0.4886025119029199 * z * Coefficient(at + 6u) -
         0.4886025119029199 * x * Coefficient(at + 9u);
  }
  let xx = x * x;
  let yy = y * y;
  let zz = z * z;
  if (degree > 1u) {
    c += 1.0925484305920792 * x * y * Coefficient(at + 12u) - 1.0925484305920792 * y * z * Coefficient(at + 15u) +
         (0.94617469575755997 * zz - 0.31539156525251999) * Coefficient(at + 18u) -
         1.0925484305920792 * x * z * Coefficient(at + 21u) + 0.54627421529603959 * (xx - yy) * Coefficient(at + 24u);
  }
  if (degree > 2u) {
    let ring = 0.45704579946446572 - 2.2852289973223288 * zz;
    c += -0.59004358992664352 * y * (3.0 * xx - yy) * Coefficient(at + 27u) +
         2.8906114426405538 * x * y * z * Coefficient(at + 30u) + y * ring * Coefficient(at + 33u) +
         z * (1.865881662950577 * zz - 1.1195289977703462) * Coefficient(at + 36u) +
         x * ring * Coefficient(at + 39u) + 1.4453057213202769 * z * (xx - yy) * Coefficient(at + 42u) -
         0.59004358992664352 * x * (xx - 3.0 * yy) * Coefficient(at + 45u);
  }
  seen[row].rgb = max(c + 0.5, vec3f(0.0));
}
