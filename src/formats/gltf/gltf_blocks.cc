#include "formats/gltf/gltf_blocks.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "formats/axes.h"
#include "formats/file_blocks.h"
#include "formats/first_failure.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_primitives.h"
#include "formats/gltf/gltf_values.h"
#include "formats/json_asset.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;

// Records [first, last); the last of an accessor may be shorter than the stride, which is below 256.
Status ReadBytes(const Accessor& accessor, int64_t first, int64_t last, Buffer<uint8_t>& bytes) {
  const size_t record = GltfComponentBytes(accessor) * static_cast<size_t>(accessor.components);
  bytes.resize(static_cast<size_t>(last - first - 1) * static_cast<size_t>(accessor.stride) + record);
  return accessor.file->ReadAt(accessor.begin + static_cast<uint64_t>(first) * accessor.stride, bytes.data(),
                               bytes.size());
}

class GltfBlocks final : public FileBlocks {
 public:
  GltfBlocks(GltfDocument document, GltfSplats splats, std::vector<std::string> comments)
      : document_(std::move(document)), primitives_(std::move(splats.primitives)) {
    size_ = splats.count;
    sh_degree_ = splats.degree;
    comments_ = std::move(comments);
    int64_t begin = 0;
    for (const GltfPrimitive& primitive : primitives_) {
      begins_.push_back(begin);
      begin += primitive.count();
    }
  }

  Status ForEach(const Look& look) override {
    if (first_time()) {
      logarithms_.clear();
      for (const GltfPrimitive& primitive : primitives_) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const bool some, HasNegativeScales(primitive));
        logarithms_.push_back(some ? 1 : 0);
      }
    }
    return FileBlocks::ForEach(look);
  }

 private:
  static Result<bool> HasNegativeScales(const GltfPrimitive& primitive) {
    std::atomic<bool> some = false;
    FirstFailure failure;
    ParallelFor(0, primitive.count(), kRowsPerRoom, [&](int64_t first, int64_t last) {
      Buffer<uint8_t> bytes;
      Buffer<float> scales(static_cast<size_t>(3 * kCloudBlockRows));
      for (int64_t i = first; i < last && !some; i += kCloudBlockRows) {
        const int64_t end = std::min(last, i + kCloudBlockRows);
        const Status status = ReadBytes(primitive.scales, i, end, bytes);
        if (!status.ok()) return failure.Report(i, status);
        UnpackGltfValues(primitive.scales, bytes.data(), end - i, scales.data(), 3);
        if (std::any_of(scales.data(), scales.data() + 3 * (end - i), [](float x) { return x < 0; })) some = true;
      }
    });
    ANCHORSPLAT_RETURN_IF_ERROR(failure.status());
    return some.load();
  }

  Status Fill(int64_t first, int64_t last, Room& room, std::span<uint8_t> finite) override {
    for (int64_t i = first; i < last;) {
      const auto p = static_cast<size_t>(std::upper_bound(begins_.begin(), begins_.end(), i) - begins_.begin()) - 1;
      const int64_t end = std::min(last, begins_[p] + primitives_[p].count());
      ANCHORSPLAT_RETURN_IF_ERROR(FillFrom(p, i - begins_[p], end - begins_[p], i - first, room, finite));
      i = end;
    }
    FlipAxes(room.rows, flip_);
    return {};
  }

  // Rows [first, last) of primitive p to row `to` of the room and on.
  Status FillFrom(size_t p, int64_t first, int64_t last, int64_t to, Room& room, std::span<uint8_t> finite) const {
    const GltfPrimitive& primitive = primitives_[p];
    GaussianCloud& rows = room.rows;
    const auto read = [&](const Accessor& accessor, float* out, int64_t width) -> Status {
      ANCHORSPLAT_RETURN_IF_ERROR(ReadBytes(accessor, first, last, room.bytes));
      UnpackGltfValues(accessor, room.bytes.data(), last - first, out, width);
      return {};
    };
    const GltfColumns columns = {rows.means.data() + 3 * to, rows.quats.data() + 4 * to,
                                 rows.log_scales.data() + 3 * to, rows.opacity_logits.data() + to};
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.means, columns.means, 3));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.quats, columns.quats, 4));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.scales, columns.scales, 3));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.opacities, columns.opacities, 1));
    ANCHORSPLAT_RETURN_IF_ERROR(read(primitive.sh[0], rows.sh.data() + 3 * to, 3));
    FinishGltfRows(primitive, logarithms_[p] != 0, last - first, columns);
    for (size_t k = 1; !finite.empty() && k < primitive.sh.size(); ++k) {
      const Accessor& accessor = primitive.sh[k];
      ANCHORSPLAT_RETURN_IF_ERROR(ReadBytes(accessor, first, last, room.bytes));
      const uint8_t* bytes = room.bytes.data();
      for (int64_t i = to; i < to + (last - first); ++i, bytes += accessor.stride) {
        if (HasNotFinite(bytes, 3)) finite[static_cast<size_t>(i)] = 0;
      }
    }
    return {};
  }

  GltfDocument document_;  // has the buffers that accessors speak of
  std::vector<GltfPrimitive> primitives_;
  std::vector<int64_t> begins_;   // the first row of each
  std::vector<char> logarithms_;  // whether its scales are some
  AxisFlip flip_ = FlipBetween(kLuf, kRdf);
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfGltf(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GltfDocument document, GltfDocument::Open(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GltfSplats splats, FindGltfSplats(file, document, limits));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> comments, CommentsOfAsset(document.root()));
  return std::unique_ptr<CloudBlocks>(
      std::make_unique<GltfBlocks>(std::move(document), std::move(splats), std::move(comments)));
}

}  // namespace anchorsplat
