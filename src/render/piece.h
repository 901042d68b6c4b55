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

}  // namespace anchorsplat
