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
#include "reading/visible_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostPlaces = 64;
constexpr int64_t kOfPlace = 1000;       // minimum visible Gaussians per place
constexpr int64_t kMostOfPlace = 4000;   // Gaussians read per place
constexpr size_t kMostOfTree = 1 << 19;  // Gaussians that define the places
constexpr size_t kAround = 16;           // neighbours to average over

std::vector<int64_t> RowsThatShow(const CloudView& cloud) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) >= kVisibleOpacity && IsUsable(cloud, i)) {
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

// Fills each box with all visible Gaussians in it, not just those of the tree: the distances of neighbours are a
// feature. A box without extent (Gaussians at one point) may hold any number.
void FillBoxes(const CloudView& cloud, std::span<const int64_t> visible, std::span<const Bounds> boxes,
               std::vector<std::vector<int64_t>>& rows) {
  ParallelFor(0, std::ssize(boxes), 1, [&](int64_t place, int64_t) {
    const Bounds& box = boxes[static_cast<size_t>(place)];
    std::vector<int64_t>& inside = rows[static_cast<size_t>(place)];
    inside.clear();
    for (const int64_t row : visible) {
      if (std::ssize(inside) == 2 * kMostOfPlace) break;
      const float* const at = cloud.means.data() + 3 * row;
      bool is_inside = true;
      for (size_t a = 0; a < 3; ++a) is_inside = is_inside && at[a] >= box.min[a] && at[a] <= box.max[a];
      if (is_inside) inside.push_back(row);
    }
  });
}

// ln of the predicted pixel of a place; NaN if it cannot be read.
double LogPixelOf(const CloudView& cloud, std::span<const int64_t> rows, const ReadingModel& model) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const auto features = FeaturesOfPlace(cloud, rows);
  if (!features.ok()) return kUnknown;
  const std::vector<ReadingPrediction> predictions = model.Predict(features->values);
  double sum = std::log(features->unit);
  for (const ReadingPrediction& prediction : predictions)
    sum += prediction.log_pixel / static_cast<double>(predictions.size());
  return sum;
}

// Turns ln(pixels) into ln(pixels / median), shrunk by the share of their variance that errors explain. False if errors
// explain all of it.
bool KeepWhatDiffers(double error, std::vector<double>& pixels) {
  const auto count = static_cast<double>(pixels.size());
  double mean = 0, variance = 0;
  for (const double pixel : pixels) mean += pixel / count;
  for (const double pixel : pixels) variance += (pixel - mean) * (pixel - mean) / count;
  if (!(variance > error * error)) return false;  // also for NaN
  Buffer<float> sorted;
  for (const double pixel : pixels) sorted.push_back(static_cast<float>(pixel));
  const double median{Quantile(sorted, 0.5)}, share = 1 - error * error / variance;
  for (double& pixel : pixels) pixel = share * (pixel - median);
  return true;
}

}  // namespace

SplatPlaces::SplatPlaces(const CloudView& cloud) {
  const std::vector<int64_t> visible = RowsThatShow(cloud);
  const int64_t count = std::min(kMostPlaces, std::ssize(visible) / kOfPlace);
  if (count < 2) return;
  const size_t step = 1 + visible.size() / kMostOfTree;
  Buffer<float> means;
  for (size_t k = 0; k < visible.size(); k += step) {
    const float* const mean = cloud.means.data() + 3 * visible[k];
    means.insert(means.end(), mean, mean + 3);
  }
  tree_ = std::make_unique<KdTree>(means);
  rows_.resize(static_cast<size_t>(count));
  // The tree's order is by recursive halving, so equal consecutive parts are spatially compact.
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
      rows.push_back(visible[k * step]);
      Extend(boxes[static_cast<size_t>(place)], means.data() + 3 * k, at == begin);
    }
    std::ranges::sort(rows);
  }
  if (step > 1) FillBoxes(cloud, visible, boxes, rows_);
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
