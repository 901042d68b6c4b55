// Tiles of every visible Gaussian: counted per tile and per Gaussian, then listed. Counterpart of render/bin.cc.
//
// One kernel does all, so that counting and listing use the same arithmetic: two pipelines may round an ellipse's edge
// differently. The CPU cuts large rectangles in double. Here the ellipse is slightly enlarged instead, so sometimes a
// tile is listed that the CPU omits; none of its pixels is reached.

struct Bin {
  tiles_x: u32,
  first_tile: u32, last_tile: u32,  // the run
  step: u32,
  sums_at: u32,                     // Scan::sums_at of `places`
  log2_min_alpha: f32,
  tiles: u32,                       // of the picture
}
const COUNT_TILES = 0u;  // writes tiles to tile_counts, and a Gaussian's pairs to places
const COUNT_PAIRS = 1u;  // writes a Gaussian's pairs to places
const LIST_PAIRS = 2u;   // from the scanned places to keys and pairs

@group(0) @binding(0) var<uniform> bin: Bin;
@group(0) @binding(1) var<storage, read> sizes: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> rects: array<vec2u>;
@group(0) @binding(4) var<storage, read> seen: array<Seen>;
@group(0) @binding(5) var<storage, read_write> tile_counts: array<atomic<u32>>;  // [T+1], the last counts cut tiles
@group(0) @binding(6) var<storage, read_write> places: array<u32>;
@group(0) @binding(7) var<storage, read_write> keys: array<u32>;   // tile within the run
@group(0) @binding(8) var<storage, read_write> pairs: array<u32>;  // row

const TILE = 16.0;
const WORTH_CUTTING = 64u;  // tiles

// As EllipseRows of render/bin.cc: α ≥ min_alpha at height dy for dx ∈ shear·dy ± half·sqrt(reach² − v²).
struct Ellipse {
  x: f32, y: f32, reach2: f32, u_yy: f32, half: f32, shear: f32, height: f32, rightmost: f32,
  beyond: bool,  // out of float range: no row of the rectangle is cut
}

fn EllipseOf(row: u32) -> Ellipse {
  let u = seen[row].u;
  var e: Ellipse;
  e.x = seen[row].at.x;
  e.y = seen[row].at.y;
  e.reach2 = max(0.0, seen[row].log2_opacity - bin.log2_min_alpha) * 1.000004 + 1e-6;
  e.u_yy = u.z;
  e.beyond = u.x < 1e-12 || u.z < 1e-12 || u.x > 1e12 || u.z > 1e12 || abs(u.y) > 1e12;
  if (e.beyond) { return e; }
  e.half = 1.0 / u.x;
  e.shear = -u.y * e.half;
  e.height = sqrt(e.reach2) / u.z;
  // Height of the rightmost point; the leftmost one is opposite. Divided by the larger of both, as the square may
  // overflow.
  let slope = e.half * u.z;
  let larger = max(abs(e.shear), slope);
  let a = e.shear / larger;
  let b = slope / larger;
  e.rightmost = e.height * a / sqrt(a * a + b * b);
  return e;
}

fn Edge(e: Ellipse, dy: f32, side: f32) -> f32 {
  let v = e.u_yy * dy;
  return e.x + e.shear * dy + side * e.half * sqrt(max(0.0, e.reach2 - v * v));
}

// Columns [x, y) of a row of tiles that intersect the ellipse, within its rectangle.
fn Columns(e: Ellipse, tile_y: u32, columns: vec2u) -> vec2u {
  if (e.beyond) { return columns; }
  let margin = 0.01 + 1e-6 * (abs(e.x) + abs(e.y));
  let top = max(f32(tile_y) * TILE + 0.5 - margin - e.y, -e.height);
  let bottom = min(f32(tile_y) * TILE + TILE - 0.5 + margin - e.y, e.height);
  if (top > bottom) { return vec2u(columns.x); }
  let right = Edge(e, clamp(e.rightmost, top, bottom), 1.0);
  let left = Edge(e, clamp(-e.rightmost, top, bottom), -1.0);
  let within = vec2f(columns);
  let first = clamp(floor((left - margin - 0.5) / TILE), within.x, within.y);
  let last = clamp(floor((right + margin - 0.5) / TILE) + 1.0, first, within.y);
  return vec2u(u32(first), u32(last));
}

@compute @workgroup_size(256)
fn visit_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let place = GroupNumber(group) * 256u + lane;
  if (place >= sizes[0] || (bin.step == LIST_PAIRS && sizes[1] == 0u)) { return; }
  let row = order[place];
  let rect = rects[row];
  let columns = vec2u(rect.x & 0xffffu, rect.y & 0xffffu);
  let rows = vec2u(rect.x >> 16u, rect.y >> 16u);
  let cut = (columns.y - columns.x) * (rows.y - rows.x) > WORTH_CUTTING;
  var ellipse: Ellipse;
  if (cut) { ellipse = EllipseOf(row); }
  var at = 0u;
  if (bin.step == LIST_PAIRS) { at = places[place] + places[bin.sums_at + place / 2048u]; }
  let begin = max(rows.x, bin.first_tile / bin.tiles_x);
  let end = min(rows.y, (bin.last_tile - 1u) / bin.tiles_x + 1u);
  for (var y = begin; y < end; y++) {
    var across = columns;
    if (cut) { across = Columns(ellipse, y, columns); }
    let begin_tile = max(y * bin.tiles_x + across.x, bin.first_tile);
    let end_tile = min(y * bin.tiles_x + across.y, bin.last_tile);
    for (var tile = begin_tile; tile < end_tile; tile++) {
      if (bin.step == COUNT_TILES) { atomicAdd(&tile_counts[tile], 1u); }
      if (bin.step == LIST_PAIRS) {
        keys[at] = tile - bin.first_tile;
        pairs[at] = row;
      }
      at++;
    }
  }
  if (bin.step != LIST_PAIRS) { places[place] = at; }
  // At least 1/32 of the tiles in the rectangle but not in the list: a sum that does not overflow.
  if (cut && bin.step == COUNT_TILES) {
    let left_out = (columns.y - columns.x) * (rows.y - rows.x) - at;
    atomicAdd(&tile_counts[bin.tiles], (left_out + 31u) / 32u);
  }
}
