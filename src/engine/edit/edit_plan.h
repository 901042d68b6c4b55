#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/similarity.h"
#include "core/world_origin.h"
#include "edit/action.h"
#include "edit/row_source.h"

namespace anchorsplat {

// A splat being edited. Its rows are not changed; `world` and `keep` record the edits. So each value is rounded only
// once, however many actions there are.
struct EditedSplat {
  std::string name;  // for reports
  RowSource* rows = nullptr;
  const ExtraProperties* extras = nullptr;  // names and types of the rows' properties; its own rows are not read
  WorldOrigin origin = {0, 0, 0};           // of the rows
  int sh_degree = 0;
  std::vector<std::string> comments = {};

  Similarity world = {};        // from the rows' world to the result's
  std::vector<char> keep = {};  // [N] 1: in the result; empty: all are
  int64_t kept = 0;
  bool has(int64_t i) const { return keep.empty() || keep[static_cast<size_t>(i)] != 0; }
};

// Outcome of an action.
struct EditStep {
  std::string action;     // in words
  std::string input;      // of one input alone; empty: of all
  int64_t taken = 0;      // Gaussians removed
  int64_t left = 0;       // Gaussians of these splats afterwards
  bool chooses = false;   // whether the action removes Gaussians
  std::string axes = {};  // axes of its numbers; empty: not applicable
};

// Applies the actions in order to all splats, as if they were one. Sets `input` in each step. Reads the rows once per
// run of consecutive removing actions, and once more per search for floaters, which needs 50 bytes per Gaussian. `keep`
// needs one.
// Errors: those of reading; kBadArgument: a property that a splat lacks.
Result<std::vector<EditStep>> ApplyActions(std::span<EditedSplat> splats, std::span<const EditAction> actions,
                                           const std::string& input);

// Chooses the origin of the result's means: the rows' own if nothing moved and all agree, else one for which floats are
// precise enough (core/world_origin.h), from some 65,536 rows. Errors: those of reading.
Result<WorldOrigin> ChooseEditedOrigin(std::span<const EditedSplat> splats);

}  // namespace anchorsplat
