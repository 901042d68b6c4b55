// One step of Adam on rows of numbers: adam.h, render/adam-inl.h. A thread is a number.

struct Adam {
  rows: u32,
  stride: u32,         // numbers per row
  columns: u32,        // of each row that are updated, the first ones
  first_columns: u32,  // of these that learn at first_rate
  first_rate: f32,     // both corrected (render/adam_runs.h)
  rate: f32,
  one_minus_beta1: f32,
  beta2: f32,
  one_minus_beta2: f32,
  inverse_correction2: f32,
  epsilon: f32,
}

@group(0) @binding(0) var<uniform> adam: Adam;
@group(0) @binding(1) var<storage, read> gradient: array<f32>;  // all [rows, stride]
@group(0) @binding(2) var<storage, read_write> first_moment: array<f32>;
@group(0) @binding(3) var<storage, read_write> second_moment: array<f32>;
@group(0) @binding(4) var<storage, read_write> values: array<f32>;

@compute @workgroup_size(256) fn adam_step(@builtin(workgroup_id) group: vec3u,
                                           @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group) * 256u + lane;
  let row = number / adam.columns;
  let column = number % adam.columns;
  if (row >= adam.rows) { return; }
  let i = row * adam.stride + column;
  let g = gradient[i];
  let m = fma(adam.one_minus_beta1, g - first_moment[i], first_moment[i]);
  let v = fma(adam.one_minus_beta2 * g, g, adam.beta2 * second_moment[i]);
  let denominator = fma(sqrt(v), adam.inverse_correction2, adam.epsilon);
  first_moment[i] = m;
  second_moment[i] = v;
  values[i] = fma(-select(adam.rate, adam.first_rate, column < adam.first_columns), m / denominator, values[i]);
}
