// Shared by the kernels of a picture: their parameters and a projected Gaussian. render/gpu_layout.h has the same
// structs for the host.

struct View {
  r0: vec4f, r1: vec4f, r2: vec4f,              // rows of world-to-camera, translation in w
  r0_low: vec4f, r1_low: vec4f, r2_low: vec4f,  // remainders beyond floats
  center: vec4f, center_low: vec4f,             // camera centre, world; w unused
  f: vec4f, f_low: vec4f,                       // fx, fy, cx, cy in pixels
  background: vec4f,                            // rgb; w unused
  size: vec4u,    // width, height in pixels; tiles_x, tiles_y
  counts: vec4u,  // Gaussians of the cloud; first and count of this dispatch; floats per row of SH
  planes: vec4f,  // near, far in world units; dilation, compensated_from in pixels²
  cuts: vec4f,    // min_alpha, log2(min_alpha), min_transmittance, max_alpha
  flags: vec4u,   // 1 if opacities are compensated; profile (0 gsplat 1.4, 1 gsplat 1.5); SH degree in use; always 0
}

// 64 bytes; counterpart of ProjectedGaussian (render/projected_gaussian.h), which has the formulas.
struct Seen {
  at: vec2f, at_low: vec2f,  // px: the mean is at + at_low, as floats at x = 1000 are 6e-5 px apart
  depth: f32,                // camera z, world units
  log2_opacity: f32,
  compensation: f32,
  spare: u32,
  u: vec3f, spare_u: f32,  // u_xx, u_xy, u_yy
  rgb: vec3f, spare_rgb: f32,
}

@group(0) @binding(0) var<uniform> view: View;

// Returns x opaquely to the compiler: flags.w is 0, and WGSL has no `precise`. Compensated sums need it, as drivers
// simplify (s + p) − s to p.
fn Opaque(x: f32) -> f32 { return bitcast<f32>(bitcast<u32>(x) ^ view.flags.w); }

// Limits of x/z (left, right) and y/z (up, down) in the Jacobian: the picture plus 30 % of its tangent.
fn JacobianLimits() -> vec4f {
  let size = vec2f(view.size.xy);
  let margin = 0.15 * size / view.f.xy;
  let low = -(view.f.zw / view.f.xy + margin);
  let high = (size - view.f.zw) / view.f.xy + margin;
  return vec4f(low.x, high.x, low.y, high.y);
}

// Number of tiles of a Gaussian's rectangle (render/gpu_layout.h) before a tile of the picture, in row-major order.
fn TilesBefore(rect: vec2u, tile: vec2u) -> u32 {
  let low = vec2u(rect.x & 0xffffu, rect.x >> 16u);
  let high = vec2u(rect.y & 0xffffu, rect.y >> 16u);
  let across = high.x - low.x;
  if (tile.y < low.y) { return 0u; }
  if (tile.y >= high.y) { return across * (high.y - low.y); }
  return across * (tile.y - low.y) + clamp(tile.x, low.x, high.x) - low.x;
}
