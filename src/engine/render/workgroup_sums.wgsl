var<workgroup> sums: array<u32, 256>;

// Saturating.
fn Sum(a: u32, b: u32) -> u32 {
  let sum = a + b;
  return select(sum, 0xffffffffu, sum < a);
}

// Exclusive sums of one number per thread; `sums` receives the inclusive ones.
fn SumBefore(lane: u32, own: u32) -> u32 {
  sums[lane] = own;
  workgroupBarrier();
  for (var step = 1u; step < 256u; step *= 2u) {
    var before = 0u;
    if (lane >= step) { before = sums[lane - step]; }
    workgroupBarrier();
    sums[lane] = Sum(sums[lane], before);
    workgroupBarrier();
  }
  return sums[lane] - own;
}
