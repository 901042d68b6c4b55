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

// An action that keeps some rows, as it is asked of rows whose world has moved meanwhile.
class RowTest {
 public:
  // Nothing: the action takes no rows away, or looks at more than one at a time. `world`: from the rows' world to the
  // one in which the action is meant; `extras`: the properties that the splat has. kBadArgument: the property to
  // compare is none of it.
  static Result<std::optional<RowTest>> Of(const EditAction& action, const Similarity& world, const WorldOrigin& origin,
                                           int sh_degree, const ExtraProperties& extras);

  bool Keeps(const RowBlock& block, int64_t i) const;

 private:
  RowTest() = default;
  double ValueOf(const RowBlock& block, int64_t i) const;

  decltype(EditAction::what) what_;
  Similarity world_;  // for KeepByValue along its axes
  WorldOrigin origin_ = {0, 0, 0};
  int sh_degree_ = 0;
  // KeepByValue: the column that it is of.
  enum class Column { kPosition, kScale, kOpacity, kColor, kRotation, kHarmonic, kExtra } column_ = Column::kPosition;
  int64_t component_ = 0;  // of the column's row: bytes of kExtra
  PlyType type_ = PlyType::kFloat;
  std::optional<RowMover> mover_;  // of kRotation and kHarmonic, where these turn
};

}  // namespace anchorsplat
