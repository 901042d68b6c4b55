#include "enhance/downscale_look.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/framing.h"
#include "enhance/filter.h"

namespace anchorsplat {

namespace {

constexpr int kSides = 2;
constexpr int kCloser = 4;    // the usual zoom
constexpr int kLowSide = 96;  // pixels of the size that is tried
constexpr double kDownscaleFieldOfView = std::numbers::pi / 4, kDownscaleNear = 0.01;
constexpr double kNothing = 1e-5;  // beside a mean of alpha: pictures of nothing have finite logarithms

// [4,H,W]: colours over black and alpha, each pixel the mean of kCloser × kCloser.
Image AveragedDown(const Image& image) {
  Image out(image.width / kCloser, image.height / kCloser, image.channels);
  for (int c = 0; c < out.channels; ++c) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        float sum = 0;
        for (int dy = 0; dy < kCloser; ++dy) {
          for (int dx = 0; dx < kCloser; ++dx) sum += image.at(c, kCloser * y + dy, kCloser * x + dx);
        }
        out.at(c, y, x) = sum / (kCloser * kCloser);
      }
    }
  }
  return out;
}

struct PictureMeans {
  double alpha = 0;                   // of the picture itself
  double of_alpha = 0, of_color = 0;  // of the absolute differences from another
};

PictureMeans Compare(const Image& image, const Image& other) {
  PictureMeans means;
  const int64_t plane = image.plane();
  const auto pixels = static_cast<double>(plane);
  for (int c = 0; c < image.channels; ++c) {
    double sum = 0, differences = 0;
    for (int64_t i = 0; i < plane; ++i) {
      sum += double{image.channel(c)[i]};
      differences += std::abs(double{image.channel(c)[i]} - double{other.channel(c)[i]});
    }
    if (c == 3) {
      means.alpha = sum / pixels;
      means.of_alpha = differences / pixels;
    } else {
      means.of_color += differences / pixels / 3;
    }
  }
  return means;
}

}  // namespace

Result<DownscaleProbe> DownscaleProbe::Make(const TellingGaussians& telling) {
  DownscaleProbe probe;
  probe.cloud_ = telling.cloud;
  probe.log_scales_ = telling.cloud.log_scales;
  const Pinhole intrinsics = PinholeFromFov(kLowSide, kLowSide, kDownscaleFieldOfView);
  probe.distance_ = FramingDistance({telling.framing.target, telling.radius()}, intrinsics);
  ANCHORSPLAT_ASSIGN_OR_RETURN(probe.cameras_,
                               OrbitCameras(kSides, probe.distance_, telling.framing.target, intrinsics));
  return probe;
}

Result<Image> DownscaleProbe::Draw(double pixel, int side, RenderMode mode, const Camera& from) {
  Camera camera = from;
  camera.intrinsics = {.width = side,
                       .height = side,
                       .fx = distance_ / pixel,
                       .fy = distance_ / pixel,
                       .cx = side / 2.0,
                       .cy = side / 2.0};
  RenderOptions options;
  options.mode = mode;
  options.near_plane = static_cast<float>(kDownscaleNear * distance_);
  options.far_plane = static_cast<float>(distance_ / kDownscaleNear);
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud_, camera, options, output_));
  Image image(side, side, 4);
  std::ranges::copy(output_.alpha.pixels, std::ranges::copy(output_.color.pixels, image.pixels.begin()).out);
  return image;
}

Result<DownscaleLook> DownscaleProbe::At(double size, RenderMode mode) {
  Buffer<float> filtered;
  const auto pixel = static_cast<float>(size);
  const auto grown =
      ApplyFilter(cloud_, {&pixel, 1}, {.upscale = kCloser, .strength = DefaultFilterStrength(kCloser, mode)});
  if (!grown.ok()) return grown.error();
  filtered = std::exchange(cloud_.log_scales, log_scales_);
  PictureMeans low, of_filtered, of_splat;
  const auto add = [](const PictureMeans& more, PictureMeans& sum) {
    sum.alpha += more.alpha;
    sum.of_alpha += more.of_alpha;
    sum.of_color += more.of_color;
  };
  for (const Camera& camera : cameras_.cameras) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image at_size, Draw(size, kLowSide, mode, camera));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image closer, Draw(size / kCloser, kLowSide * kCloser, mode, camera));
    cloud_.log_scales.swap(filtered);
    const Result<Image> given_width = Draw(size / kCloser, kLowSide * kCloser, mode, camera);
    cloud_.log_scales.swap(filtered);
    if (!given_width.ok()) return given_width.error();
    add(Compare(at_size, at_size), low);
    add(Compare(AveragedDown(closer), at_size), of_splat);
    add(Compare(AveragedDown(*given_width), at_size), of_filtered);
  }
  const double least = kNothing * kSides;
  const double all = low.alpha + least;
  return DownscaleLook{std::log((of_filtered.alpha + least) / all), of_filtered.of_alpha / all,
                       of_filtered.of_color / all, std::log((of_splat.alpha + least) / all), of_splat.of_alpha / all};
}

}  // namespace anchorsplat
