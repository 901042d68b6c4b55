// Lists the visible Gaussians in row order, with the bits of their depths as sort keys.

struct Visible {
  count: u32,    // Gaussians of the cloud
  sums_at: u32,  // Scan::sums_at
}
@group(0) @binding(0) var<uniform> visible: Visible;
@group(0) @binding(1) var<storage, read> rects: array<vec2u>;
@group(0) @binding(2) var<storage, read_write> marks: array<u32>;  // 1 if visible
@group(0) @binding(3) var<storage, read> places: array<u32>;       // the same, scanned
@group(0) @binding(4) var<storage, read> seen: array<Seen>;
@group(0) @binding(5) var<storage, read_write> keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> rows: array<u32>;

@compute @workgroup_size(256)
fn mark_visible(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let i = GroupNumber(group) * 256u + lane;
  if (i < visible.count) { marks[i] = select(0u, 1u, rects[i].y != 0u); }
}

@compute @workgroup_size(256)
fn list_visible(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let i = GroupNumber(group) * 256u + lane;
  if (i >= visible.count || rects[i].y == 0u) { return; }
  let to = places[i] + places[visible.sums_at + i / 2048u];
  // Depths are positive, so their bits sort like floats.
  keys[to] = bitcast<u32>(seen[i].depth);
  rows[to] = i;
}
