#include "formats/gltf/gltf_primitives.h"

#include <algorithm>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/gltf/gltf_values.h"
#include "io/compression_ratio.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;
constexpr size_t kMaxPrimitives = 1024;  // a node costs a hostile file some bytes, and us a thousand times as many

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

Result<GltfPrimitive> OpenPrimitive(const GltfDocument& document, const JsonValue& value, const JsonValue& extension) {
  if (const std::optional<JsonValue> kernel = extension.Find("kernel")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, kernel->Text());
    if (name != "ellipse") return kernel->Complain(Cat("is \"", Printable(name), "\", expected \"ellipse\""));
  }
  const std::optional<JsonValue> inner = extension.Find("extensions");
  if (inner && inner->raw().is_object() && !inner->raw().empty()) {
    return inner->Complain(Cat("uses ", Printable(inner->raw().begin().key()), ", which is not read"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue attributes, value.Get("attributes"));
  const auto name = [](const char* what) { return Cat(kGltfSplatting, ":", what); };
  GltfPrimitive primitive;
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.means, Attribute(document, attributes, "POSITION", 3, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.quats, Attribute(document, attributes, name("ROTATION"), 4, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.scales, Attribute(document, attributes, name("SCALE"), 3, true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(primitive.opacities, Attribute(document, attributes, name("OPACITY"), 1, true));
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

Result<GltfSplats> FindGltfSplats(const InputFile& file, const GltfDocument& document, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<GltfDocument::Placed> meshes, document.PlacedMeshes());
  MeshSplats splats_of(document);
  GltfSplats splats;
  for (const GltfDocument::Placed& placed : meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MeshSplats::Mesh* mesh, splats_of.Find(placed.mesh));
    for (const JsonValue& value : mesh->splats) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(GltfPrimitive primitive, OpenPrimitive(document, value, *SplatExtension(value)));
      primitive.scale = placed.scale;
      primitive.translation = placed.translation;
      splats.count += primitive.count();
      splats.degree = std::max(splats.degree, primitive.degree);
      // Many nodes may show one mesh, so the sum can be far more than the file holds: checked as it grows.
      ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), static_cast<uint64_t>(splats.count), limits));
      splats.primitives.push_back(std::move(primitive));
      if (splats.primitives.size() > kMaxPrimitives) {
        return placed.mesh.Complain(Cat("shows one of more than ", kMaxPrimitives, " primitives of splats"));
      }
    }
  }
  if (splats.primitives.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": is a glTF file without splats: no node shows a primitive with ", kGltfSplatting)};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRatio(file.name(), document.bytes(), static_cast<uint64_t>(splats.count) * 4));
  return splats;
}

}  // namespace anchorsplat
