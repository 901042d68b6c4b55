#include "formats/extra_properties.h"

#include <array>
#include <numeric>

#include "core/parallel.h"
#include "core/row_arrays.h"
#include "core/text.h"

namespace anchorsplat {

size_t ExtraProperties::row_size() const {
  return std::accumulate(properties.begin(), properties.end(), size_t{0},
                         [](size_t sum, const Property& p) { return sum + static_cast<size_t>(PlyTypeSize(p.type)); });
}

bool ExtraProperties::fits(int64_t gaussians) const {
  const auto n = static_cast<size_t>(gaussians);
  return rows.size() == n * row_size() && (normals.empty() || normals.size() == 3 * n) &&
         (world.empty() || world.size() == 3 * n);
}

std::string ExtraProperties::names() const {
  std::string text;
  for (const Property& p : properties) text += Cat(text.empty() ? "" : ", ", Printable(p.name));
  if (!normals.empty()) text += text.empty() ? "normals" : ", normals";
  return Printable(text, 300);
}

std::string ExtraProperties::lost(bool writer_keeps) const {
  std::string text = writer_keeps ? "" : names();
  for (const std::string& other : not_kept) text += Cat(text.empty() ? "" : ", ", other);
  return Printable(text, 300);
}

void KeepRows(ExtraProperties& extras, const std::vector<char>& keep) {
  if (!extras.properties.empty()) KeepRows(extras.rows, static_cast<int64_t>(extras.row_size()), keep);
  if (!extras.normals.empty()) KeepRows(extras.normals, 3, keep);
  if (!extras.world.empty()) KeepRows(extras.world, 3, keep);
}

void ReorderRows(ExtraProperties& extras, const Buffer<uint32_t>& rows) {
  if (!extras.properties.empty()) ReorderRows(extras.rows, static_cast<int64_t>(extras.row_size()), rows);
  if (!extras.normals.empty()) ReorderRows(extras.normals, 3, rows);
  if (!extras.world.empty()) ReorderRows(extras.world, 3, rows);
}

void TurnAxes(ExtraProperties& extras, const AxisTurn& turn) {
  if (turn.changes_nothing()) return;
  const auto turn_all = [&](auto& vectors) {
    ParallelFor(0, std::ssize(vectors) / 3, 1 << 14, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) {
        auto* const vector = vectors.data() + 3 * i;
        const std::array old = {vector[0], vector[1], vector[2]};
        for (size_t k = 0; k < 3; ++k) vector[k] = turn.sign[k] * old[turn.from[k]];
      }
    });
  };
  turn_all(extras.normals);
  turn_all(extras.world);
}

}  // namespace anchorsplat
