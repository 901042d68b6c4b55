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
  // Usable, of kShowingOpacity or more and near the middle of the cloud; those nearest to it where there are more than
  // kMostShowing.
  GaussianCloud all;
  std::vector<int64_t> rows_of_all;  // of the cloud
  // The same of those that are not nearly black: fits on black keep black ones around the object that no picture shows.
  // The same as `all` where fewer than kLeastGaussians are not black.
  GaussianCloud bright;
  TellingGaussians telling;
  // Of the cloud without black Gaussians, visible or not; nothing where these are too few to move an outline.
  std::optional<TellingGaussians> telling_not_black;
};

// Finds them in a splat that is looked at block by block, twice, or three times where there are black ones. Keeps up to
// 100 MB.
class ShowingStudy final : public RowStudy {
 public:
  explicit ShowingStudy(const CloudBlocks& blocks);
  ~ShowingStudy() override;
  bool done() const override;
  void Look(const CloudBlock& block) override;
  void EndPass() override;
  ShowingGaussians Take();  // once it is done

 private:
  struct State;
  std::unique_ptr<State> state_;
};

ShowingGaussians FindShowingGaussians(const CloudView& cloud);
TellingGaussians FindTellingGaussians(const CloudView& cloud);

// Opacity of kShowingOpacity or more, and not nearly black; of a usable row.
bool ShowsInPictures(const CloudView& cloud, size_t i);

double SquaredDistance(const float* a, const float* b);  // of two points of three coordinates

}  // namespace anchorsplat
