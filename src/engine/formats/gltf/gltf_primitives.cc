#include "formats/gltf/gltf_primitives.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "core/gaussian_cloud.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/gltf/gltf_meanings.h"
#include "formats/gltf/gltf_values.h"
#include "formats/linear_color.h"
#include "io/compression_ratio.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;
constexpr const char* kScale = "KHR_gaussian_splatting:SCALE";
constexpr const char* kOpacity = "KHR_gaussian_splatting:OPACITY";
// limits amplification: a node is a few bytes in the file and a thousand times that in memory
constexpr size_t kMaxPrimitives = 1024;

Result<Accessor> Attribute(const GltfDocument& document, const JsonValue& attributes, const std::string& name,
                           int components, bool may_be_integer) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue index, attributes.Get(name.c_str()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Accessor accessor, document.FindAccessor(index));
  const bool type_fits =
      accessor.component_type == kGltfFloat ||
      (may_be_integer && accessor.component_type >= kGltfByte && accessor.component_type <= kGltfUnsignedShort);
  if (accessor.components != components || !type_fits) {
    return index.Complain(Cat("refers to an accessor that is not of ", components, " ",
                              may_be_integer ? "floats or small integers" : "floats"));
  }
  return accessor;
}

// Value of an optional text member of the extension, or `otherwise`.
Result<std::string> WordOf(const JsonValue& extension, const char* key, const char* otherwise) {
  const std::optional<JsonValue> value = extension.Find(key);
  return value ? value->Text() : Result<std::string>(otherwise);
}

// Drafts named these two differently.
Result<bool> IsLinear(const JsonValue& extension) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, WordOf(extension, "colorSpace", "srgb_rec709_display"));
  if (name == "srgb_rec709_display" || name == "BT.709-sRGB" || name == "BT.709-srgb") return false;
  if (name == "lin_rec709_display" || name == "BT.709-linear") return true;
  return extension.Find("colorSpace")
      ->Complain(Cat("is \"", Printable(name), "\", expected \"srgb_rec709_display\" or \"lin_rec709_display\""));
}

Result<GltfPrimitive> OpenPrimitive(const GltfDocument& document, const JsonValue& value, const JsonValue& extension) {
  constexpr std::array<std::pair<const char*, const char*>, 2> kOnly = {
      {{"kernel", "ellipse"}, {"projection", "perspective"}}};
  for (const auto& [key, only] : kOnly) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, WordOf(extension, key, only));
    if (name != only) {
      return extension.Find(key)->Complain(Cat("is \"", Printable(name), "\", expected \"", only, "\""));
    }
  }
  if (const std::optional<JsonValue> targets = value.Find("targets")) {
    return targets->Complain("morphs a splat, which is not supported");
  }
  const std::optional<JsonValue> inner = extension.Find("extensions");
  if (inner && inner->raw().is_object() && !inner->raw().empty()) {
    return inner->Complain(Cat("uses ", Printable(inner->raw().begin().key()), ", which is not supported"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue attributes, value.Get("attributes"));
  const auto name = [](const char* what) { return Cat(kGltfSplatting, ":", what); };
  GltfPrimitive primitive;
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.linear, IsLinear(extension));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string sorting, WordOf(extension, "sortingMethod", "cameraDistance"));
  primitive.other_sorting = sorting != "cameraDistance";
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.means, Attribute(document, attributes, "POSITION", 3, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.quats, Attribute(document, attributes, name("ROTATION"), 4, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.scales, Attribute(document, attributes, kScale, 3, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.opacities, Attribute(document, attributes, kOpacity, 1, true));
  if (primitive.opacities.component_type != kGltfFloat && !primitive.opacities.normalized) {
    return attributes.Find(kOpacity)->Complain(
        "refers to integers that are not normalized; expected opacities from 0 to 1");
  }
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    if (degree > 0 && !attributes.has(name(Cat("SH_DEGREE_", degree, "_COEF_0").c_str()).c_str())) break;
    for (int n = 0; n <= 2 * degree; ++n) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(
          const Accessor accessor,
          Attribute(document, attributes, name(Cat("SH_DEGREE_", degree, "_COEF_", n).c_str()), 3, false));
      primitive.sh.push_back(accessor);
    }
    primitive.degree = degree;
  }
  std::vector<const Accessor*> all = {&primitive.quats, &primitive.scales, &primitive.opacities};
  for (const Accessor& accessor : primitive.sh) all.push_back(&accessor);
  for (const Accessor* accessor : all) {
    if (accessor->count != primitive.means.count) {
      return attributes.Complain(Cat("has accessors of ", accessor->count, " and ", primitive.means.count, " values"));
    }
  }
  return primitive;
}

}  // namespace

std::optional<JsonValue> SplatExtension(const JsonValue& primitive) {
  const std::optional<JsonValue> extensions = primitive.Find("extensions");
  return extensions ? extensions->Find(kGltfSplatting) : std::nullopt;
}

Result<const MeshSplats::Mesh*> MeshSplats::Find(const JsonValue& index) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, document_->Element("meshes", index));
  const auto [place, fresh] = meshes_.try_emplace(&value.raw());
  Mesh& mesh = place->second;
  if (!fresh) return &mesh;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, value.Get("primitives"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> primitives, list.Elements());
  for (const JsonValue& primitive : primitives) {
    if (SplatExtension(primitive)) {
      mesh.splats.push_back(primitive);
    } else {
      ++mesh.others;
    }
  }
  return &mesh;
}

namespace {

// Prefixes of extensions that may be required but do not affect splats.
constexpr std::array<std::string_view, 12> kHarmless = {"KHR_gaussian_splatting",
                                                        "KHR_mesh_quantization",
                                                        "KHR_node_visibility",
                                                        "KHR_materials_",
                                                        "KHR_texture_",
                                                        "EXT_texture_",
                                                        "KHR_lights_",
                                                        "EXT_lights_",
                                                        "KHR_xmp",
                                                        "KHR_animation_pointer",
                                                        "KHR_draco_mesh_compression",
                                                        "MSFT_texture_"};

// Unknown required extensions may change anything.
Status CheckRequired(const GltfDocument& document) {
  const std::optional<JsonValue> required = document.root().Find("extensionsRequired");
  if (!required) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> names, required->Elements());
  for (const JsonValue& value : names) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, value.Text());
    const auto begins = [&name](std::string_view known) { return name.starts_with(known); };
    if (std::ranges::none_of(kHarmless, begins)) {
      return value.Complain(Cat("is ", Printable(name), ", which is not supported"));
    }
  }
  return {};
}

// Effects of a node on a splat besides placement.
Status CheckNode(const GltfDocument::Placed& placed) {
  const std::optional<JsonValue> extensions = placed.node.Find("extensions");
  if (!extensions || !extensions->raw().is_object()) return {};
  for (const char* name : {"EXT_mesh_gpu_instancing", "EXT_instance_features"}) {
    if (extensions->has(name)) {
      return extensions->Complain(Cat("uses ", name, " for a splat, which is not supported: replace it with nodes"));
    }
  }
  return {};
}

// An extension with a splat-like name in a file without known splats.
std::string OtherSplatExtension(const GltfDocument& document) {
  for (const char* key : {"extensionsRequired", "extensionsUsed"}) {
    const std::optional<JsonValue> list = document.root().Find(key);
    if (!list || !list->raw().is_array()) continue;
    for (const nlohmann::json& name : list->raw()) {
      if (!name.is_string() || name == kGltfSplatting) continue;
      const auto& text = name.get_ref<const std::string&>();
      if (text.find("splat") != text.npos) return Cat("; it uses ", Printable(text), ", which is not supported");
    }
  }
  return {};
}

// Determines the meaning of the values, and warns about it.
Status FindMeanings(const JsonValue& attributes, const std::string& where, GltfPrimitive& primitive,
                    std::vector<std::string>& warnings) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.logarithms, HoldsLogarithms(*attributes.Find(kScale), primitive.scales));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.logits, HoldsLogits(*attributes.Find(kOpacity), primitive.opacities));
  const auto add = [&](bool is_so, const std::string& text) {
    const std::string warning = Cat(where, ": ", text);
    if (is_so && std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
  };
  add(primitive.logarithms, "SCALE has negative values, so it is read as logarithms instead of lengths");
  add(primitive.logits, "OPACITY has values outside of 0 to 1, so it is read as logits instead of opacities");
  add(primitive.linear, LinearColorInWords(primitive.degree));
  add(primitive.other_sorting, "its sortingMethod is unknown, so Gaussians are drawn from back to front");
  return {};
}

// Distant placements, as in georeferenced scenes, are made relative to that of the primitive with most Gaussians. glTF
// uses metres.
void MoveToOrigin(const InputFile& file, GltfSplats& splats) {
  constexpr double kDetail = 0.25;  // metres; floats suffice for it up to eight kilometres
  const auto largest = std::ranges::max_element(splats.primitives, {}, &GltfPrimitive::count);
  const WorldOrigin place = largest->place.translation;
  if (!IsZero(ChooseOrigin(place, kDetail))) splats.origin = place;
  int64_t far = 0;
  for (GltfPrimitive& primitive : splats.primitives) {
    primitive.place.translation = RelativeToOrigin(primitive.place.translation, splats.origin);
    if (!IsZero(ChooseOrigin(primitive.place.translation, kDetail))) far += primitive.count();
  }
  if (far == 0) return;
  splats.warnings.push_back(Cat(file.name(), ": positions of ", WithThousands(far), " of ", WithThousands(splats.count),
                                " Gaussians are rounded: their nodes lie more than eight kilometres from the others, "
                                "too far for 32-bit floats. Split the file into parts that lie together"));
}

}  // namespace

Result<GltfSplats> FindGltfSplats(const InputFile& file, const GltfDocument& document, const ReadLimits& limits) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRequired(document));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<GltfDocument::Placed> meshes, document.PlacedMeshes());
  MeshSplats splats_of(document);
  GltfSplats splats;
  std::vector<JsonValue> attributes;
  int64_t hidden = 0, animated = 0, skinned = 0;
  for (const GltfDocument::Placed& placed : meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MeshSplats::Mesh* mesh, splats_of.Find(placed.mesh));
    if (mesh->splats.empty()) continue;
    if (!placed.shown) {
      ++hidden;
      continue;
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckNode(placed));
    animated += placed.animated ? 1 : 0;
    skinned += placed.node.has("skin") ? 1 : 0;
    const std::optional<GltfPlace> place = PlaceOf(placed.matrix, placed.translation);
    if (!place) {
      return placed.node.Complain(
          "stretches or shears a splat, directly or through a parent node: Gaussians can only be moved, rotated, "
          "mirrored and scaled uniformly");
    }
    for (const JsonValue& value : mesh->splats) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(GltfPrimitive primitive, OpenPrimitive(document, value, *SplatExtension(value)));
      primitive.place = *place;
      splats.count += primitive.count();
      splats.degree = std::max(splats.degree, primitive.degree);
      // Many nodes may share a mesh, so the total can far exceed the file: check as it grows.
      ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), static_cast<uint64_t>(splats.count), limits));
      splats.primitives.push_back(std::move(primitive));
      attributes.push_back(*value.Find("attributes"));
      if (splats.primitives.size() > kMaxPrimitives) {
        return placed.mesh.Complain(Cat("exceeds the limit of ", kMaxPrimitives, " splat primitives"));
      }
    }
  }
  if (splats.primitives.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": is a glTF file without splats: no node of its scene shows a primitive with ",
                     kGltfSplatting, OtherSplatExtension(document))};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(
      CheckCompressionRatio(file.name(), document.bytes(), static_cast<uint64_t>(splats.count) * 4));
  MoveToOrigin(file, splats);
  for (size_t k = 0; k < splats.primitives.size(); ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(FindMeanings(attributes[k], file.name(), splats.primitives[k], splats.warnings));
  }
  const auto warn = [&](int64_t count, const char* what) {
    if (count > 0) splats.warnings.push_back(Cat(file.name(), ": ", count, count == 1 ? " node" : " nodes", what));
  };
  warn(hidden, " with splats skipped: hidden, or in another scene");
  warn(animated, " with animated splats: animation ignored");
  warn(skinned, " with skinned splats: skin ignored");
  return splats;
}

}  // namespace anchorsplat
