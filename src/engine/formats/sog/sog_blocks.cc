#include "formats/sog/sog_blocks.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "formats/file_blocks.h"
#include "formats/sog/sog_pictures.h"

namespace anchorsplat {

namespace {

// Packs three bytes of each pixel.
Buffer<uint8_t> Rgb(const ByteImage& picture, int64_t count) {
  Buffer<uint8_t> out(static_cast<size_t>(3 * count));
  ParallelFor(0, count, 1 << 16, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      for (int64_t k = 0; k < 3; ++k)
        out[static_cast<size_t>(3 * i + k)] = picture.rgba[static_cast<size_t>(4 * i + k)];
    }
  });
  return out;
}

class SogBlocks final : public FileBlocks, public SogVisitor {
 public:
  void Begin(int64_t count, int sh_degree) override {
    size_ = count;
    sh_degree_ = sh_degree;
  }
  void Quats(ByteImage picture) override { quats_ = std::move(picture.rgba); }
  void Means(SogMeanRange range, ByteImage low, ByteImage high) override {
    mean_range_ = std::move(range);
    means_low_ = Rgb(low, size_);
    low = {};
    means_high_ = Rgb(high, size_);
  }
  void Scales(std::vector<SogChannel> channels, ByteImage picture) override {
    scale_channels_ = std::move(channels);
    scales_ = Rgb(picture, size_);
  }
  void Colors(std::vector<SogChannel> channels, ByteImage picture) override {
    color_channels_ = std::move(channels);
    colors_ = std::move(picture.rgba);
  }
  // Table entries are always finite.
  void Harmonics(const SogChannel&, const ByteImage&, const SogPalette&) override {}
  void End(std::optional<RenderMode> mode, std::vector<std::string> comments) override {
    render_mode_ = mode;
    origin_ = TakeOrigin(comments);
    comments_ = std::move(comments);
  }

 private:
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t>) override {
    GaussianCloud& rows = scratch.rows;
    const int64_t count = last - first;
    UnpackSogQuats(quats_.data() + 4 * first, count, rows.quats.data());
    UnpackSogMeans(mean_range_, means_low_.data() + 3 * first, means_high_.data() + 3 * first, 3, count,
                   rows.means.data());
    UnpackSogScales(scale_channels_, scales_.data() + 3 * first, 3, count, rows.log_scales.data());
    UnpackSogColors(color_channels_, colors_.data() + 4 * first, count, rows.sh.data(), 3, rows.opacity_logits.data());
    return {};
  }

  SogMeanRange mean_range_;
  std::vector<SogChannel> scale_channels_, color_channels_;
  Buffer<uint8_t> quats_, colors_;                   // [N,4], and padding of their images
  Buffer<uint8_t> means_low_, means_high_, scales_;  // [N,3]
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfSog(const InputFile& file, const ReadLimits& limits) {
  auto blocks = std::make_unique<SogBlocks>();
  ANCHORSPLAT_RETURN_IF_ERROR(VisitSog(file, limits, *blocks));
  return std::unique_ptr<CloudBlocks>(std::move(blocks));
}

}  // namespace anchorsplat
