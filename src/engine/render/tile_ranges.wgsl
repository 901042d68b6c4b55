// The ranges of all tiles from their counts, by one workgroup: what the host does where it looks on between the counts
// and the lists (GpuRasterizer::ListRun). Where there is more than there is room for, or a Gaussian that only the CPU can
// project, all ranges are empty and nothing is listed. What is written down tells the host afterwards.
// Compiled behind workgroup_sums.wgsl.

struct TileRanges {
  tiles: u32,
  pairs: u32,      // room for them
  slots: u32,      // room for the sums of the gradient: of all tiles of all rectangles
  report_at: u32,
}
@group(0) @binding(0) var<uniform> room: TileRanges;
@group(0) @binding(1) var<storage, read> tile_counts: array<u32>;  // [T+1], the last one of what is cut (render/bin.wgsl)
@group(0) @binding(2) var<storage, read> unusual: array<u32>;      // [0]: how many
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
