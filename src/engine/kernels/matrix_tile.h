#pragma once

#include <algorithm>
#include <cstdint>

#include "kernels/packed_weights.h"

namespace anchorsplat {

// A tile of a matrix product whose sums stay in registers:
// out[r] = (bias or 0) + (added[r] or 0) + Σ_k input[r·stride + k] · weights[k]. T is float, or a pair of consecutive
// bfloat16 whose product is the sum of both products.
template <typename T>
struct Tile {
  int64_t depth;              // K
  const T* input;             // rows of K elements
  int64_t stride;             // elements between rows of `input`
  const T* weights;           // panels [K][kPanel]
  int64_t panel_stride;       // elements between panels
  const float* bias;          // [columns], whole panels, or null
  const float* const* added;  // [rows] addends of each row, or null
  float* const* out;          // [rows] sums of each row
};

// Maximum rows of a tile.
inline constexpr int64_t kMostTileRows = 14;

// Computes a tile whose width is no whole number of panels, panel by panel with `multiply_panel(rows, tile)`. Does not
// write beyond the last column.
template <typename T, typename MultiplyPanel>
void MultiplyPartialPanels(int64_t rows, int64_t columns, const Tile<T>& t, MultiplyPanel&& multiply_panel) {
  constexpr int64_t kPanel = PackedWeights::kPanel;
  float* out[kMostTileRows];
  const float* added[kMostTileRows];
  alignas(64) float apart[kMostTileRows][kPanel];
  for (int64_t first = 0; first < columns; first += kPanel) {
    const int64_t width = std::min(kPanel, columns - first);
    for (int64_t r = 0; r < rows; ++r) {
      out[r] = width == kPanel ? t.out[r] + first : apart[r];
      if (t.added == nullptr) continue;
      added[r] = t.added[r] + first;
      if (width == kPanel) continue;
      std::fill(std::copy_n(added[r], width, apart[r]), apart[r] + kPanel, 0.0f);
      added[r] = apart[r];
    }
    Tile<T> panel = t;
    panel.weights += first / kPanel * t.panel_stride;
    if (t.bias != nullptr) panel.bias += first;
    if (t.added != nullptr) panel.added = added;
    panel.out = out;
    multiply_panel(rows, panel);
    if (width == kPanel) continue;
    for (int64_t r = 0; r < rows; ++r) std::copy_n(apart[r], width, t.out[r] + first);
  }
}

}  // namespace anchorsplat
