// Rays of pixels and back: AverageRays and SpreadToRays of pixel_model.h. A thread is a number of the averages, or a ray.

struct Rays {
  size: vec2u,   // of the averages, pixels
  samples: u32,  // per pixel and side
  plane: u32,    // numbers from one channel of the rays to the next
}

@group(0) @binding(0) var<uniform> model: Rays;
@group(0) @binding(1) var<storage, read> rays: array<f32>;            // 3 times [H·samples,W·samples]
@group(0) @binding(2) var<storage, read_write> averages: array<f32>;  // [3,H,W]

@compute @workgroup_size(256) fn average_rays(@builtin(workgroup_id) group: vec3u,
                                              @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group) * 256u + lane;
  let plane = model.size.x * model.size.y;
  if (number >= 3u * plane) { return; }
  let s = model.samples;
  let width = model.size.x * s;
  let pixel = number % plane;
  let corner = number / plane * model.plane + pixel / model.size.x * s * width + pixel % model.size.x * s;
  var sum = 0.0;
  for (var x = 0u; x < s; x++) {
    var column = 0.0;
    for (var y = 0u; y < s; y++) { column += rays[corner + y * width + x]; }
    sum += column;
  }
  averages[number] = sum / f32(s * s);
}

@group(0) @binding(1) var<storage, read> of_averages: array<vec4f>;    // [H,W] gradients
@group(0) @binding(2) var<storage, read_write> of_rays: array<vec4f>;  // [H·samples,W·samples]

@compute @workgroup_size(256) fn spread_to_rays(@builtin(workgroup_id) group: vec3u,
                                                @builtin(local_invocation_index) lane: u32) {
  let number = GroupNumber(group) * 256u + lane;
  let s = model.samples;
  let width = model.size.x * s;
  if (number >= width * model.size.y * s) { return; }
  let pixel = vec2u(number % width, number / width) / s;
  of_rays[number] = of_averages[pixel.y * model.size.x + pixel.x] / f32(s * s);
}
