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

// Parts of a splat, each with about as many of the Gaussians that show. Training pixels differ from place to place
// where cameras saw some from near and some from afar, as in photographs, and a splat says so (docs/reading.md).
class SplatPlaces {
 public:
  explicit SplatPlaces(const CloudView& cloud);

  int64_t count() const { return std::ssize(rows_); }  // 0: too little shows to tell places apart
  // Rows of the cloud that show there; of many those that lie together.
  const std::vector<int64_t>& rows(int64_t place) const { return rows_[static_cast<size_t>(place)]; }

  // For means [N,3] the values [count()] of the places around, averaged over the nearest Gaussians: without steps.
  Buffer<float> Spread(std::span<const double> of_places, std::span<const float> means) const;

 private:
  int64_t PlaceAt(int64_t place_of_tree) const { return place_of_tree * count() / tree_->size(); }

  std::unique_ptr<KdTree> tree_;  // of Gaussians that show
  std::vector<std::vector<int64_t>> rows_;
};

// [N] training pixels over that of most places, as the places say them, seen without pictures. What differs less from
// place to place than what is said of places whose pixels are one (Stein's estimate: ReadingModel::place_error) differs
// by nothing: empty. Empty, too, where no places are told apart or one cannot be read.
Buffer<float> PixelRatios(const CloudView& cloud, const ReadingModel& model);

}  // namespace anchorsplat
