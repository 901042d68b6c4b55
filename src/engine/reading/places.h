#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/kd_tree.h"

namespace anchorsplat {

class ReadingModel;

// Divides a splat into places with about equal numbers of visible Gaussians. In photographs cameras see some places
// from near and others from afar, so training pixels differ from place to place, and the splat shows it
// (docs/reading.md).
class SplatPlaces {
 public:
  explicit SplatPlaces(const CloudView& cloud);

  int64_t count() const { return std::ssize(rows_); }  // 0: too few visible Gaussians for several places
  // Rows of the cloud that are visible there; if there are many, a subset that lies close together.
  const std::vector<int64_t>& rows(int64_t place) const { return rows_[static_cast<size_t>(place)]; }

  // Interpolates one value per place to means [N,3]: averages over the nearest Gaussians, so without steps.
  Buffer<float> Spread(std::span<const double> of_places, std::span<const float> means) const;

 private:
  int64_t PlaceAt(int64_t place_of_tree) const { return place_of_tree * count() / tree_->size(); }

  std::unique_ptr<KdTree> tree_;  // of visible Gaussians
  std::vector<std::vector<int64_t>> rows_;
};

// Ratio [N] of each Gaussian's training pixel to the median place's, predicted per place without pictures. Variation
// smaller than the prediction error (Stein's estimate: ReadingModel::place_error) is treated as none. Empty if there is
// none, if places are not distinguished, or if one cannot be read.
Buffer<float> PixelRatios(const CloudView& cloud, const ReadingModel& model);

}  // namespace anchorsplat
