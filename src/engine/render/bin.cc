#include "render/bin.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "render/constants.h"
#include "render/piece.h"

namespace anchorsplat {

namespace {

// Smaller rectangles are listed whole: blending skips a tile outside the ellipse faster than it is found here. Larger
// ones, which are few, are cut so that a long needle is not listed for the whole image.
constexpr int kWorthCutting = 64;  // tiles

// Columns [x0, x1) of a row of tiles that intersect the ellipse α = min_alpha.
class EllipseRows {
 public:
  EllipseRows(const ProjectedGaussian& g, double log2_min_alpha)
      : x_(g.x), y_(g.y), reach2_(std::max(0.0, g.log2_opacity - log2_min_alpha)), u_yy_(g.u_yy) {
    // α ≥ min_alpha where u² + v² ≤ reach², so at height dy:  dx ∈ shear·dy ± half·sqrt(reach² − v²).
    half_ = 1.0 / g.u_xx;
    shear_ = -double{g.u_xy} * half_;
    height_ = std::sqrt(reach2_) / u_yy_;
    // Height of the rightmost point; the leftmost one is opposite.
    const double slope = half_ * u_yy_;
    const double length = std::hypot(shear_, slope);
    rightmost_ = length > 0 ? height_ * shear_ / length : 0;
  }

  std::pair<int, int> Columns(int tile_y, int x0, int x1) const {
    // Pixel centres of the row, with a margin for blending's float arithmetic.
    const double margin = 0.01 + 1e-6 * (std::abs(x_) + std::abs(y_));
    const double top = std::max(tile_y * kTile + 0.5 - margin - y_, -height_);
    const double bottom = std::min(tile_y * kTile + kTile - 0.5 + margin - y_, height_);
    if (!(top <= bottom)) return {x0, x0};
    const double right = Edge(std::clamp(rightmost_, top, bottom), 1);
    const double left = Edge(std::clamp(-rightmost_, top, bottom), -1);
    const double first = std::floor((left - margin - 0.5) / kTile);
    const double last = std::floor((right + margin - 0.5) / kTile);
    // Written so that NaN keeps the whole row.
    const int begin = first > x0 ? static_cast<int>(std::min<double>(first, x1)) : x0;
    const int end = last < x1 - 1 ? static_cast<int>(std::max<double>(last + 1, begin)) : x1;
    return {begin, end};
  }

 private:
  double Edge(double dy, double side) const {
    const double v = u_yy_ * dy;
    return x_ + shear_ * dy + side * half_ * std::sqrt(std::max(0.0, reach2_ - v * v));
  }

  double x_, y_, reach2_, u_yy_, half_, shear_, height_, rightmost_;
};

// Calls row(tile_y, x0, x1) for each row of tiles of the k-th Gaussian within tile rows [first_row, last_row).
template <typename Row>
void VisitRows(const BinParams& p, double log2_min_alpha, int64_t k, int first_row, int last_row, Row&& row) {
  const TileRect rect = p.tiles_by_depth[k];
  const int begin = std::max<int>(rect.y0, first_row), end = std::min<int>(rect.y1, last_row);
  if ((rect.x1 - rect.x0) * (rect.y1 - rect.y0) <= kWorthCutting) {
    for (int y = begin; y < end; ++y) row(y, rect.x0, rect.x1);
    return;
  }
  const EllipseRows ellipse(p.projected[p.order[k]], log2_min_alpha);
  for (int y = begin; y < end; ++y) {
    const auto [x0, x1] = ellipse.Columns(y, rect.x0, rect.x1);
    row(y, x0, x1);
  }
}

// In views of a whole splat, most Gaussians cover at most 2 × 2 tiles. They take one branch-free path, as branches
// would be mispredicted: the four tiles of a square, of which duplicates of the first do not count.
struct UpToFour {
  explicit UpToFour(const TileRect& rect) : two_x(rect.x1 - rect.x0 - 1u), two_y(rect.y1 - rect.y0 - 1u) {}
  bool fits() const { return (two_x | two_y) <= 1; }
  uint32_t two_x, two_y;  // 1 if there is a second column (row)
};

}  // namespace

void CountPairs(const BinParams& p) {
  const int64_t tiles = int64_t{p.tiles_x} * p.tiles_y;
  const double log2_min_alpha = std::log2(double{p.min_alpha});
  ParallelFor(0, p.chunks, 1, [&](int64_t c, int64_t) {
    uint32_t* counts = p.chunk_counts + c * tiles;
    std::fill_n(counts, tiles, 0u);
    const auto [first, last] = PieceOf(p.count, p.chunks, c);
    // Fetched in a separate loop, so that many cache misses overlap.
    for (int64_t k = first; k < last; ++k) p.tiles_by_depth[k] = p.tiles[p.order[k]];
    for (int64_t k = first; k < last; ++k) {
      const TileRect rect = p.tiles_by_depth[k];
      if (const UpToFour four(rect); four.fits()) {
        uint32_t* corner = counts + int64_t{rect.y0} * p.tiles_x + rect.x0;
        const int64_t below = four.two_y * p.tiles_x;
        corner[0] += 1;
        corner[four.two_x] += four.two_x;
        corner[below] += four.two_y;
        corner[below + four.two_x] += four.two_x & four.two_y;
        continue;
      }
      VisitRows(p, log2_min_alpha, k, 0, p.tiles_y, [&](int y, int x0, int x1) {
        uint32_t* row = counts + int64_t{y} * p.tiles_x;
        for (int x = x0; x < x1; ++x) ++row[x];
      });
    }
  });
  // Tile offsets; counts become each chunk's position within its tile (earlier chunks are nearer). Single-threaded, so
  // it iterates along chunks.
  std::fill_n(p.tile_offsets, tiles + 1, int64_t{0});
  for (int64_t c = 0; c < p.chunks; ++c) {
    uint32_t* counts = p.chunk_counts + c * tiles;
    for (int64_t t = 0; t < tiles; ++t) {
      const uint32_t own = counts[t];
      counts[t] = static_cast<uint32_t>(p.tile_offsets[t]);
      p.tile_offsets[t] += own;
    }
  }
  std::exclusive_scan(p.tile_offsets, p.tile_offsets + tiles + 1, p.tile_offsets, int64_t{0});
}

void ListPairs(const BinParams& p, int64_t first_tile, int64_t last_tile, int32_t* pairs) {
  const int64_t tiles = int64_t{p.tiles_x} * p.tiles_y;
  const double log2_min_alpha = std::log2(double{p.min_alpha});
  const int64_t base = p.tile_offsets[first_tile];
  const int first_row = static_cast<int>(first_tile / p.tiles_x);
  const int last_row = static_cast<int>((last_tile - 1) / p.tiles_x) + 1;
  ParallelFor(0, p.chunks, 1, [&](int64_t c, int64_t) {
    uint32_t* next = p.chunk_counts + c * tiles;  // within the tile; from here on within the run
    for (int64_t t = first_tile; t < last_tile; ++t) next[t] += static_cast<uint32_t>(p.tile_offsets[t] - base);
    const auto [first, last] = PieceOf(p.count, p.chunks, c);
    const bool all_tiles = first_tile == 0 && last_tile == tiles;
    // Dummy destination of tiles that do not count.
    uint32_t spare = static_cast<uint32_t>(p.tile_offsets[last_tile] - base + c);
    for (int64_t k = first; k < last; ++k) {
      const int32_t i = p.order[k];
      const TileRect rect = p.tiles_by_depth[k];
      if (const UpToFour four(rect); all_tiles && four.fits()) {
        uint32_t* corner = next + int64_t{rect.y0} * p.tiles_x + rect.x0;
        const int64_t below = four.two_y * p.tiles_x;
        const uint32_t both = four.two_x & four.two_y;
        const auto put = [&](uint32_t* place, uint32_t counts) {
          place = counts != 0 ? place : &spare;
          pairs[*place] = i;
          *place += counts;
        };
        pairs[(*corner)++] = i;
        put(corner + four.two_x, four.two_x);
        put(corner + below, four.two_y);
        put(corner + below + four.two_x, both);
        continue;
      }
      VisitRows(p, log2_min_alpha, k, first_row, last_row, [&](int y, int x0, int x1) {
        const int64_t row = int64_t{y} * p.tiles_x;
        const int64_t begin = std::max(row + x0, first_tile), end = std::min(row + x1, last_tile);
        for (int64_t t = begin; t < end; ++t) pairs[next[t]++] = i;
      });
    }
  });
}

int64_t EndOfRun(const BinParams& p, int64_t first_tile, int64_t max_pairs) {
  const int64_t tiles = int64_t{p.tiles_x} * p.tiles_y;
  const int64_t limit = p.tile_offsets[first_tile] + max_pairs;
  const int64_t* end = std::upper_bound(p.tile_offsets + first_tile, p.tile_offsets + tiles + 1, limit);
  return std::clamp<int64_t>(end - p.tile_offsets - 1, first_tile + 1, tiles);
}

}  // namespace anchorsplat
