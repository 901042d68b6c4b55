// Ranges of all tiles from their counts, by one workgroup: what GpuRasterizer::ListRun does on the host. If memory does
// not suffice, or a Gaussian can only be projected by the CPU, all ranges are empty and nothing is listed; the report
// tells the host afterwards. Appended to workgroup_sums.wgsl.

struct TileRanges {
  tiles: u32,
  pairs: u32,      // capacity
  slots: u32,      // capacity for gradient sums: all tiles of all rectangles
  report_at: u32,
}
@group(0) @binding(0) var<uniform> room: TileRanges;
@group(0) @binding(1) var<storage, read> tile_counts: array<u32>;  // [T+1], the last counts cut tiles (render/bin.wgsl)
@group(0) @binding(2) var<storage, read> unusual: array<u32>;      // [0]: count
@group(0) @binding(3) var<storage, read_write> sizes: array<u32>;
@group(0) @binding(4) var<storage, read_write> ranges: array<u32>;
@group(0) @binding(5) var<storage, read_write> reports: array<vec4u>;  // visible, pairs, unusual, cut

@compute @workgroup_size(256)
fn place_tiles(@builtin(local_invocation_index) lane: u32) {
  let each = (room.tiles + 255u) / 256u;
  let first = min(lane * each, room.tiles);
  let last = min(first + each, room.tiles);
  var own = 0u;
  for (var tile = first; tile < last; tile++) { own = Sum(own, tile_counts[tile]); }
  let before = SumBefore(lane, own);
  let total = sums[255];
  let cut = tile_counts[room.tiles];
  let fits = unusual[0] == 0u && total <= room.pairs && total <= room.slots && cut <= (room.slots - total) / 32u;
  var at = select(0u, before, fits);
  for (var tile = first; tile < last; tile++) {
    ranges[tile] = at;
    if (fits) { at += tile_counts[tile]; }
  }
  if (lane == 0u) {
    ranges[room.tiles] = select(0u, total, fits);
    sizes[1] = select(0u, total, fits);
    reports[room.report_at] = vec4u(sizes[0], total, unusual[0], cut);
  }
}
