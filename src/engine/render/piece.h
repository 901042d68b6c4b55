#pragma once

#include <algorithm>
#include <cstdint>

namespace anchorsplat {

// Piece k of `pieces` nearly equal ones of [0, count): [first, last), possibly empty.
struct Piece {
  int64_t first, last;
};
inline Piece PieceOf(int64_t count, int64_t pieces, int64_t k) {
  const int64_t size = (count + pieces - 1) / pieces;
  return {std::min(count, k * size), std::min(count, (k + 1) * size)};
}

// Tiles per blending task. Costs vary greatly, so tasks are small; but a nearly empty tile is not worth a task.
inline int64_t TilesPerTask(int64_t tiles, int64_t pairs) {
  constexpr int64_t kAtMost = 4, kPairsEnough = 1000;
  return std::clamp<int64_t>(kPairsEnough * tiles / std::max<int64_t>(1, pairs), 1, kAtMost);
}

}  // namespace anchorsplat
