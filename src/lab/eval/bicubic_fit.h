#pragma once

#include <cstdint>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "eval/method.h"

namespace anchorsplat {

struct BicubicFit {
  GaussianCloud cloud;
  double seconds = 0;     // enlarging and fitting, all attempts together
  double train_psnr = 0;  // dB, against the enlarged pictures
};

// "Bicubic Optimization" of the paper: a 3DGS fit from scratch at the high resolution, on the low-resolution training
// pictures enlarged by cubic convolution and rounded to 8 bits. It begins at the points that the project has, else at
// random ones in view, and holds out the views that the low-quality fit held out.
//
// It takes long, so everything stays in `task.cache`: a fit that was stopped, however hard, goes on from its last
// checkpoint, and one that is done is only read. Errors: those of fit/fit.h; kIo.
Result<BicubicFit> FitEnlargedPictures(const MethodTask& task, int64_t steps);

}  // namespace anchorsplat
