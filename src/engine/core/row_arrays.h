#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include "core/buffer.h"

namespace anchorsplat {

// Operations on arrays of rows with `width` values each.

// Keeps rows with keep[i] set, in order.
template <typename T>
void KeepRows(Buffer<T>& array, int64_t width, const std::vector<char>& keep) {
  T* to = array.data();
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    const T* from = array.data() + static_cast<int64_t>(i) * width;
    if (to != from) std::memmove(to, from, static_cast<size_t>(width) * sizeof(T));
    to += width;
  }
  array.resize(static_cast<size_t>(to - array.data()));
}

// Moves old row rows[i] to row i for a permutation `rows`, along its cycles, without a second copy of the array.
template <typename T>
void ReorderRows(Buffer<T>& array, int64_t width, const Buffer<uint32_t>& rows) {
  const size_t bytes = static_cast<size_t>(width) * sizeof(T);
  if (bytes == 0) return;
  const auto row = [&](uint32_t i) { return array.data() + int64_t{i} * width; };
  std::vector<char> done(rows.size(), 0);
  Buffer<T> held(static_cast<size_t>(width));
  for (uint32_t start = 0; start < rows.size(); ++start) {
    if (done[start] != 0 || rows[start] == start) continue;
    std::memcpy(held.data(), row(start), bytes);
    uint32_t at = start;
    while (rows[at] != start) {
      std::memcpy(row(at), row(rows[at]), bytes);
      done[at] = 1;
      at = rows[at];
    }
    std::memcpy(row(at), held.data(), bytes);
    done[at] = 1;
  }
}

}  // namespace anchorsplat
