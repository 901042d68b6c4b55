#pragma once

#include <cstdint>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "eval/method.h"

namespace anchorsplat {

struct BicubicFit {
  GaussianCloud cloud;
  double seconds = 0;     // enlarging and fitting, over all attempts
  double train_psnr = 0;  // dB against the enlarged pictures
};

// The paper's "Bicubic Optimization": a 3DGS fit from scratch at high resolution to the low-resolution training
// pictures, enlarged bicubically and rounded to 8 bits. Starts from the project's points, else from random ones in
// view. Holds out the same views as the low-quality fit.
//
// Slow, so everything is kept in `task.cache`: an interrupted fit resumes from its last checkpoint, a finished one is
// reused. Errors: those of fit/fit.h; kIo.
Result<BicubicFit> FitEnlargedPictures(const MethodTask& task, int64_t steps);

}  // namespace anchorsplat
