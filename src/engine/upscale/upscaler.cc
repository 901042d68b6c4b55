#include "upscale/upscaler.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "tensors/tensor_file.h"
#include "upscale/layers.h"
#include "upscale/pixel_shuffle.h"

namespace anchorsplat {

namespace {

constexpr int64_t kTileBytes = int64_t{256} << 20;
constexpr int kLeastTile = 32;

// Tile side for which the maps, with overlap, take about kTileBytes.
int TileSide(const UpscaleArchitecture& architecture) {
  const double pixels = static_cast<double>(kTileBytes) / (4.0 * static_cast<double>(architecture.floats_per_pixel()));
  return std::max(kLeastTile, static_cast<int>(std::sqrt(pixels)) - 2 * architecture.radius());
}

// Start of tile k when a side is divided into `count` equal ones.
int TileBegin(int side, int k, int count) { return static_cast<int>(int64_t{side} * k / count); }

bool AllFinite(const Image& image) {
  return std::ranges::all_of(image.pixels, [](float value) { return std::isfinite(value); });
}

Result<UpscalerInfo> ReadInfo(const TensorFile& file) {
  const auto text = [&](const char* key) {
    const auto found = file.metadata().find(key);
    return found != file.metadata().end() ? found->second : std::string();
  };
  const auto bad = [&](const std::string& why) { return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", why)}; };
  const std::string format = text("format");
  if (format != kUpscalerFormat) {
    return bad(Cat("is no upscaler (its metadata has the format \"", Printable(format), "\", not ", kUpscalerFormat,
                   "); scripts/fetch-upscaler.sh makes one"));
  }
  for (const auto& [key, known] : {std::pair{"color_space", "sRGB"}, std::pair{"input_range", "0-1"}}) {
    if (text(key) != known)
      return bad(Cat("has the ", key, " \"", Printable(text(key)), "\"; only ", known, " is known"));
  }
  const std::string scale = text("scale");
  if (scale != "2" && scale != "3" && scale != "4") {
    return bad(Cat("has the scale \"", Printable(scale), "\"; there are 2, 3 and 4"));
  }
  return UpscalerInfo{text("architecture"), scale.front() - '0', text("source"), text("licence")};
}

}  // namespace

Result<std::unique_ptr<UpscaleArchitecture>> MakeArchitecture(std::string_view name, int scale,
                                                              const TensorFile& file) {
  if (name == "span-1") return MakeSpan(scale, file);
  if (name == "upconv_7-1") return MakeUpconv7(scale, file);
  if (name == "srmd-1") return MakeSrmd(scale, file);
  return Error{ErrorCode::kBadFile, Cat(file.name(), ": the architecture \"", Printable(std::string(name)),
                                        "\" is not known; ", kUpscaleArchitectures, " are")};
}

Result<Upscaler> Upscaler::Read(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  Upscaler out;
  out.path_ = file.name();
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.info_, ReadInfo(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto mean, ReadFinite(file, "input.mean", {3}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto scale, ReadFinite(file, "input.scale", {1}));
  std::copy(mean.begin(), mean.end(), out.mean_);
  out.input_scale_ = scale.front();
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.architecture_, MakeArchitecture(out.info_.architecture, out.info_.scale, file));
  return out;
}

void Upscaler::Load(const Image& image, const PixelBox& box) {
  input_.Reshape(box.x1 - box.x0, box.y1 - box.y0, 3);
  ParallelFor(box.y0, box.y1, 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      const int64_t row = std::clamp<int64_t>(y, 0, image.height - 1) * image.width;
      float* out = input_.pixel(0, y - box.y0);
      for (int x = box.x0; x < box.x1; ++x) {
        const int64_t at = row + std::clamp(x, 0, image.width - 1);
        for (int c = 0; c < 3; ++c) *out++ = (image.channel(c)[at] - mean_[c]) * input_scale_;
      }
    }
  });
}

Result<Image> Upscaler::Enlarge(const Image& image, int tile) {
  const int scale = info_.scale;
  if (image.channels != 3 || image.width < 1 || image.height < 1) {
    return Error{ErrorCode::kBadArgument, "only a picture with red, green and blue can be enlarged by a network"};
  }
  const int64_t width = int64_t{image.width} * scale, height = int64_t{image.height} * scale;
  if (width > kMaxImageSide || height > kMaxImageSide || width * height > kMaxImagePixels) {
    return Error{ErrorCode::kBadArgument, Cat("a picture of ", width, " x ", height, " pixels is too large")};
  }
  Image out(static_cast<int>(width), static_cast<int>(height), 3);
  const int side = tile > 0 ? tile : TileSide(*architecture_);
  const int columns = (image.width - 1) / side + 1, rows = (image.height - 1) / side + 1;
  const int radius = architecture_->radius(), beyond = architecture_->continued();
  for (int k = 0; k < rows * columns; ++k) {
    const PixelBox box{TileBegin(image.width, k % columns, columns), TileBegin(image.height, k / columns, rows),
                       TileBegin(image.width, k % columns + 1, columns),
                       TileBegin(image.height, k / columns + 1, rows)};
    const PixelBox heard{std::max(box.x0 - radius, -beyond), std::max(box.y0 - radius, -beyond),
                         std::min(box.x1 + radius, image.width + beyond),
                         std::min(box.y1 + radius, image.height + beyond)};
    Load(image, heard);
    const FeatureMap& enlarged = architecture_->Run(input_, maps_);
    PixelShuffle(enlarged, {box.x0 - heard.x0, box.y0 - heard.y0, box.x1 - heard.x0, box.y1 - heard.y0}, scale,
                 box.x0 * scale, box.y0 * scale, out);
  }
  if (!AllFinite(out)) {
    return Error{ErrorCode::kBadFile, Cat(path_, ": its numbers overflow on this picture")};
  }
  return out;
}

}  // namespace anchorsplat
