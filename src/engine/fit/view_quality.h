#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "fit/pixel_model.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Similarity of renders and pictures, means over views; renders are clamped to 0–1, not quantised.
struct ViewQuality {
  int64_t views = 0;  // views measured
  double psnr = 0;    // dB; 0 without views
  double ssim = 0;    // of metrics/image_metrics.h
};

// Measures all views of `pictures`, which are relative to the cloud's origin as TrainingViews are. `pixel`: the pixel
// model. Ignored pixels do not count; fully masked views are skipped and named in a warning. Errors: those of
// Rasterizer and PictureCache; kInterrupted.
Result<ViewQuality> MeasureQuality(const GaussianCloud& cloud, const RenderOptions& options, PictureCache& pictures,
                                   const PixelModel& pixel = {});

}  // namespace anchorsplat
