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

// A splat that is to be edited, and what has become of it so far. Nothing of its rows is changed: they are asked where
// they have got to. So each value is rounded once, however many actions there are.
struct EditedSplat {
  std::string name;  // for reports
  RowSource* rows = nullptr;
  const ExtraProperties* extras = nullptr;  // what properties the rows have; its own rows are not looked at
  WorldOrigin origin = {0, 0, 0};           // of the rows
  int sh_degree = 0;
  std::vector<std::string> comments = {};

  Similarity world = {};        // from the world of the rows to that of the result
  std::vector<char> keep = {};  // [N], 1: the row is in the result; empty: all of them are
  int64_t kept = 0;
  bool has(int64_t i) const { return keep.empty() || keep[static_cast<size_t>(i)] != 0; }
};

// What an action did.
struct EditStep {
  std::string action;     // in words
  std::string input;      // of one input alone; empty: of all
  int64_t taken = 0;      // Gaussians that it took away
  int64_t left = 0;       // of these splats, after it
  bool chooses = false;   // it is of the kind that takes away
  std::string axes = {};  // along which its numbers are; empty: they are along none
};

// Applies the actions to all of the splats, as if they were one, in their order; `step.input` becomes `input`. Looks at
// the rows once for each run of actions that take rows away, and once more for each search for floaters, which takes 50
// bytes for each Gaussian meanwhile. `keep` takes a byte.
// Errors: of reading; kBadArgument: a property that a splat has not.
Result<std::vector<EditStep>> ApplyActions(std::span<EditedSplat> splats, std::span<const EditAction> actions,
                                           const std::string& input);

// The origin for the result's means: of the rows where nothing moved and all agree, else one for which floats are fine
// enough (core/world_origin.h), by some 65,536 rows. Errors: of reading.
Result<WorldOrigin> ChooseEditedOrigin(std::span<const EditedSplat> splats);

}  // namespace anchorsplat
