#include "upscale/enlarge_picture.h"

#include <algorithm>
#include <utility>

#include "core/text.h"
#include "metrics/bicubic.h"

namespace anchorsplat {

namespace {

constexpr int kMostFactor = 16;

Result<Image> EnlargeTimes(Upscaler& upscaler, Image image, int times) {
  for (int k = 0; k < times; ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(image, upscaler.Enlarge(image));
    for (float& value : image.pixels) value = std::clamp(value, 0.0f, 1.0f);
  }
  return image;
}

// The enlarged alpha, one channel.
Result<Image> EnlargeAlpha(Upscaler& upscaler, const Image& image, int times, const EnlargeOptions& options,
                           int factor) {
  const float* alpha = image.channel(3);
  const int64_t pixels = image.plane();
  if (std::all_of(alpha, alpha + pixels, [](float a) { return a >= 1; })) {
    Image solid(image.width * factor, image.height * factor, 1);
    std::fill(solid.pixels.begin(), solid.pixels.end(), 1.0f);
    return solid;
  }
  if (options.alpha == AlphaEnlargement::kBicubic) {
    Image one(image.width, image.height, 1);
    std::copy_n(alpha, pixels, one.channel(0));
    ANCHORSPLAT_ASSIGN_OR_RETURN(Image out, EnlargeBicubic(one, image.width * factor, image.height * factor));
    for (float& value : out.pixels) value = std::clamp(value, 0.0f, 1.0f);
    return out;
  }
  Image grey(image.width, image.height, 3);
  for (int c = 0; c < 3; ++c) std::copy_n(alpha, pixels, grey.channel(c));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image enlarged, EnlargeTimes(upscaler, std::move(grey), times));
  Image out(enlarged.width, enlarged.height, 1);
  for (int64_t i = 0; i < out.plane(); ++i) {
    out.pixels[static_cast<size_t>(i)] =
        (enlarged.channel(0)[i] + enlarged.channel(1)[i] + enlarged.channel(2)[i]) / 3.0f;
  }
  return out;
}

}  // namespace

Result<int> TimesOf(int factor, int scale) {
  if (factor == 0) return 1;
  int times = 0;
  int64_t reached = 1;
  while (reached < factor) {
    reached *= scale;
    ++times;
  }
  if (reached == factor && factor > 1 && factor <= kMostFactor) return times;
  std::string known;
  for (int64_t power = scale; power <= kMostFactor; power *= scale) known += Cat(known.empty() ? "" : ", ", power);
  return Error{ErrorCode::kBadArgument,
               Cat("a network that enlarges ", scale, " times cannot enlarge ", factor, " times; possible: ", known)};
}

Result<Image> EnlargePicture(Upscaler& upscaler, const Image& image, const EnlargeOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int times, TimesOf(options.factor, upscaler.info().scale));
  const int factor = options.factor == 0 ? upscaler.info().scale : options.factor;
  const int64_t width = int64_t{image.width} * factor, height = int64_t{image.height} * factor;
  if (width > kMaxImageSide || height > kMaxImageSide || width * height > kMaxImagePixels) {
    return Error{ErrorCode::kBadArgument, Cat("a picture of ", width, " x ", height, " pixels is too large")};
  }
  if (image.channels != 4) return EnlargeTimes(upscaler, image, times);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image alpha, EnlargeAlpha(upscaler, image, times, options, factor));
  Image over(image.width, image.height, 3);
  for (int c = 0; c < 3; ++c) {
    const float behind = options.background[static_cast<size_t>(c)];
    for (int64_t i = 0; i < image.plane(); ++i) {
      over.channel(c)[i] = behind + (image.channel(c)[i] - behind) * image.channel(3)[i];
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image colors, EnlargeTimes(upscaler, std::move(over), times));
  Image out(colors.width, colors.height, 4);
  std::copy_n(alpha.channel(0), out.plane(), out.channel(3));
  for (int c = 0; c < 3; ++c) {
    const float behind = options.background[static_cast<size_t>(c)];
    for (int64_t i = 0; i < out.plane(); ++i) {
      const float a = alpha.pixels[static_cast<size_t>(i)];
      out.channel(c)[i] = a > 0 ? std::clamp(behind + (colors.channel(c)[i] - behind) / a, 0.0f, 1.0f) : 0.0f;
    }
  }
  return out;
}

}  // namespace anchorsplat
