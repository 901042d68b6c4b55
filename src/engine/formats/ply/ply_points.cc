#include "formats/ply/ply_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/text.h"
#include "formats/ply/color_range.h"
#include "formats/ply/ply_body.h"
#include "formats/ply/ply_header.h"

namespace anchorsplat {

Result<PlyPoints> ReadPlyPoints(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(file));
  const PlyElement* vertex = header.Find("vertex");
  const auto index = [&](const char* name) {
    const PlyProperty* property = vertex == nullptr ? nullptr : vertex->Find(name);
    const bool scalar = property != nullptr && !property->list_count;
    return scalar ? property - vertex->properties.data() : ptrdiff_t{-1};
  };
  const std::array<ptrdiff_t, 6> columns = {index("x"),   index("y"),     index("z"),
                                            index("red"), index("green"), index("blue")};
  if (std::any_of(columns.begin(), columns.begin() + 3, [](ptrdiff_t i) { return i < 0; })) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": no points: element \"vertex\" needs the properties x y z (and red green blue)")};
  }
  if (vertex->count > limits.max_gaussians) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": line ", vertex->line, ": has ", WithThousands(vertex->count),
                                          " points, more than the limit of ", WithThousands(limits.max_gaussians))};
  }
  const bool colored = std::all_of(columns.begin(), columns.end(), [](ptrdiff_t i) { return i >= 0; });
  PlyPoints read;
  ANCHORSPLAT_RETURN_IF_ERROR(ReadPlyBody(file, header, *vertex, [&] {
    const auto floats = static_cast<size_t>(3 * vertex->count);
    read.positions.resize(floats);
    read.colors.resize(floats);
    if (!colored) std::fill(read.colors.begin(), read.colors.end(), 0.5f);
    std::vector<PlyDestination> to(vertex->properties.size());
    for (size_t k = 0; k < (colored ? 6u : 3u); ++k) {
      PlyDestination& column = to[static_cast<size_t>(columns[k])];
      column.stride = 3;
      if (k < 3) {
        column.wide = read.positions.data() + k;
      } else {
        column.number = read.colors.data() + (k - 3);
      }
    }
    return to;
  }));
  std::array<float, 3> full = {1, 1, 1};
  for (size_t k = 0; colored && k < 3; ++k) {
    const PlyType type = vertex->properties[static_cast<size_t>(columns[3 + k])].type;
    full[k] = IsFloating(type) ? FullIntensityOf(read.colors) : FullIntensity(type);
  }
  PlyPoints points;
  for (size_t i = 0; i < read.positions.size(); i += 3) {
    const double* p = read.positions.data() + i;
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    for (size_t k = 0; k < 3; ++k) {
      points.positions.push_back(header.origin[k] + p[k]);
      const float color = read.colors[i + k] / full[k];
      points.colors.push_back(color > 0 ? std::min(color, 1.0f) : 0.0f);  // NaN is 0
    }
  }
  return points;
}

}  // namespace anchorsplat
