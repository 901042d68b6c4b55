#include "reading/places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "reading/features.h"
#include "reading/reading_model.h"
#include "reading/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostPlaces = 64;
constexpr int64_t kOfPlace = 1000;       // Gaussians that show, in each at least
constexpr int64_t kMostOfPlace = 4000;   // that are looked at
constexpr size_t kMostOfTree = 1 << 19;  // Gaussians: enough to tell where places are
constexpr size_t kAround = 16;           // Gaussians whose places are averaged

std::vector<int64_t> RowsThatShow(const CloudView& cloud) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) >= kShowingOpacity && IsUsable(cloud, i)) {
      rows.push_back(i);
    }
  }
  return rows;
}

void Extend(Bounds& box, const float* at, bool is_first) {
  for (size_t a = 0; a < 3; ++a) {
    box.min[a] = is_first ? at[a] : std::min(box.min[a], at[a]);
    box.max[a] = is_first ? at[a] : std::max(box.max[a], at[a]);
  }
}

// All that shows in each box, not only those of which the tree was made: how near neighbours are says something. In
// boxes without size, as of Gaussians in one place, there may be any number.
void FillBoxes(const CloudView& cloud, std::span<const int64_t> showing, std::span<const Bounds> boxes,
               std::vector<std::vector<int64_t>>& rows) {
  ParallelFor(0, std::ssize(boxes), 1, [&](int64_t place, int64_t) {
    const Bounds& box = boxes[static_cast<size_t>(place)];
    std::vector<int64_t>& inside = rows[static_cast<size_t>(place)];
    inside.clear();
    for (const int64_t row : showing) {
      if (std::ssize(inside) == 2 * kMostOfPlace) break;
      const float* const at = cloud.means.data() + 3 * row;
      bool is_inside = true;
      for (size_t a = 0; a < 3; ++a) is_inside = is_inside && at[a] >= box.min[a] && at[a] <= box.max[a];
      if (is_inside) inside.push_back(row);
    }
  });
}

// NaN: it cannot be read.
double LogPixelOf(const CloudView& cloud, std::span<const int64_t> rows, const ReadingModel& model) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const auto part = Subset(cloud, rows);
  if (!part.ok()) return kUnknown;
  const auto features = FeaturesOf(*part, FindShowingGaussians(*part), /*with_pictures=*/false);
  if (!features.ok()) return kUnknown;
  const std::vector<ReadingOpinion> opinions = model.OpinionsOf(features->values);
  double sum = std::log(features->unit);
  for (const ReadingOpinion& opinion : opinions) sum += opinion.log_pixel / static_cast<double>(opinions.size());
  return sum;
}

// ln(pixels) to ln(pixels / median), shrunk by the share of their variance that errors explain. False: all of it.
bool KeepWhatDiffers(double error, std::vector<double>& pixels) {
  const auto count = static_cast<double>(pixels.size());
  double mean = 0, variance = 0;
  for (const double pixel : pixels) mean += pixel / count;
  for (const double pixel : pixels) variance += (pixel - mean) * (pixel - mean) / count;
  if (!(variance > error * error)) return false;  // not for NaN either
  Buffer<float> sorted;
  for (const double pixel : pixels) sorted.push_back(static_cast<float>(pixel));
  const double median{Quantile(sorted, 0.5)}, share = 1 - error * error / variance;
  for (double& pixel : pixels) pixel = share * (pixel - median);
  return true;
}

}  // namespace

SplatPlaces::SplatPlaces(const CloudView& cloud) {
  const std::vector<int64_t> showing = RowsThatShow(cloud);
  const int64_t count = std::min(kMostPlaces, std::ssize(showing) / kOfPlace);
  if (count < 2) return;
  const size_t step = 1 + showing.size() / kMostOfTree;
  Buffer<float> means;
  for (size_t k = 0; k < showing.size(); k += step) {
    const float* const mean = cloud.means.data() + 3 * showing[k];
    means.insert(means.end(), mean, mean + 3);
  }
  tree_ = std::make_unique<KdTree>(means);
  rows_.resize(static_cast<size_t>(count));
  // The order of the tree is one of halves of halves: equal parts of it lie together.
  std::vector<Bounds> boxes(rows_.size());
  for (int64_t place = 0; place < count; ++place) {
    std::vector<int64_t>& rows = rows_[static_cast<size_t>(place)];
    int64_t begin = (place * tree_->size() + count - 1) / count;
    int64_t end = std::min(((place + 1) * tree_->size() + count - 1) / count, begin + kMostOfPlace);
    if (step > 1) {
      std::tie(begin, end) = tree_->BoxAround((begin + end) / 2, kMostOfPlace / static_cast<int64_t>(step));
    }
    for (int64_t at = begin; at < end; ++at) {
      const auto k = static_cast<size_t>(tree_->PointAt(at));
      rows.push_back(showing[k * step]);
      Extend(boxes[static_cast<size_t>(place)], means.data() + 3 * k, at == begin);
    }
    std::ranges::sort(rows);
  }
  if (step > 1) FillBoxes(cloud, showing, boxes, rows_);
}

Buffer<float> SplatPlaces::Spread(std::span<const double> of_places, std::span<const float> means) const {
  if (count() == 0) return {};
  std::vector<float> of_points(static_cast<size_t>(tree_->size()));
  for (int64_t at = 0; at < tree_->size(); ++at) {
    of_points[static_cast<size_t>(tree_->PointAt(at))] =
        static_cast<float>(of_places[static_cast<size_t>(PlaceAt(at))]);
  }
  Buffer<float> spread(means.size() / 3);
  ParallelFor(0, std::ssize(spread), 1024, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const float* const mean = means.data() + 3 * i;
      std::array<KdTree::Neighbour, kAround> around{};
      const auto found = tree_->NearestTo({mean[0], mean[1], mean[2]}, around);
      float sum = 0;
      for (int64_t n = 0; n < found; ++n) {
        sum += of_points[static_cast<size_t>(around[static_cast<size_t>(n)].index)] / static_cast<float>(found);
      }
      spread[static_cast<size_t>(i)] = sum;
    }
  });
  return spread;
}

Buffer<float> PixelRatios(const CloudView& cloud, const ReadingModel& model) {
  const SplatPlaces places(cloud);
  std::vector<double> pixels(static_cast<size_t>(places.count()), std::numeric_limits<double>::quiet_NaN());
  ParallelFor(0, places.count(), 1, [&](int64_t place, int64_t) {
    LeaveIfAbandoned();
    pixels[static_cast<size_t>(place)] = LogPixelOf(cloud, places.rows(place), model);
  });
  if (!KeepWhatDiffers(model.place_error(), pixels)) return {};
  Buffer<float> ratios = places.Spread(pixels, cloud.means);
  for (float& ratio : ratios) ratio = std::exp(ratio);
  return ratios;
}

}  // namespace anchorsplat
