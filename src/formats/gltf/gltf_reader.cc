#include "formats/gltf/gltf_reader.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/axes.h"
#include "formats/cloud_checks.h"
#include "formats/gltf/gltf_document.h"
#include "formats/json_asset.h"
#include "formats/record_blocks.h"
#include "io/compression_ratio.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;
constexpr const char* kExtension = "KHR_gaussian_splatting";
constexpr size_t kMaxPrimitives = 1024;  // a node costs a hostile file some bytes, and us a thousand times as many
constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kFloat = 5126;

template <typename T>
float Integer(const uint8_t* bytes, bool normalized, float largest) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return normalized ? std::max(-1.0f, static_cast<float>(value) / largest) : static_cast<float>(value);
}

float Component(const Accessor& accessor, const uint8_t* bytes) {
  switch (accessor.component_type) {
    case kByte:
      return Integer<int8_t>(bytes, accessor.normalized, 127);
    case kUnsignedByte:
      return Integer<uint8_t>(bytes, accessor.normalized, 255);
    case kShort:
      return Integer<int16_t>(bytes, accessor.normalized, 32767);
    case kUnsignedShort:
      return Integer<uint16_t>(bytes, accessor.normalized, 65535);
    default: {
      float value;
      std::memcpy(&value, bytes, sizeof value);
      return value;
    }
  }
}

size_t ComponentBytes(const Accessor& accessor) {
  return accessor.component_type <= kUnsignedByte ? 1 : accessor.component_type <= kUnsignedShort ? 2 : 4;
}

// A primitive of splats, its accessors checked against each other.
struct Primitive {
  Accessor means, quats, scales, opacities;
  std::vector<Accessor> sh;  // by coefficient
  int degree = 0;
  double scale = 1;
  std::array<double, 3> translation = {0, 0, 0};
};

Result<Accessor> Attribute(const GltfDocument& document, const JsonValue& attributes, const std::string& name,
                           int components, bool may_be_integer) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue index, attributes.Get(name.c_str()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Accessor accessor, document.FindAccessor(index));
  const bool type_fits = accessor.component_type == kFloat || (may_be_integer && accessor.component_type >= kByte &&
                                                               accessor.component_type <= kUnsignedShort);
  if (accessor.components != components || !type_fits) {
    return index.Complain(Cat("refers to an accessor that is not of ", components, " ",
                              may_be_integer ? "floats or small integers" : "floats"));
  }
  return accessor;
}

Result<Primitive> OpenPrimitive(const GltfDocument& document, const JsonValue& value, const JsonValue& extension) {
  if (const std::optional<JsonValue> kernel = extension.Find("kernel")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, kernel->Text());
    if (name != "ellipse") return kernel->Complain(Cat("is \"", Printable(name), "\", expected \"ellipse\""));
  }
  const std::optional<JsonValue> inner = extension.Find("extensions");
  if (inner && inner->raw().is_object() && !inner->raw().empty()) {
    return inner->Complain(Cat("uses ", Printable(inner->raw().begin().key()), ", which is not read"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue attributes, value.Get("attributes"));
  const auto name = [](const char* what) { return Cat(kExtension, ":", what); };
  Primitive primitive;
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

// All values of an accessor to out[i·width + k]. The last record may be shorter than the stride.
Status ReadValues(const Accessor& accessor, float* out, int64_t width) {
  const size_t component = ComponentBytes(accessor);
  const auto unpack = [&](int64_t first, int64_t last, const uint8_t* bytes) {
    for (int64_t i = first; i < last; ++i, bytes += accessor.stride) {
      for (int k = 0; k < accessor.components; ++k) {
        out[i * width + k] = Component(accessor, bytes + static_cast<size_t>(k) * component);
      }
    }
  };
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadRecords(*accessor.file, accessor.begin, accessor.count - 1, static_cast<size_t>(accessor.stride), unpack));
  uint8_t bytes[16];
  const int64_t last = accessor.count - 1;
  ANCHORSPLAT_RETURN_IF_ERROR(accessor.file->ReadAt(accessor.begin + accessor.stride * static_cast<uint64_t>(last),
                                                    bytes, component * static_cast<size_t>(accessor.components)));
  unpack(last, accessor.count, bytes);
  return {};
}

Status ReadPrimitive(const Primitive& primitive, int64_t begin, GaussianCloud& cloud) {
  float* means = cloud.means.data() + 3 * begin;
  float* quats = cloud.quats.data() + 4 * begin;
  float* scales = cloud.log_scales.data() + 3 * begin;
  float* logits = cloud.opacity_logits.data() + begin;
  float* sh = cloud.sh.data() + begin * cloud.sh_stride();
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.means, means, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.quats, quats, 4));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.scales, scales, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.opacities, logits, 1));
  std::fill_n(sh, primitive.means.count * cloud.sh_stride(), 0.0f);
  for (size_t k = 0; k < primitive.sh.size(); ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.sh[k], sh + 3 * k, cloud.sh_stride()));
  }
  const int64_t count = primitive.means.count;
  std::atomic<bool> logarithms = false;
  ParallelFor(0, 3 * count, 1 << 16, [&](int64_t first, int64_t last) {
    if (std::any_of(scales + first, scales + last, [](float x) { return x < 0; })) logarithms = true;
  });
  const bool are_logarithms = logarithms;
  const auto log_of_scale = static_cast<float>(std::log(primitive.scale));
  ParallelFor(0, count, 1 << 14, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      float* q = quats + 4 * i;
      std::rotate(q, q + 3, q + 4);  // xyzw to wxyz
      logits[i] = LogitFromOpacity(logits[i]);
      for (int64_t k = 0; k < 3; ++k) {
        float& scale = scales[3 * i + k];
        scale = (are_logarithms ? scale : LogFromScale(scale)) + log_of_scale;
        float& mean = means[3 * i + k];
        mean = static_cast<float>(primitive.scale * double{mean} + primitive.translation[static_cast<size_t>(k)]);
      }
    }
  });
  return {};
}

// What makes a primitive a splat.
std::optional<JsonValue> SplatExtension(const JsonValue& primitive) {
  const std::optional<JsonValue> extensions = primitive.Find("extensions");
  return extensions ? extensions->Find(kExtension) : std::nullopt;
}

// The primitives of meshes. Each mesh is looked through once: a hostile file shows one with a hundred thousand
// primitives by as many nodes.
class MeshSplats {
 public:
  struct Mesh {
    std::vector<JsonValue> splats;
    int64_t others = 0;  // primitives that are none
  };
  explicit MeshSplats(const GltfDocument& document) : document_(&document) {}

  // Valid as long as this lives.
  Result<const Mesh*> Find(const JsonValue& index) {
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

 private:
  const GltfDocument* document_;
  std::map<const nlohmann::json*, Mesh> meshes_;
};

}  // namespace

Result<FormatFacts> DescribeGltf(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GltfDocument document, GltfDocument::Open(file));
  FormatFacts facts;
  const auto add_text = [&facts](const char* name, const JsonValue& object, const char* key) {
    const std::optional<JsonValue> value = object.Find(key);
    if (value && value->raw().is_string()) facts.Add(name, Printable(value->raw().get<std::string>()));
  };
  if (const std::optional<JsonValue> asset = document.root().Find("asset")) add_text("made by", *asset, "generator");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<GltfDocument::Placed> meshes, document.PlacedMeshes());
  MeshSplats splats_of(document);
  int64_t splats = 0, others = 0;
  for (const GltfDocument::Placed& placed : meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MeshSplats::Mesh* mesh, splats_of.Find(placed.mesh));
    others += mesh->others;
    if (splats == 0 && !mesh->splats.empty()) {
      const JsonValue& first = mesh->splats.front();
      const JsonValue extension = *SplatExtension(first);
      add_text("kernel", extension, "kernel");
      add_text("colour space", extension, "colorSpace");
      add_text("projection", extension, "projection");
      const std::optional<JsonValue> attributes = first.Find("attributes");
      const bool points = attributes && attributes->has("COLOR_0");
      facts.Add("colours for point viewers", points ? "yes (COLOR_0)" : "no");
    }
    splats += static_cast<int64_t>(mesh->splats.size());
  }
  facts.Add("primitives", splats, " of Gaussians", others > 0 ? Cat(", ", others, " others that are not read") : "");
  return facts;
}

uint64_t GltfSize(const InputFile& file) {
  const Result<GltfDocument> document = GltfDocument::Open(file);
  return document.ok() ? document->bytes() : file.size();
}

Result<GaussianCloud> ReadGltf(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GltfDocument document, GltfDocument::Open(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<GltfDocument::Placed> meshes, document.PlacedMeshes());
  MeshSplats splats_of(document);
  std::vector<Primitive> primitives;
  int64_t count = 0;
  int degree = 0;
  for (const GltfDocument::Placed& placed : meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MeshSplats::Mesh* mesh, splats_of.Find(placed.mesh));
    for (const JsonValue& value : mesh->splats) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(Primitive primitive, OpenPrimitive(document, value, *SplatExtension(value)));
      primitive.scale = placed.scale;
      primitive.translation = placed.translation;
      count += primitive.means.count;
      degree = std::max(degree, primitive.degree);
      // Many nodes may show one mesh, so the sum can be far more than the file holds: checked as it grows.
      ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), static_cast<uint64_t>(count), limits));
      primitives.push_back(std::move(primitive));
      if (primitives.size() > kMaxPrimitives) {
        return placed.mesh.Complain(Cat("shows one of more than ", kMaxPrimitives, " primitives of splats"));
      }
    }
  }
  if (primitives.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": is a glTF file without splats: no node shows a primitive with ", kExtension)};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRatio(file.name(), document.bytes(), static_cast<uint64_t>(count) * 4));
  GaussianCloud cloud;
  cloud.Resize(count, degree);
  int64_t begin = 0;
  for (const Primitive& primitive : primitives) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadPrimitive(primitive, begin, cloud));
    begin += primitive.means.count;
  }
  FlipAxes(cloud, FlipBetween(kLuf, kRdf));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud.comments, CommentsOfAsset(document.root()));
  return cloud;
}

}  // namespace anchorsplat
