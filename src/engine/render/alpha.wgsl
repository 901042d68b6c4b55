// log2 α of a Gaussian at a pixel, (dx, dy) from the mean. Forward and backward must agree on every pixel, so it is
// computed only here, with operations that compilers cannot reassociate.
fn Log2Alpha(shape: vec4f, dx: f32, dy: f32) -> f32 {  // u_xx, u_xy, u_yy, log2_opacity
  let u = fma(shape.x, dx, shape.y * dy);
  let v = shape.z * dy;
  return fma(-u, u, fma(-v, v, shape.w));
}

// 2^x for −126 ≤ x ≤ 0, the polynomial of render/tile_batch-inl.h.
fn Exp2(x: f32) -> f32 {
  let n = floor(x + 0.5);
  let f = x - n;
  var p = 1.326472725e-3;
  p = p * f + 9.671512688e-3;
  p = p * f + 5.550733744e-2;
  p = p * f + 2.402224208e-1;
  p = p * f + 6.931469776e-1;
  p = p * f + 1.0;
  return bitcast<f32>(bitcast<i32>(p) + (i32(n) << 23u));
}
