#include "formats/ply/ply_layout.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <string_view>
#include <unordered_map>

#include "core/log.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/number_or_nan.h"

namespace anchorsplat {

namespace {

struct Required {
  std::string_view name;
  Buffer<float> GaussianCloud::*array;
  int width;
  int component;
};
// Width 0 means the row of `sh`, which depends on the degree.
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
constexpr std::array<std::string_view, 3> kColors = {"red", "green", "blue"};
constexpr const char* kNeeded = "(needed: x y z f_dc_0..2 opacity scale_0..2 rot_0..3)";
constexpr std::array<std::string_view, 3> kDc = {"f_dc_0", "f_dc_1", "f_dc_2"};
constexpr std::string_view kRest = "f_rest_";
constexpr int kMostDegree = 4;  // in files

std::string Where(const InputFile& file, int line) { return Cat(file.name(), ": line ", line, ": "); }

Status CheckFloating(const InputFile& file, const PlyProperty& property) {
  if (property.list_count) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name,
                                          "\" is a list (expected float or double)")};
  }
  if (!IsFloating(property.type)) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name, "\" has type ",
                                          PlyTypeName(property.type), " (expected float or double)")};
  }
  return {};
}

// Properties by INRIA's names.
using Properties = std::unordered_map<std::string_view, size_t>;

// CloudCompare knows positions and colours; it prefixes all other names, again on every save.
std::string_view WithoutPrefix(std::string_view name) {
  for (bool any = true; any;) {
    any = false;
    for (const std::string_view prefix : {std::string_view("scalar_"), std::string_view("scal_")}) {
      if (!name.starts_with(prefix)) continue;
      name.remove_prefix(prefix.size());
      any = true;
    }
  }
  return name;
}

bool IsOfGaussians(std::string_view name) {
  return name.starts_with(kRest) || name == kFilter3d ||
         std::any_of(kRequired.begin() + 3, kRequired.end(), [name](const Required& r) { return r.name == name; });
}

// The name to look up a property by.
std::string_view KnownName(const PlyProperty& property) {
  const std::string_view inner = WithoutPrefix(property.name);
  return IsOfGaussians(inner) ? inner : std::string_view(property.name);
}

Result<Properties> FindProperties(const InputFile& file, const PlyElement& vertex) {
  Properties found;
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    const auto [other, fresh] = found.emplace(KnownName(property), p);
    if (fresh) continue;
    return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name, "\" and \"",
                                          vertex.properties[other->second].name, "\" both map to \"", other->first,
                                          "\": remove one of them")};
  }
  return found;
}

// Describes a vertex element without Gaussians.
Error NotASplat(const InputFile& file, const PlyHeader& header) {
  const PlyElement* face = header.Find("face");
  std::string names;
  for (const PlyProperty& property : header.Find("vertex")->properties) names += " " + property.name;
  return {ErrorCode::kBadFile,
          Cat(file.name(), ": is a PLY ", face != nullptr && face->count > 0 ? "mesh" : "point cloud",
              " without Gaussians: element \"vertex\" has no f_dc_*, opacity, scale_* or rot_* ", kNeeded,
              names.empty() ? "" : Cat("; it has", Printable(names, 200)))};
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

// SH degree from the number of f_rest properties, and their targets.
Status PlanRest(const InputFile& file, const PlyElement& vertex, PlyLayout& layout) {
  struct Rest {
    size_t property;
    int index;
  };
  std::vector<Rest> rest;
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    const std::string_view name = KnownName(property);
    if (!name.starts_with(kRest)) continue;
    const char* const begin = name.data() + kRest.size();
    const char* const end = name.data() + name.size();
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
  while (degree < kMostDegree && 3 * (ShCoefficients(degree) - 1) != count) ++degree;
  const int per_channel = ShCoefficients(degree) - 1;
  if (3 * per_channel != count) {
    return Error{ErrorCode::kBadFile, Cat(Where(file, vertex.line), "element \"vertex\" has ", count,
                                          " f_rest properties (expected 0, 9, 24 or 45, for SH degree 0 to 3, or 72)")};
  }
  layout.sh_degree = std::min(degree, kMaxShDegree);
  for (const Rest& r : rest) {
    // Names are unique, so `count` numbers below `count` are complete.
    if (r.index >= count) {
      const PlyProperty& property = vertex.properties[r.property];
      return Error{ErrorCode::kBadFile, Cat(Where(file, property.line), "property \"", property.name, "\" of ", count,
                                            " (expected f_rest_0 to f_rest_", count - 1, " without gaps)")};
    }
    const int channel = r.index / per_channel, coefficient = 1 + r.index % per_channel;
    if (coefficient >= ShCoefficients(layout.sh_degree)) {
      layout.dropped[r.property] = true;
    } else {
      layout.targets[r.property] =
          PlyTarget{&GaussianCloud::sh, 3 * ShCoefficients(layout.sh_degree), 3 * coefficient + channel};
    }
  }
  return {};
}

// Detects variants of other programs, and adds their names as substitutes for INRIA's.
void PlanDialect(const PlyElement& vertex, Properties& by_name, PlyLayout& layout) {
  const auto type_of = [&](std::string_view name) -> std::optional<PlyType> {
    const auto found = by_name.find(name);
    if (found == by_name.end() || vertex.properties[found->second].list_count) return std::nullopt;
    return vertex.properties[found->second].type;
  };
  for (const auto& [name, p] : by_name) layout.prefixed |= name.size() < vertex.properties[p].name.size();
  layout.surfels = type_of("scale_0") && type_of("scale_1") && !by_name.contains("scale_2");
  const bool has_shape = type_of("scale_0") && type_of("rot_0");
  const bool no_dc = std::ranges::none_of(kDc, [&](std::string_view name) { return by_name.contains(name); });
  const std::optional<PlyType> red = type_of("red");
  const bool has_colors =
      std::ranges::all_of(kColors, [&](std::string_view name) { return red && type_of(name) == red; });
  if (has_shape && no_dc && layout.sh_degree == 0 && has_colors) {
    layout.full_color = FullIntensity(*red);
    layout.float_color = IsFloating(*red);
    for (size_t k = 0; k < kDc.size(); ++k) by_name.emplace(kDc[k], by_name.at(kColors[k]));
  }
  const std::optional<PlyType> alpha = type_of("alpha");
  // Floats may be logits.
  const bool is_whole = alpha && !IsFloating(*alpha);
  if (has_shape && is_whole && !by_name.contains("opacity")) {
    layout.full_alpha = FullIntensity(*alpha);
    by_name.emplace("opacity", by_name.at("alpha"));
  }
}

// Whether it may be stored as integers.
bool MayBeWhole(const PlyLayout& layout, std::string_view name) {
  return (layout.full_color > 0 && name.starts_with("f_dc_")) || (layout.full_alpha > 0 && name == "opacity");
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
  ANCHORSPLAT_ASSIGN_OR_RETURN(Properties by_name, FindProperties(file, vertex));

  layout.targets.resize(vertex.properties.size());
  layout.dropped.resize(vertex.properties.size());
  ANCHORSPLAT_RETURN_IF_ERROR(PlanRest(file, vertex, layout));
  const bool any = layout.sh_degree > 0 || std::any_of(kRequired.begin() + 3, kRequired.end(),
                                                       [&](const Required& r) { return by_name.contains(r.name); });
  if (!any) return NotASplat(file, header);
  PlanDialect(vertex, by_name, layout);
  for (const Required& r : kRequired) {
    if (layout.surfels && r.name == "scale_2") continue;
    const auto found = by_name.find(r.name);
    if (found == by_name.end()) {
      return Error{ErrorCode::kBadFile, Cat(byte, "element \"vertex\" has no property \"", r.name, "\" ", kNeeded)};
    }
    if (!MayBeWhole(layout, r.name)) {
      ANCHORSPLAT_RETURN_IF_ERROR(CheckFloating(file, vertex.properties[found->second]));
    }
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

void FinishPlyRows(const PlyLayout& layout, GaussianCloud& rows) {
  if (layout.stored_as_read() && !layout.surfels) return;
  const int64_t stride = rows.sh_stride();
  for (int64_t i = 0; i < rows.size(); ++i) {
    if (layout.surfels) rows.log_scales[static_cast<size_t>(3 * i + 2)] = -std::numeric_limits<float>::infinity();
    float* const dc = rows.sh.data() + i * stride;
    for (int k = 0; layout.full_color > 0 && k < 3; ++k) dc[k] = DcFromColor(dc[k] / layout.full_color);
    float& opacity = rows.opacity_logits[static_cast<size_t>(i)];
    if (layout.full_alpha > 0) opacity = LogitFromStoredOpacity(opacity / layout.full_alpha);
  }
}

void WarnOfPlyDegree(const InputFile& file, const PlyLayout& layout) {
  if (layout.has_degree_4()) LogWarning(Cat(file.name(), ": SH degree 4 is read as 3"));
}

ExtraProperties PlanExtras(const PlyHeader& header, const PlyLayout& layout) {
  ExtraProperties extras;
  const PlyElement& vertex = *layout.vertex;
  for (size_t p = 0; p < vertex.properties.size(); ++p) {
    const PlyProperty& property = vertex.properties[p];
    if (layout.targets[p] || layout.filter == p || layout.dropped[p] || NormalAxis(property) >= 0) continue;
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
  if (HasNormals(vertex)) extras.normals.assign(3 * rows, 0.0f);  // an axis may be absent
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
    } else if (extras == nullptr || property.list_count || layout.dropped[p]) {
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
