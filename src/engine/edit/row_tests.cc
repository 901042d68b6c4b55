#include "edit/row_tests.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/activations.h"
#include "core/number_text.h"
#include "core/sh_rotation.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

template <typename T>
double LoadAs(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return static_cast<double>(value);
}

double Load(PlyType type, const std::byte* from) {
  switch (type) {
    case PlyType::kInt8:
      return LoadAs<int8_t>(from);
    case PlyType::kUint8:
      return LoadAs<uint8_t>(from);
    case PlyType::kInt16:
      return LoadAs<int16_t>(from);
    case PlyType::kUint16:
      return LoadAs<uint16_t>(from);
    case PlyType::kInt32:
      return LoadAs<int32_t>(from);
    case PlyType::kUint32:
      return LoadAs<uint32_t>(from);
    case PlyType::kFloat:
      return LoadAs<float>(from);
    case PlyType::kDouble:
      return LoadAs<double>(from);
  }
  return 0;
}

bool AllFinite(const float* from, int64_t count) {
  return std::all_of(from, from + count, [](float x) { return std::isfinite(x); });
}

bool HasNumbers(const RowBlock& block, int64_t i, int sh_degree) {
  const CloudView& rows = block.rows;
  const float* quat = rows.quats.data() + 4 * i;
  if (!AllFinite(rows.means.data() + 3 * i, 3) || !AllFinite(quat, 4)) return false;
  if (std::all_of(quat, quat + 4, [](float x) { return x == 0; })) return false;
  const float* scales = rows.log_scales.data() + 3 * i;
  if (std::any_of(scales, scales + 3, [](float x) { return !std::isfinite(x) && x != -INFINITY; })) return false;
  const float logit = rows.opacity_logits[static_cast<size_t>(i)];
  if (!std::isfinite(logit) && logit != INFINITY) return false;
  const int64_t harmonics = 3 * ShCoefficients(std::min(sh_degree, rows.sh_degree));
  if (!AllFinite(rows.sh.data() + i * rows.sh_stride(), harmonics)) return false;
  if (block.extras == nullptr) return true;
  const auto& normals = block.extras->normals;
  if (!normals.empty() && !AllFinite(normals.data() + 3 * (block.extra_first + i), 3)) return false;
  if (block.extras->properties.empty()) return true;
  const std::byte* value =
      block.extras->rows.data() + static_cast<size_t>(block.extra_first + i) * block.extras->row_size();
  for (const ExtraProperties::Property& property : block.extras->properties) {
    if (!std::isfinite(Load(property.type, value))) return false;
    value += PlyTypeSize(property.type);
  }
  return true;
}

bool Holds(ValueComparison comparison, double a, double b) {
  switch (comparison) {
    case ValueComparison::kLess:
      return a < b;
    case ValueComparison::kLessOrEqual:
      return a <= b;
    case ValueComparison::kGreater:
      return a > b;
    case ValueComparison::kGreaterOrEqual:
      return a >= b;
    case ValueComparison::kEqual:
      return a == b;
    case ValueComparison::kNotEqual:
      return a != b;
  }
  return false;
}

// Index after a prefix: 12 for "f_rest_12" with `before` "f_rest_"; unset if not below `count`.
std::optional<int64_t> IndexIn(std::string_view name, std::string_view before, int64_t count) {
  if (!name.starts_with(before)) return std::nullopt;
  name.remove_prefix(before.size());
  int64_t index = 0;
  const auto [end, code] = FromChars(name.data(), name.data() + name.size(), index);
  if (code != std::errc() || end != name.data() + name.size() || index < 0 || index >= count) return std::nullopt;
  return index;
}

}  // namespace

Result<std::optional<RowTest>> RowTest::Of(const EditAction& action, const Similarity& world, const WorldOrigin& origin,
                                           int sh_degree, const ExtraProperties& extras) {
  const auto& what = action.what;
  const auto* const value = std::get_if<KeepByValue>(&what);
  const bool chooses = value != nullptr || std::holds_alternative<KeepBox>(what) ||
                       std::holds_alternative<KeepSphere>(what) || std::holds_alternative<KeepNumbers>(what) ||
                       std::holds_alternative<KeepOpaque>(what);
  if (!chooses) return std::optional<RowTest>();
  RowTest test;
  test.what_ = what;
  test.world_ = world;
  test.origin_ = origin;
  test.sh_degree_ = sh_degree;
  if (value == nullptr) return std::optional(test);
  test.world_ = Compose({.rotation = value->turn}, world);
  const std::string_view name = value->property;
  const int64_t harmonics = 3 * (ShCoefficients(sh_degree) - 1);
  if (name.size() == 1 && std::string_view("xyz").find(name[0]) != std::string_view::npos) {
    test.column_ = Column::kPosition;
    test.component_ = name[0] - 'x';
  } else if (name == "opacity") {
    test.column_ = Column::kOpacity;
  } else if (const auto scale = IndexIn(name, "scale_", 3)) {
    test.column_ = Column::kScale;
    test.component_ = *scale;
  } else if (const auto color = IndexIn(name, "f_dc_", 3)) {
    test.column_ = Column::kColor;
    test.component_ = *color;
  } else if (const auto rotation = IndexIn(name, "rot_", 4)) {
    test.column_ = Column::kRotation;
    test.component_ = *rotation;
  } else if (const auto harmonic = IndexIn(name, "f_rest_", harmonics)) {
    test.column_ = Column::kHarmonic;  // channel-major in a file
    const int64_t each = harmonics / 3;
    test.component_ = 3 * (1 + *harmonic % each) + *harmonic / each;
  } else {
    test.column_ = Column::kExtra;
    const auto found = std::ranges::find(extras.properties, value->property, &ExtraProperties::Property::name);
    if (found == extras.properties.end()) {
      return Error{ErrorCode::kBadArgument, Cat("there is no property '", Printable(value->property), "'")};
    }
    test.type_ = found->type;
    for (auto p = extras.properties.begin(); p != found; ++p) test.component_ += PlyTypeSize(p->type);
  }
  if (test.column_ == Column::kRotation || test.column_ == Column::kHarmonic) {
    const RowMover mover(test.world_, {}, {}, sh_degree);
    if (mover.turns()) test.mover_ = mover;
  }
  return std::optional(test);
}

double RowTest::ValueOf(const RowBlock& block, int64_t i) const {
  const CloudView& rows = block.rows;
  switch (column_) {
    case Column::kPosition:
      return world_.Apply(ToWorld(rows.means.data() + 3 * i, origin_))[static_cast<size_t>(component_)];
    case Column::kScale:
      return double{rows.log_scales[static_cast<size_t>(3 * i + component_)]} + std::log(world_.scale);
    case Column::kOpacity:
      return rows.opacity_logits[static_cast<size_t>(i)];
    case Column::kColor:
      return rows.sh[static_cast<size_t>(i * rows.sh_stride() + component_)];
    case Column::kExtra:
      return Load(type_, block.extras->rows.data() +
                             static_cast<size_t>(block.extra_first + i) * block.extras->row_size() + component_);
    case Column::kRotation: {
      std::array<float, 4> quat;
      std::copy_n(rows.quats.data() + 4 * i, 4, quat.data());
      if (mover_) mover_->TurnQuaternion(quat.data());
      return quat[static_cast<size_t>(component_)];
    }
    case Column::kHarmonic:
      break;
  }
  std::array<float, 3 * ShCoefficients(kMaxShDegree)> sh;
  std::copy_n(rows.sh.data() + i * rows.sh_stride(), rows.sh_stride(), sh.data());
  if (mover_) mover_->TurnHarmonics(sh.data(), rows.sh_degree);
  return sh[static_cast<size_t>(component_)];
}

bool RowTest::Keeps(const RowBlock& block, int64_t i) const {
  if (std::holds_alternative<KeepNumbers>(what_)) return HasNumbers(block, i, sh_degree_);
  if (const auto* const value = std::get_if<KeepByValue>(&what_)) {
    return Holds(value->comparison, ValueOf(block, i), value->value);
  }
  if (const auto* const opaque = std::get_if<KeepOpaque>(&what_)) {
    return IsUsable(block.rows, i) && Sigmoid(block.rows.opacity_logits[static_cast<size_t>(i)]) >= opaque->least;
  }
  const std::array<double, 3> at = world_.Apply(ToWorld(block.rows.means.data() + 3 * i, origin_));
  if (const auto* const box = std::get_if<KeepBox>(&what_)) {
    bool inside = true;
    for (size_t k = 0; k < 3; ++k) inside = inside && at[k] >= box->low[k] && at[k] <= box->high[k];
    return inside != box->outside;
  }
  const auto& sphere = std::get<KeepSphere>(what_);
  const std::array<double, 3> from = Minus(at, sphere.centre);
  return Dot(from, from) < sphere.radius * sphere.radius;
}

}  // namespace anchorsplat
