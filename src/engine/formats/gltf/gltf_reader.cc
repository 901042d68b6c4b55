#include "formats/gltf/gltf_reader.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "core/sh_rotation.h"
#include "core/text.h"
#include "formats/axes.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_primitives.h"
#include "formats/gltf/gltf_values.h"
#include "formats/json_asset.h"
#include "formats/linear_color.h"
#include "formats/record_blocks.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;

// Reads all values of an accessor to out[i·width + k].
Status ReadValues(const Accessor& accessor, float* out, int64_t width) {
  const auto unpack = [&](int64_t first, int64_t last, const uint8_t* bytes) {
    UnpackGltfValues(accessor, bytes, last - first, out + first * width, width);
  };
  // The last record may be shorter than the stride.
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadRecords(*accessor.file, accessor.begin, accessor.count - 1, static_cast<size_t>(accessor.stride), unpack));
  uint8_t bytes[16];
  const int64_t last = accessor.count - 1;
  ANCHORSPLAT_RETURN_IF_ERROR(
      accessor.file->ReadAt(accessor.begin + accessor.stride * static_cast<uint64_t>(last), bytes,
                            GltfComponentBytes(accessor) * static_cast<size_t>(accessor.components)));
  unpack(last, accessor.count, bytes);
  return {};
}

Status ReadPrimitive(const GltfPrimitive& primitive, int64_t begin, GaussianCloud& cloud) {
  const GltfColumns columns = {cloud.means.data() + 3 * begin, cloud.quats.data() + 4 * begin,
                               cloud.log_scales.data() + 3 * begin, cloud.opacity_logits.data() + begin};
  float* sh = cloud.sh.data() + begin * cloud.sh_stride();
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.means, columns.means, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.quats, columns.quats, 4));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.scales, columns.scales, 3));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.opacities, columns.opacities, 1));
  const int64_t count = primitive.count();
  std::fill_n(sh, count * cloud.sh_stride(), 0.0f);
  for (size_t k = 0; k < primitive.sh.size(); ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadValues(primitive.sh[k], sh + 3 * k, cloud.sh_stride()));
  }
  ParallelFor(0, count, 1 << 14, [&](int64_t first, int64_t last) {
    FinishGltfRows(
        primitive, last - first,
        {columns.means + 3 * first, columns.quats + 4 * first, columns.scales + 3 * first, columns.opacities + first});
  });
  if (primitive.degree > 0 && primitive.place.turns()) {
    const ShRotation harmonics(primitive.place.turn);
    ParallelFor(0, count, 1 << 13, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) harmonics.Apply(sh + i * cloud.sh_stride(), primitive.degree);
    });
  }
  if (primitive.linear) SrgbFromLinear(cloud, begin, count);
  return {};
}

// "turned, mirrored, 2 times as large, moved"; "as it is".
std::string InWords(const GltfPlace& place) {
  std::string text;
  const auto add = [&text](const std::string& what) { text += Cat(text.empty() ? "" : ", ", what); };
  if (place.turns()) add(place.mirrors() ? "mirrored" : "turned");
  if (place.scale != 1) add(Cat(place.scale, " times as large"));
  if (place.translation != GltfPlace{}.translation) add("moved");
  return text.empty() ? "as it is" : text;
}

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
      add_text("sorting", extension, "sortingMethod");
      const std::optional<JsonValue> attributes = first.Find("attributes");
      const bool points = attributes && attributes->has("COLOR_0");
      facts.Add("colours for point viewers", points ? "yes (COLOR_0)" : "no");
    }
    splats += static_cast<int64_t>(mesh->splats.size());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GltfSplats read, FindGltfSplats(file, document, {}));
  const auto any = [&read](bool GltfPrimitive::*what) {
    return std::ranges::any_of(read.primitives, [what](const GltfPrimitive& one) { return one.*what; });
  };
  facts.Add("scales", any(&GltfPrimitive::logarithms) ? "logarithms, contrary to the extension" : "lengths");
  facts.Add("opacities", any(&GltfPrimitive::logits) ? "logits, contrary to the extension" : "0 to 1");
  facts.Add("placed", InWords(read.primitives.front().place),
            read.primitives.size() > 1 ? " (the first primitive)" : "");
  facts.Add("primitives", splats, " of Gaussians", others > 0 ? Cat(", ", others, " others ignored") : "");
  return facts;
}

uint64_t GltfSize(const InputFile& file) {
  const Result<GltfDocument> document = GltfDocument::Open(file);
  return document.ok() ? document->bytes() : file.size();
}

Result<GaussianCloud> ReadGltf(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GltfDocument document, GltfDocument::Open(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GltfSplats splats, FindGltfSplats(file, document, limits));
  for (const std::string& warning : splats.warnings) LogWarning(warning);
  GaussianCloud cloud;
  cloud.Resize(splats.count, splats.degree);
  int64_t begin = 0;
  for (const GltfPrimitive& primitive : splats.primitives) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadPrimitive(primitive, begin, cloud));
    begin += primitive.count();
  }
  cloud.origin = splats.origin;
  TurnAxes(cloud, TurnBetween(kLuf, kRdf));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud.comments, CommentsOfAsset(document.root()));
  return cloud;
}

}  // namespace anchorsplat
