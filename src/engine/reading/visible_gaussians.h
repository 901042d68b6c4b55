#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/cloud_blocks.h"
#include "core/framing.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Gaussians count as visible from this opacity. The other limits bound time and exclude sky shells, floaters and
// giants, which say nothing about a fit.
inline constexpr float kVisibleOpacity = 0.1f;
inline constexpr double kMaxVisibleDistance = 1.5;  // in radii that frame the cloud
inline constexpr size_t kMaxVisible = 200'000;
// With fewer visible Gaussians nothing is read.
inline constexpr int64_t kMinGaussians = 16;

// Gaussians whose outlines are informative: of any opacity, near the cloud's centre and small compared to it. At most
// the kMaxVisible nearest to the centre: a part of a scene has enough outlines, whereas a subsample would have gaps.
// Giants would hide what is informative.
struct CentralGaussians {
  GaussianCloud cloud;        // without harmonics, in the order of the whole cloud
  std::vector<int64_t> rows;  // rows in the whole cloud
  Framing framing;            // of the whole cloud
  // Distance from the framing's target up to which Gaussians are included; unset if all are.
  std::optional<double> reach;

  double radius() const { return std::min(framing.radius, reach.value_or(framing.radius)); }
};

// The Gaussians of a cloud that are used to read it, without harmonics, in the order of the whole cloud.
struct VisibleGaussians {
  // Usable, opacity of kVisibleOpacity or more, near the cloud's centre and small compared to it (a single giant would
  // outweigh all others). At most the kMaxVisible nearest to the centre.
  GaussianCloud cloud;
  std::vector<int64_t> rows;  // rows in the whole cloud
  CentralGaussians central;
};

// Finds them in two passes over a cloud's blocks. Keeps up to 50 MB.
class VisibleGaussiansStudy final : public RowStudy {
 public:
  explicit VisibleGaussiansStudy(const CloudBlocks& blocks);
  ~VisibleGaussiansStudy() override;
  bool done() const override;
  void Visit(const CloudBlock& block) override;
  void EndPass() override;
  VisibleGaussians Take();  // requires done()

 private:
  struct State;
  std::unique_ptr<State> state_;
};

VisibleGaussians FindVisibleGaussians(const CloudView& cloud);

// Whether row i, which must be usable, has kVisibleOpacity or more and is not nearly black.
bool ShowsInPictures(const CloudView& cloud, size_t i);
bool IsNearlyBlack(const CloudView& cloud, size_t i);  // fits on black keep such Gaussians around the object

double SquaredDistance(const float* a, const float* b);  // of two points [3]

}  // namespace anchorsplat
