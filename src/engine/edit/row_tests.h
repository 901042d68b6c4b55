#pragma once

#include <cstdint>
#include <optional>

#include "core/result.h"
#include "core/similarity.h"
#include "core/world_origin.h"
#include "edit/action.h"
#include "edit/moved_rows.h"
#include "edit/row_source.h"

namespace anchorsplat {

// The per-row test of a removing action, applicable to rows whose world has since moved.
class RowTest {
 public:
  // Makes the test. Unset if the action removes no rows, or judges more than one at a time. `world`: from the rows'
  // world to the action's. `extras`: the splat's properties. kBadArgument: the splat lacks the property.
  static Result<std::optional<RowTest>> Of(const EditAction& action, const Similarity& world, const WorldOrigin& origin,
                                           int sh_degree, const ExtraProperties& extras);

  bool Keeps(const RowBlock& block, int64_t i) const;

 private:
  RowTest() = default;
  double ValueOf(const RowBlock& block, int64_t i) const;

  decltype(EditAction::what) what_;
  Similarity world_;  // for KeepByValue, to its axes
  WorldOrigin origin_ = {0, 0, 0};
  int sh_degree_ = 0;
  // KeepByValue: the column to compare.
  enum class Column { kPosition, kScale, kOpacity, kColor, kRotation, kHarmonic, kExtra } column_ = Column::kPosition;
  int64_t component_ = 0;  // index in the column's row; for kExtra in bytes
  PlyType type_ = PlyType::kFloat;
  std::optional<RowMover> mover_;  // for kRotation and kHarmonic, if they rotate
};

}  // namespace anchorsplat
