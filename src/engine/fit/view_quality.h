#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "fit/pixel_model.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How alike renders and pictures are, as means over views; renders clamped to 0–1, not quantised.
struct ViewQuality {
  int64_t views = 0;  // that were measured
  double psnr = 0;    // dB; 0 without views
  double ssim = 0;    // of metrics/image_metrics.h
};

// Over all views of `pictures`, which are seen from the cloud's origin as TrainingViews are, pixels as `pixel` says;
// ignored ones do not count. Views of which a mask leaves nothing are left out and named in a warning. Errors: those of
// Rasterizer and PictureCache; kInterrupted.
Result<ViewQuality> MeasureQuality(const GaussianCloud& cloud, const RenderOptions& options, PictureCache& pictures,
                                   const PixelModel& pixel = {});

}  // namespace anchorsplat
