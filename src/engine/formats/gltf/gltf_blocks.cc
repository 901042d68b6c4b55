#include "formats/gltf/gltf_blocks.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/log.h"
#include "formats/axes.h"
#include "formats/file_blocks.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_primitives.h"
#include "formats/gltf/gltf_values.h"
#include "formats/json_asset.h"
#include "formats/linear_color.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;

class GltfBlocks final : public FileBlocks {
 public:
  GltfBlocks(GltfDocument document, GltfSplats splats, std::vector<std::string> comments)
      : document_(std::move(document)), primitives_(std::move(splats.primitives)) {
    size_ = splats.count;
    sh_degree_ = splats.degree;
    comments_ = std::move(comments);
    const AxisFlip flip = FlipBetween(kLuf, kRdf);
    for (size_t k = 0; k < 3; ++k) origin_[k] = double{flip.mean[k]} * splats.origin[k];
    int64_t begin = 0;
    for (const GltfPrimitive& primitive : primitives_) {
      begins_.push_back(begin);
      begin += primitive.count();
    }
  }

 private:
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t> finite) override {
    for (int64_t i = first; i < last;) {
      const auto p = static_cast<size_t>(std::upper_bound(begins_.begin(), begins_.end(), i) - begins_.begin()) - 1;
      const int64_t end = std::min(last, begins_[p] + primitives_[p].count());
      ANCHORSPLAT_RETURN_IF_ERROR(FillFrom(p, i - begins_[p], end - begins_[p], i - first, scratch, finite));
      i = end;
    }
    TurnAxes(scratch.rows, TurnBetween(kLuf, kRdf));
    return {};
  }

  // Reads rows [first, last) of primitive p into scratch rows from `to` on.
  Status FillFrom(size_t p, int64_t first, int64_t last, int64_t to, Scratch& scratch,
                  std::span<uint8_t> finite) const {
    const GltfPrimitive& primitive = primitives_[p];
    GaussianCloud& rows = scratch.rows;
    const auto read = [&](const Accessor& accessor, float* out, int64_t width) -> Status {
      ANCHORSPLAT_RETURN_IF_ERROR(ReadGltfBytes(accessor, first, last, scratch.bytes));
      UnpackGltfValues(accessor, scratch.bytes.data(), last - first, out, width);
      return {};
    };
    const GltfColumns columns = {rows.means.data() + 3 * to, rows.quats.data() + 4 * to,
                                 rows.log_scales.data() + 3 * to, rows.opacity_logits.data() + to};
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.means, columns.means, 3));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.quats, columns.quats, 4));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.scales, columns.scales, 3));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.opacities, columns.opacities, 1));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.sh[0], rows.sh.data() + 3 * to, 3));
    FinishGltfRows(primitive, last - first, columns);
    if (primitive.linear) SrgbFromLinear(rows, to, last - first);
    for (size_t k = 1; !finite.empty() && k < primitive.sh.size(); ++k) {
      const Accessor& accessor = primitive.sh[k];
      ANCHORSPLAT_RETURN_IF_ERROR(ReadGltfBytes(accessor, first, last, scratch.bytes));
      const uint8_t* bytes = scratch.bytes.data();
      for (int64_t i = to; i < to + (last - first); ++i, bytes += accessor.stride) {
        if (HasNonFinite(bytes, 3)) finite[static_cast<size_t>(i)] = 0;
      }
    }
    return {};
  }

  GltfDocument document_;  // owns the buffers of the accessors
  std::vector<GltfPrimitive> primitives_;
  std::vector<int64_t> begins_;  // the first row of each
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfGltf(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GltfDocument document, GltfDocument::Open(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GltfSplats splats, FindGltfSplats(file, document, limits));
  const bool mixes = std::ranges::any_of(splats.primitives, &GltfPrimitive::mixes_harmonics);
  if (mixes) return std::unique_ptr<CloudBlocks>();  // must be read whole
  for (const std::string& warning : splats.warnings) LogWarning(warning);
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> comments, CommentsOfAsset(document.root()));
  return std::unique_ptr<CloudBlocks>(
      std::make_unique<GltfBlocks>(std::move(document), std::move(splats), std::move(comments)));
}

}  // namespace anchorsplat
