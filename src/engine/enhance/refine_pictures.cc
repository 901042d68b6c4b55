#include "enhance/refine_pictures.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/log.h"
#include "core/text.h"
#include "enhance/refine_targets.h"
#include "metrics/image_metrics.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {
constexpr int64_t kMostViews = 16;
constexpr double kIdentical = 100;  // dB of identical pictures, for means
// dB by which smaller pictures must match better. Noise in the pictures, reduced by halving, accounts for up to 6; but
// then a standard splat's renders are off by more.
constexpr double kSmallerIsRight = 4;

// dB below the median view's PSNR.
constexpr double kFarBelow = 8;
// dB by which a picture must match better when moved or enlarged.
constexpr double kMisplaced = 2;
constexpr double kZoomPixels = 1.25;  // shift of the border, from the centre

double Capped(const Result<double>& psnr) { return psnr.ok() ? std::min(*psnr, kIdentical) : 0; }

// PSNR of the best single-colour picture.
double PsnrOfPlain(const Image& picture) {
  Image plain(picture.width, picture.height, 3);
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (int64_t i = 0; i < picture.plane(); ++i) sum += picture.channel(c)[i];
    std::fill_n(plain.channel(c), picture.plane(), static_cast<float>(sum / static_cast<double>(picture.plane())));
  }
  return Capped(Psnr(plain, picture));
}

// PSNR of `shown` against `truth` moved by (dx, dy), over pixels with neighbours on all sides.
double PsnrMoved(const Image& shown, const Image& truth, int dx, int dy) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    for (int y = 1; y + 1 < truth.height; ++y) {
      const float* a = shown.channel(c) + int64_t{y} * shown.width;
      const float* b = truth.channel(c) + int64_t{y + dy} * truth.width + dx;
      float row = 0;
      for (int x = 1; x + 1 < truth.width; ++x) row += (a[x] - b[x]) * (a[x] - b[x]);
      sum += static_cast<double>(row);
    }
  }
  const double mean = sum / (3.0 * (truth.width - 2) * (truth.height - 2));
  return mean > 0 ? std::min(kIdentical, -10 * std::log10(mean)) : kIdentical;
}

// Gain in dB of the best shift by a pixel, or change of focal length that moves the borders as far; at least 0.
Result<double> GainElsewhere(ConstantCloud& cloud, Rasterizer& rasterizer, const RenderOptions& render,
                             const Camera& camera, const Image& shown, const Image& truth) {
  if (std::min(truth.width, truth.height) < kLeastSide) return 0.0;
  const double own = PsnrMoved(shown, truth, 0, 0);
  double best = own;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) best = std::max(best, PsnrMoved(shown, truth, dx, dy));
  }
  RenderOutput output;
  const double zoom = 2 * kZoomPixels / std::max(truth.width, truth.height);
  for (const double factor : {1 - zoom, 1 + zoom}) {
    Camera zoomed = camera;
    zoomed.intrinsics.fx *= factor;
    zoomed.intrinsics.fy *= factor;
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, zoomed, render, output));
    Clamp01(output.color);
    best = std::max(best, PsnrMoved(output.color, truth, 0, 0));
  }
  return best - own;
}

// Means of 2 × 2 blocks; drops an odd last column or row.
Image Halved(const Image& image) {
  Image half(image.width / 2, image.height / 2, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < half.height; ++y) {
      const float* above = image.channel(c) + int64_t{2} * y * image.width;
      const float* below = above + image.width;
      float* out = half.channel(c) + int64_t{y} * half.width;
      for (int x = 0; x < half.width; ++x) {
        out[x] = 0.25f * (above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1]);
      }
    }
  }
  return half;
}

Camera Halved(const Camera& camera) {
  const Pinhole& k = camera.intrinsics;
  Camera half = Crop(camera, {0, 0, k.width / 2 * 2, k.height / 2 * 2});
  half.intrinsics = Scaled(half.intrinsics, 0.5);
  return half;
}

// Sets `smaller_psnr` and `smaller`. Reduces `cameras` and `pictures` in place.
Status MeasureSmaller(ConstantCloud& cloud, const RenderOptions& render, std::vector<Camera>& cameras,
                      std::vector<Image>& pictures, PictureAgreement& agreement) {
  Rasterizer rasterizer;
  for (int part = 2;; part *= 2) {
    double psnr = 0;
    for (size_t i = 0; i < pictures.size(); ++i) {
      if (std::min(pictures[i].width, pictures[i].height) < 2 * kLeastSide) return {};
      pictures[i] = Halved(pictures[i]);
      cameras[i] = Halved(cameras[i]);
    }
    const auto add = [&](size_t i, RenderOutput& output) -> Status {
      Clamp01(output.color);
      psnr += Capped(Psnr(output.color, pictures[i])) / static_cast<double>(pictures.size());
      return {};
    };
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(cloud, cameras, render, add));
    if (agreement.smaller > 1 && psnr <= agreement.smaller_psnr) continue;
    agreement.smaller = part;
    agreement.smaller_psnr = psnr;
  }
}

}  // namespace

Result<PictureAgreement> MeasureAgreement(const GaussianCloud& cloud, const RenderOptions& render,
                                          PictureCache& pictures) {
  const auto count = static_cast<int64_t>(pictures.views().size());
  PictureAgreement agreement;
  agreement.views = std::min(count, kMostViews);
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  RenderOutput output;
  std::vector<Image> shown, truth;
  std::vector<Camera> cameras;
  std::vector<std::string> masked;
  Image picture;
  Buffer<uint8_t> ignored;
  const int64_t looked_at = agreement.views;
  for (int64_t i = 0; i < looked_at; ++i) {
    const int64_t view = i * count / looked_at;
    const Camera& camera = pictures.views()[static_cast<size_t>(view)];
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, picture, ignored));
    if (!ignored.empty() && std::ranges::find(ignored, 0) == ignored.end()) {
      masked.push_back(camera.name);
      continue;
    }
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(still, camera, render, output));
    Clamp01(output.color);
    cameras.push_back(camera);
    shown.push_back(output.color);
    truth.push_back(picture);
    FillIgnored(ignored, shown.back(), truth.back());
  }
  agreement.views = std::ssize(shown);
  if (agreement.views == 0) return agreement;
  if (!masked.empty()) LogWarning(Cat("--images: ", WhollyMasked(masked, looked_at)));
  std::vector<double> each;
  for (size_t i = 0; i < shown.size(); ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double own, Psnr(shown[i], truth[i]));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double gain,
                                 GainElsewhere(still, rasterizer, render, cameras[i], shown[i], truth[i]));
    each.push_back(std::min(own, kIdentical));
    if (gain >= kMisplaced) {
      ++agreement.misplaced;
      agreement.misplaced_gain += gain;
    }
    agreement.psnr += std::min(own, kIdentical) / static_cast<double>(agreement.views);
    agreement.plain += PsnrOfPlain(truth[i]) >= own;
    const bool mismatched = std::any_of(truth.begin(), truth.end(), [&](const Image& other) {
      const auto psnr = Psnr(shown[i], other);  // fails for other sizes, which cannot be confused
      return psnr.ok() && *psnr > own;
    });
    agreement.mismatched += mismatched;
  }
  if (agreement.misplaced > 0) agreement.misplaced_gain /= static_cast<double>(agreement.misplaced);
  std::vector<double> sorted = each;
  std::sort(sorted.begin(), sorted.end());
  for (size_t i = 0; i < each.size(); ++i) {
    if (each[i] < sorted[sorted.size() / 2] - kFarBelow) agreement.far_below.push_back(cameras[i].name);
  }
  if (render.mode == RenderMode::kClassic) {
    ANCHORSPLAT_RETURN_IF_ERROR(MeasureSmaller(still, render, cameras, truth, agreement));
  }
  return agreement;
}

Result<PictureAgreement> MeasureSizes(const GaussianCloud& cloud, const RenderOptions& render, PictureCache& pictures) {
  PictureAgreement agreement;
  if (render.mode != RenderMode::kClassic) return agreement;
  ConstantCloud still(cloud);
  std::vector<Camera> cameras;
  std::vector<Image> truth;
  std::vector<Buffer<uint8_t>> ignored;
  for (int64_t view = 0; view < std::ssize(pictures.views()); ++view) {
    if (!pictures.Load(view, truth.emplace_back(), ignored.emplace_back()).ok()) {  // the others tell as well
      truth.pop_back();
      ignored.pop_back();
      continue;
    }
    cameras.push_back(pictures.views()[static_cast<size_t>(view)]);
  }
  agreement.views = std::ssize(truth);
  if (truth.empty()) return agreement;
  Rasterizer rasterizer;
  const auto add = [&](size_t i, RenderOutput& output) -> Status {
    Clamp01(output.color);
    FillIgnored(ignored[i], output.color, truth[i]);
    agreement.psnr += Capped(Psnr(output.color, truth[i])) / static_cast<double>(truth.size());
    return {};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, cameras, render, add));
  ANCHORSPLAT_RETURN_IF_ERROR(MeasureSmaller(still, render, cameras, truth, agreement));
  return agreement;
}

int TimesLarger(const PictureAgreement& agreement) {
  return agreement.smaller_psnr > agreement.psnr + kSmallerIsRight ? agreement.smaller : 1;
}

Status CheckAgreement(const PictureAgreement& agreement, double least_psnr, bool aligned) {
  const std::string suspicions =
      ". Check that these are its training pictures, in the order of their cameras, and that the splat is in the "
      "coordinates of the cameras";
  if (agreement.views == 0) {
    return Error{ErrorCode::kBadArgument, "--images: the masks hide all of the pictures; black hides, white counts"};
  }
  // At full size, a splat fitted to smaller pictures may show needles.
  const double psnr = TimesLarger(agreement) > 1 ? agreement.smaller_psnr : agreement.psnr;
  if (!(psnr >= least_psnr)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images: renders of the splat match the pictures with ", Fixed(psnr, 1), " dB only, mean of ",
                     agreement.views, " views (at least ", least_psnr, " expected)", suspicions)};
  }
  if (2 * agreement.plain > agreement.views) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images: ", agreement.plain, " of ", agreement.views,
                     " pictures match a single colour as well as they match the splat", suspicions)};
  }
  const std::string mismatched = Cat("--images: ", agreement.mismatched, " of ", agreement.views,
                                     " views match the picture of another view better than their own");
  if (4 * agreement.mismatched > agreement.views) return Error{ErrorCode::kBadArgument, mismatched + suspicions};
  if (!aligned && 2 * agreement.misplaced > agreement.views) {
    return Error{
        ErrorCode::kBadArgument,
        Cat("--images: ", agreement.misplaced, " of ", agreement.views, " pictures match the splat better by ",
            Fixed(agreement.misplaced_gain, 1),
            " dB when moved or enlarged by a pixel: the cameras are slightly off (principal point, focal length, "
            "positions). Pass --align to correct poses")};
  }
  if (agreement.mismatched > 0) LogWarning(mismatched + suspicions);
  if (!agreement.far_below.empty()) {
    std::string names;
    for (const std::string& name : agreement.far_below) names += Cat(names.empty() ? "" : ", ", Printable(name));
    LogWarning(Cat("--images: ", agreement.far_below.size(), " of ", agreement.views,
                   " pictures match the splat far worse than the others; check or remove them: ", names));
  }
  return {};
}

}  // namespace anchorsplat
