#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// What a merge may cost where nobody says otherwise: pixels of the closer view times the square of a colour in 0–1, of
// MergeCost(). Chosen on training objects (docs/results/copies.md).
inline constexpr double kMergeCost = 2e-5;

// How many of a network's copies live.
struct CopyChoice {
  std::optional<int64_t> copies =
      std::nullopt;                // at most so many of each Gaussian; nothing: as many as cost more than `merge_cost`
  double merge_cost = kMergeCost;  // ≥ 0
  int64_t max_gaussians = 0;       // in all; 0: no bound
  float invisible = 0;             // copies of less opacity go first, and 1/255 at least
};

// Copies of `count` Gaussians: copy k of the g-th is row k·count + g. Rows behind them stand alone.
struct CopyGroups {
  int64_t count = 0;
  int64_t copies = 1;                  // 1–64
  std::span<const float> pixel_sizes;  // of the closer view, world units, one for all or one per group
  std::span<const char> single = {};   // not 0: all its copies are merged into one; one per group, empty: none
};

struct ChosenCopies {
  int64_t merged = 0;    // copies that are gone: others stand for them, or they were invisible
  int64_t left_out = 0;  // Gaussians that are gone, as there are more than max_gaussians without copies
};

// Merges copies of one Gaussian, always the pair that can be spared best (model/compact/merge_gaussians.h): until the
// next pair would cost too much or there are no more than `copies`; then the cheapest of all until there are no more
// than max_gaussians. At least one of each Gaussian stays, unless there are too many even so: then those of the largest
// opacity × size do. Rows keep their order. The same bits for any number of threads.
//
// Errors (kBadArgument): more `copies` than there are, or less than one; a cost or a bound that is negative.
Result<ChosenCopies> ChooseCopies(const CopyGroups& groups, const CopyChoice& choice, GaussianCloud& cloud);

}  // namespace anchorsplat
