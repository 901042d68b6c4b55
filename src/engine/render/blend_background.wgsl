// Σ T·∂L/∂C over the pixels of each tile: the background's gradient. Appended to view.wgsl.

struct BlendBackground {
  size: vec4u,  // width in pixels; tiles_x; first tile and tile count of this dispatch
  box: vec4u,   // x0, y0, x1, y1 of pixels with a gradient, half-open; nothing outside is read
  first_row: u32,  // first pixel row in `upstream`
}

@group(0) @binding(0) var<uniform> job: BlendBackground;
@group(0) @binding(1) var<storage, read> kept: array<vec2u>;
@group(0) @binding(2) var<storage, read> upstream: array<vec4f>;  // row-major in the box: ∂L/∂C, ∂L/∂A
@group(0) @binding(3) var<storage, read_write> backgrounds: array<vec4f>;  // rgb per tile of the picture

var<workgroup> sums: array<vec4f, 256>;

@compute @workgroup_size(256)
fn blend_background(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let number = GroupNumber(group);
  if (number >= job.size.w) { return; }
  let tile = job.size.z + number;
  let pixel = 16u * vec2u(tile % job.size.y, tile / job.size.y) + vec2u(thread % 16u, thread / 16u);
  var sum = vec4f(0.0);
  if (all(pixel >= job.box.xy) && all(pixel < job.box.zw)) {
    let g = upstream[(pixel.y - job.first_row) * (job.box.z - job.box.x) + pixel.x - job.box.x];
    sum = bitcast<f32>(kept[pixel.y * job.size.x + pixel.x].x) * vec4f(g.xyz, 0.0);
  }
  sums[thread] = sum;
  workgroupBarrier();
  for (var width = 128u; width > 0u; width /= 2u) {
    if (thread < width) { sums[thread] += sums[thread + width]; }
    workgroupBarrier();
  }
  if (thread == 0u) { backgrounds[tile] = sums[0]; }
}
