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

// Sky shells, floaters and giants say nothing about a fit, and time is bounded.
inline constexpr float kShowingOpacity = 0.1f;
inline constexpr double kShowingFarthest = 1.5;  // of the radius that frames the cloud
inline constexpr size_t kMostShowing = 200'000;
// Of fewer that show nothing is read.
inline constexpr int64_t kLeastGaussians = 16;

// The Gaussians whose outlines say something: those near the middle of the cloud and small beside it, whatever their
// opacity, and the kMostShowing nearest to it where there are more: a part of a scene has outlines enough, while every
// so many Gaussians of it would have gaps. Giants would drown what does say something.
struct TellingGaussians {
  GaussianCloud cloud;        // without harmonics, in the order of the whole cloud
  std::vector<int64_t> rows;  // of that
  Framing framing;            // of the whole cloud
  // Where there were more, they are those up to here from the framing's target; nothing where they are all.
  std::optional<double> reach;

  double radius() const { return std::min(framing.radius, reach.value_or(framing.radius)); }
};

// The Gaussians of a cloud that say something about its fit. All without harmonics, in the order of the whole cloud.
struct ShowingGaussians {
  // Usable, of kShowingOpacity or more, near the middle of the cloud and small beside it: a single giant would outweigh
  // all others. Those nearest to the middle where there are more than kMostShowing.
  GaussianCloud all;
  std::vector<int64_t> rows_of_all;  // of the cloud
  TellingGaussians telling;
};

// Finds them in a splat that is looked at block by block, twice. Keeps up to 50 MB.
class ShowingStudy final : public RowStudy {
 public:
  explicit ShowingStudy(const CloudBlocks& blocks);
  ~ShowingStudy() override;
  bool done() const override;
  void Visit(const CloudBlock& block) override;
  void EndPass() override;
  ShowingGaussians Take();  // once it is done

 private:
  struct State;
  std::unique_ptr<State> state_;
};

ShowingGaussians FindShowingGaussians(const CloudView& cloud);

// Opacity of kShowingOpacity or more, and not nearly black; of a usable row.
bool ShowsInPictures(const CloudView& cloud, size_t i);
bool IsNearlyBlack(const CloudView& cloud, size_t i);  // as fits on black keep some around the object

double SquaredDistance(const float* a, const float* b);  // of two points of three coordinates

}  // namespace anchorsplat
