// Copies rows projected by the CPU (render/unusual.wgsl) to the others.

struct Patch { count: u32 }
@group(0) @binding(0) var<uniform> patched: Patch;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> seen_in: array<Seen>;
@group(0) @binding(3) var<storage, read> rects_in: array<vec2u>;
@group(0) @binding(4) var<storage, read> radii_in: array<vec2i>;
@group(0) @binding(5) var<storage, read_write> seen: array<Seen>;
@group(0) @binding(6) var<storage, read_write> rects: array<vec2u>;
@group(0) @binding(7) var<storage, read_write> radii: array<vec2i>;

@compute @workgroup_size(256)
fn patch_rows(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let i = GroupNumber(group) * 256u + lane;
  if (i >= patched.count) { return; }
  let row = rows[i];
  seen[row] = seen_in[i];
  rects[row] = rects_in[i];
  radii[row] = radii_in[i];
}
