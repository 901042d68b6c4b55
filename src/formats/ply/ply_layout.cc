#include "formats/ply/ply_layout.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <unordered_map>

#include "core/text.h"

namespace anchorsplat {

namespace {

struct Required {
  std::string_view name;
  Buffer<float> GaussianCloud::*array;
  int width;
  int component;
};
// Width 0 stands for the row of `sh`, which depends on the degree.
constexpr std::array<Required, 14> kRequired = {{{"x", &GaussianCloud::means, 3, 0},
                                                 {"y", &GaussianCloud::means, 3, 1},
                                                 {"z", &GaussianCloud::means, 3, 2},
                                                 {"f_dc_0", &GaussianCloud::sh, 0, 0},
                                                 {"f_dc_1", &GaussianCloud::sh, 0, 1},
                                                 {"f_dc_2", &GaussianCloud::sh, 0, 2},
                                                 {"opacity", &GaussianCloud::opacity_logits, 1, 0},
                                                 {"scale_0", &GaussianCloud::log_scales, 3, 0},
                                                 {"scale_1", &GaussianCloud::log_scales, 3, 1},
                                                 {"scale_2", &GaussianCloud::log_scales, 3, 2},
                                                 {"rot_0", &GaussianCloud::quats, 4, 0},
                                                 {"rot_1", &GaussianCloud::quats, 4, 1},
                                                 {"rot_2", &GaussianCloud::quats, 4, 2},
                                                 {"rot_3", &GaussianCloud::quats, 4, 3}}};
constexpr const char* kNeeded = "(needed: x y z f_dc_0..2 opacity scale_0..2 rot_0..3)";
constexpr std::string_view kRest = "f_rest_";

std::string Where(const InputFile& file, int line) { return Cat(file.name(), ": line ", line, ": "); }

Status CheckFloating(const InputFile& file, const PlyProperty& property) {
  if (property.list_count) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name,
                                          "\" is a list (expected float or double)")};
  }
  if (property.type != PlyType::kFloat && property.type != PlyType::kDouble) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name, "\" has type ",
                                          PlyTypeName(property.type), " (expected float or double)")};
  }
  return {};
}

// What a vertex element without Gaussians is instead.
Error NotASplat(const InputFile& file, const PlyHeader& header) {
  const PlyElement* face = header.Find("face");
  return {ErrorCode::kBadFile,
          Cat(file.name(), ": is a PLY ", face != nullptr && face->count > 0 ? "mesh" : "point cloud",
              " without Gaussians: element \"vertex\" has no f_dc_*, opacity, scale_* or rot_* ", kNeeded)};
}

// 0, 1, 2 for nx, ny, nz; else −1.
int NormalAxis(const PlyProperty& property) {
  if (property.list_count || property.name.size() != 2 || property.name[0] != 'n') return -1;
  const char axis = property.name[1];
  return axis >= 'x' && axis <= 'z' ? axis - 'x' : -1;
}

bool HasNormals(const PlyElement& vertex) {
  return std::ranges::any_of(vertex.properties, [](const PlyProperty& p) { return NormalAxis(p) >= 0; });
}

// Degree from the number of f_rest properties; their targets.
Result<int> PlanRest(const InputFile& file, const PlyElement& vertex, std::vector<std::optional<PlyTarget>>& targets) {
  struct Rest {
    size_t property;
    int index;
  };
  std::vector<Rest> rest;
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    if (!property.name.starts_with(kRest)) continue;
    const char* const begin = property.name.data() + kRest.size();
    const char* const end = property.name.data() + property.name.size();
    int index = -1;
    const auto [stop, error] = std::from_chars(begin, end, index);
    if (error != std::errc{} || stop != end || index < 0 || Cat(index).size() != static_cast<size_t>(end - begin)) {
      return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", Printable(property.name),
                                            "\" is not f_rest_ and a number")};
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckFloating(file, property));
    rest.push_back({p, index});
  }
  const int count = static_cast<int>(rest.size());
  int degree = 0;
  while (degree < kMaxShDegree && 3 * (ShCoefficients(degree) - 1) != count) ++degree;
  const int per_channel = ShCoefficients(degree) - 1;
  if (3 * per_channel != count) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, vertex.line), "element \"vertex\" has ", count,
                                          " f_rest properties (expected 0, 9, 24 or 45, for SH degree 0 to 3)")};
  }
  for (const Rest& r : rest) {
    // Names differ, so `count` numbers below `count` are all of them.
    if (r.index >= count) {
      const PlyProperty& property = vertex.properties[r.property];
      return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name, "\" of ", count,
                                            " (expected f_rest_0 to f_rest_", count - 1, " without gaps)")};
    }
    const int channel = r.index / per_channel, coefficient = 1 + r.index % per_channel;
    targets[r.property] = PlyTarget{&GaussianCloud::sh, 3 * (per_channel + 1), 3 * coefficient + channel};
  }
  return degree;
}

}  // namespace

Result<PlyLayout> PlanPly(const InputFile& file, const PlyHeader& header) {
  if (const PlyElement* chunk = header.Find("chunk"); chunk != nullptr) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": is a compressed PLY, expected one with plain properties")};
  }
  PlyLayout layout;
  layout.vertex = header.Find("vertex");
  const std::string byte = Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(header.body)), ": ");
  if (layout.vertex == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(byte, "the header has no element \"vertex\"")};
  }
  const PlyElement& vertex = *layout.vertex;
  std::unordered_map<std::string_view, size_t> by_name;
  for (size_t p = 0; p < vertex.properties.size(); ++p) by_name.emplace(vertex.properties[p].name, p);

  layout.targets.resize(vertex.properties.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(layout.sh_degree, PlanRest(file, vertex, layout.targets));
  const bool any = layout.sh_degree > 0 || std::any_of(kRequired.begin() + 3, kRequired.end(),
                                                       [&](const Required& r) { return by_name.contains(r.name); });
  if (!any) return NotASplat(file, header);
  for (const Required& r : kRequired) {
    const auto found = by_name.find(r.name);
    if (found == by_name.end()) {
      return Error{ErrorCode::kBadFile, Cat(byte, "element \"vertex\" has no property \"", r.name, "\" ", kNeeded)};
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckFloating(file, vertex.properties[found->second]));
    const int width = r.width > 0 ? r.width : 3 * ShCoefficients(layout.sh_degree);
    layout.targets[found->second] = PlyTarget{r.array, width, r.component};
  }
  if (const auto found = by_name.find(kFilter3d); found != by_name.end()) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckFloating(file, vertex.properties[found->second]));
    layout.filter = found->second;
  }
  if (vertex.count == 0) {
    return Error{ErrorCode::kBadFile,
                 Cat(Where(file, vertex.line), "the file has no Gaussians (0 rows of \"vertex\")")};
  }
  return layout;
}

bool HasDoubleMeans(const PlyLayout& layout) {
  for (size_t p = 0; p < layout.targets.size(); ++p) {
    const auto& target = layout.targets[p];
    const bool mean = target && target->array == &GaussianCloud::means;
    if (mean && layout.vertex->properties[p].type == PlyType::kDouble) return true;
  }
  return false;
}

ExtraProperties PlanExtras(const PlyHeader& header, const PlyLayout& layout) {
  ExtraProperties extras;
  const PlyElement& vertex = *layout.vertex;
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    if (layout.targets[p] || layout.filter == p || NormalAxis(property) >= 0) continue;
    if (property.list_count) {
      extras.not_kept.push_back(Cat("list \"", Printable(property.name), "\""));
    } else {
      extras.properties.push_back({property.name, property.type});
    }
  }
  for (const PlyElement& element : header.elements) {
    if (&element == &vertex || element.count == 0) continue;
    extras.not_kept.push_back(Cat("element \"", Printable(element.name), "\""));
  }
  const auto rows = static_cast<size_t>(vertex.count);
  extras.rows.resize(rows * extras.row_size());
  if (HasNormals(vertex)) extras.normals.assign(3 * rows, 0.0f);  // an axis may be missing
  return extras;
}

std::vector<PlyDestination> Destinations(const PlyLayout& layout, GaussianCloud& cloud, Buffer<double>& world,
                                         Buffer<float>& filter, ExtraProperties* extras) {
  std::vector<PlyDestination> out(layout.targets.size());
  const PlyElement& vertex = *layout.vertex;
  const auto extra_row = static_cast<int64_t>(extras == nullptr ? 0 : extras->row_size());
  int64_t offset = 0;
  for (size_t p = 0; p < out.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    if (const auto& target = layout.targets[p]; target && target->array == &GaussianCloud::means && !world.empty()) {
      out[p] = {.wide = world.data() + target->component, .stride = 3};
    } else if (target) {
      out[p] = {.number = (cloud.*(target->array)).data() + target->component, .stride = target->width};
    } else if (layout.filter == p) {
      out[p] = {.number = filter.data(), .stride = 1};
    } else if (extras == nullptr || property.list_count) {
      continue;
    } else if (const int axis = NormalAxis(property); axis >= 0) {
      out[p] = {.number = extras->normals.data() + axis, .stride = 3};
    } else {
      out[p] = {.bytes = extras->rows.data() + offset, .stride = extra_row};
      offset += PlyTypeSize(property.type);
    }
  }
  return out;
}

}  // namespace anchorsplat
