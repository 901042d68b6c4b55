#pragma once

#include <array>
#include <cstdint>
#include <mutex>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/cloud_view.h"

namespace anchorsplat {

// Where to look from when nobody says: the centre of the box that holds the middle 98 % of the visible Gaussians'
// means along each axis (of more than a million, of every so many), and the radius of the sphere around that centre
// that holds 98 % of them. Where that is a point, the radius is what its largest Gaussian shows (3 σ); 1 where that has
// no extent either. Gaussians that nobody draws do not count.
//
// Floaters and skies would make everything else small. So Gaussians without neighbours as near as their size lets one
// expect do not count, nor does what lies beyond a wide gap in most directions, if the radius becomes less than half of
// what it would be with them. What lies beyond a gap in a few directions alone is another object, and stays.
struct Framing {
  std::array<double, 3> target = {0, 0, 0};  // world
  double radius = 1;                         // world; always positive
  std::array<double, 3> half = {0, 0, 0};    // world; half the lengths of the box
};
Framing FrameCloud(const CloudView& cloud);
// The same with the target from the cloud's origin on, as means are.
Framing FrameMeans(const CloudView& cloud);

// Whether a mean (x y z, finite) lies more than ten radii away: sky, floaters, strays. Both from the same origin on.
bool IsFarOut(const Framing& framing, const float* mean);

// The same of a splat that is shown block by block, or of a part of its Gaussians, numbered without gaps.
class FramingStudy {
 public:
  explicit FramingStudy(int64_t gaussians);
  void Look(int64_t first, const CloudView& rows);  // Gaussians from number `first` on; from several threads
  Framing Find() const;                             // once all were shown; the target from their origin on

 private:
  int64_t step_;
  Buffer<float> means_, opacity_logits_;  // of every step-th: [M,3], [M]; a logit of NaN: not usable
  Buffer<float> log_sizes_;               // [M] of the two longest axes, middle
  std::mutex mutex_;
  double reach_ = 0, visible_reach_ = 0;  // 3 σ of the largest Gaussian, of those that are visible
};

// Distance from which a sphere of `radius` fills the smaller side of the image, with a tenth to spare.
double FramingDistance(const Framing& framing, const Pinhole& intrinsics);

}  // namespace anchorsplat
