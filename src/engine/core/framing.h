#pragma once

#include <array>
#include <cstdint>
#include <mutex>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// The default view target. Its centre is that of the box around the middle 98 % per axis of the visible Gaussians'
// means (a regular subset above a million); `radius` is that of the sphere around it that holds 98 % of them. If all
// means coincide, the radius is 3 σ of the largest Gaussian, or 1 if that has no extent. Gaussians that are not drawn
// do not count.
//
// Floaters and skies would make everything else small. Gaussians much farther from their neighbours than their size
// suggests, and those beyond a wide gap in most directions, are therefore left out if that at least halves the radius.
// What lies beyond a gap in only a few directions is another object and stays.
struct Framing {
  std::array<double, 3> target = {0, 0, 0};  // world
  double radius = 1;                         // world; always positive
  std::array<double, 3> half = {0, 0, 0};    // world; half the box's side lengths
};
Framing FrameCloud(const CloudView& cloud);
// The same with the target relative to the cloud's origin, as means are.
Framing FrameMeans(const CloudView& cloud);

// Whether a mean (x y z, finite) lies more than ten radii from the target: sky, floaters, strays. Both relative to the
// same origin.
bool IsFarOut(const Framing& framing, const float* mean);

// FrameMeans for a splat that arrives block by block, or for a subset of its Gaussians, numbered consecutively.
class FramingStudy {
 public:
  explicit FramingStudy(int64_t gaussians);
  void Visit(int64_t first, const CloudView& rows);  // row 0 is Gaussian `first`; thread-safe
  Framing Find() const;                              // after all Visit calls; target relative to their origin

 private:
  int64_t step_;
  Buffer<float> means_, opacity_logits_;  // of every step_-th: [M,3], [M]; logit NaN: not usable
  Buffer<float> log_sizes_;               // [M] mean of the two largest log-scales
  std::mutex mutex_;
  double reach_ = 0, visible_reach_ = 0;  // 3 σ of the largest Gaussian, and of the largest visible one
};

// Distance at which a sphere of the framing's radius fills the smaller image side with a margin of a tenth.
double FramingDistance(const Framing& framing, const Pinhole& intrinsics);

}  // namespace anchorsplat
