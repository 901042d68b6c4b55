#include "fit/far_shell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "cameras/photograph.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"
#include "fit/picture_cells.h"

namespace anchorsplat {

namespace {

constexpr size_t kViewsLookedAt = 200;
constexpr int64_t kPointsLookedAt = 200'000;
constexpr double kPointsWithin = 0.98;  // structure from motion leaves lone points anywhere
constexpr int64_t kFewestOnShell = 500;
constexpr int kLargestHalfFootprint = 16;  // pixels

using Direction = std::array<double, 3>;

// Geometry of the sphere and of the scene inside.
struct ShellPlace {
  Direction center{};
  double extent = 0;  // the farther of cameras and points, world units
};

ShellPlace PlaceOf(const TrainingViews& views, const InitialPoints& points) {
  ShellPlace place;
  for (const Camera& camera : views.train) {
    const Direction at = camera.Center();
    for (size_t k = 0; k < 3; ++k) place.center[k] += at[k] / static_cast<double>(views.train.size());
  }
  std::vector<float> distances;
  for (size_t i = 0; i + 2 < points.positions.size(); i += 3) {
    const float* p = points.positions.data() + i;
    const auto d =
        static_cast<float>(std::hypot(p[0] - place.center[0], p[1] - place.center[1], p[2] - place.center[2]));
    if (std::isfinite(d)) distances.push_back(d);
  }
  place.extent = views.scene_scale;
  if (!distances.empty()) place.extent = std::max(place.extent, double{Quantile(distances, kPointsWithin)});
  return place;
}

std::vector<Camera> ViewsLookedAt(const std::vector<Camera>& views) {
  const size_t count = std::min(views.size(), kViewsLookedAt);
  std::vector<Camera> chosen;
  for (size_t i = 0; i < count; ++i) chosen.push_back(views[i * views.size() / count]);
  return chosen;
}

// Count with a spacing of kShellPixels in the median view.
int64_t CountFor(const std::vector<Camera>& views, int64_t max_gaussians) {
  std::vector<float> focal;
  for (const Camera& view : views) {
    focal.push_back(static_cast<float>(std::max(view.intrinsics.fx, view.intrinsics.fy)));
  }
  const double angle = kShellPixels / std::max(1e-3, double{Quantile(focal, 0.5)});
  const auto wanted = static_cast<int64_t>(std::min(4 * std::numbers::pi / (angle * angle), double{kMostOnShell}));
  const int64_t most = max_gaussians > 0 ? std::min(kShellDefaultMost, max_gaussians / 2) : kShellDefaultMost;
  return std::min(std::max(wanted, kFewestOnShell), std::max<int64_t>(1, most));
}

// Colour of one picture at one Gaussian of the sphere.
struct ShellSample {
  int64_t place;
  std::array<float, 3> color;
  bool open;  // no point in front
};

void SamplePlaces(const Camera& camera, const CellPicture& picture, const std::vector<Direction>& sphere,
                  const ShellPlace& at, std::vector<ShellSample>& samples) {
  const Pinhole& k = camera.intrinsics;
  const double radius = kShellDistance * at.extent;
  const double spacing = std::sqrt(4 * std::numbers::pi / static_cast<double>(sphere.size()));
  for (size_t i = 0; i < sphere.size(); ++i) {
    const Direction& d = sphere[i];
    const auto c =
        camera.ToCamera({at.center[0] + radius * d[0], at.center[1] + radius * d[1], at.center[2] + radius * d[2]});
    if (!(c[2] > 0)) continue;
    const double x = k.fx * c[0] / c[2] + k.cx, y = k.fy * c[1] / c[2] + k.cy;
    if (!(x >= 0 && x < k.width && y >= 0 && y < k.height)) continue;
    const double pixels = 0.5 * spacing * radius * k.fx / c[2];
    const int half = static_cast<int>(std::min<double>(pixels, kLargestHalfFootprint));
    std::array<float, 3> color{};
    if (!MeanColor(picture, static_cast<int>(x), static_cast<int>(y), half, color)) continue;
    samples.push_back({static_cast<int64_t>(i), color, picture.cells.IsOpenAt(x, y)});
  }
}

// Median per channel; for an even number the mean of the middle two.
std::array<float, 3> MedianColor(std::span<const ShellSample> samples, bool open_only) {
  std::array<float, 3> out{};
  std::vector<float> values;
  for (size_t c = 0; c < 3; ++c) {
    values.clear();
    for (const ShellSample& sample : samples) {
      if (sample.open || !open_only) values.push_back(sample.color[c]);
    }
    out[c] = Quantile(values, 0.5);
  }
  return out;
}

void AddGaussian(const ShellPlace& at, const Direction& direction, double log_scale, const std::array<float, 3>& color,
                 int64_t row, GaussianCloud& cloud) {
  const auto i = static_cast<size_t>(row);
  for (size_t k = 0; k < 3; ++k) {
    cloud.means[3 * i + k] = static_cast<float>(at.center[k] + kShellDistance * at.extent * direction[k]);
    cloud.log_scales[3 * i + k] = static_cast<float>(log_scale);
    cloud.sh[static_cast<size_t>(cloud.sh_stride()) * i + k] = (color[k] - 0.5f) / kSh0;
  }
  cloud.quats[4 * i] = 1;
  cloud.opacity_logits[i] = static_cast<float>(std::log(kShellOpacity / (1 - kShellOpacity)));
}

std::string PercentText(double share) { return Cat(Fixed(100 * share, 0), " %"); }

}  // namespace

std::vector<std::array<double, 3>> FibonacciSphere(int64_t count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<std::array<double, 3>> places;
  places.reserve(static_cast<size_t>(count));
  for (int64_t i = 0; i < count; ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double ring = std::sqrt(1 - y * y), turn = golden * static_cast<double>(i);
    places.push_back({ring * std::cos(turn), y, ring * std::sin(turn)});
  }
  return places;
}

Result<FarShell> MakeFarShell(const TrainingViews& views, const InitialPoints& start, const FarShellOptions& options) {
  FarShell shell;
  const auto none = [&](std::string why) {
    shell.why = Cat("none, ", why);
    return shell;
  };
  const bool decides = !options.count;
  if (options.count && (*options.count < 0 || *options.count > kMostOnShell)) {
    return Error{ErrorCode::kBadArgument, Cat("the far shell must have 0 to ", kMostOnShell, " Gaussians")};
  }
  if (views.train.empty()) return Error{ErrorCode::kBadArgument, "far shell: there are no views"};
  if (options.count == 0) return none("as requested");
  if (decides && !options.points_tell) return none("as the start is not the project's points");
  const ShellPlace at = PlaceOf(views, start);
  if (!(kShellDistance * at.extent < 0.01 * std::numeric_limits<float>::max())) {
    return none("as cameras and points are too far apart");
  }

  const std::vector<Camera> looked_at = ViewsLookedAt(views.train);
  std::vector<CellPicture> pictures(looked_at.size());
  const InitialPoints points = SubsampleEvenly(start, kPointsLookedAt);
  ParallelFor(0, std::ssize(looked_at), 1, [&](int64_t first, int64_t last) {
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      pictures[i].cells = PictureCells(looked_at[i], points.positions);
    }
  });
  const double without_points = ShareOfOpenCells(pictures);
  if (decides && without_points < kShellShare) {
    return none(Cat("as points cover ", PercentText(1 - without_points), " of the pictures"));
  }

  const int64_t count = options.count.value_or(CountFor(looked_at, options.max_gaussians));
  const std::vector<Direction> sphere = FibonacciSphere(count);
  std::vector<std::vector<ShellSample>> of_views(looked_at.size());
  std::vector<Status> read(looked_at.size());
  // One picture per thread, freed afterwards: together they may exceed memory.
  ParallelFor(0, std::ssize(looked_at), 1, [&](int64_t first, int64_t last) {
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      read[i] = ReadCellPicture(looked_at[i], options.background, pictures[i]);
      if (!read[i].ok()) continue;
      SamplePlaces(looked_at[i], pictures[i], sphere, at, of_views[i]);
      pictures[i].Forget();
    }
  });
  for (const Status& status : read) ANCHORSPLAT_RETURN_IF_ERROR(status);
  const double seen = ShareOfOpenCells(pictures);
  ClosePlainCells(options.background, pictures);
  shell.open_share = ShareOfOpenCells(pictures);
  if (decides && shell.open_share < kShellShare) {
    return none(seen < kShellShare ? "as the picture areas without points are masked or transparent"
                                   : "as the picture areas without points have a single colour");
  }

  std::vector<ShellSample> samples;
  for (const std::vector<ShellSample>& some : of_views) samples.insert(samples.end(), some.begin(), some.end());
  std::stable_sort(samples.begin(), samples.end(),
                   [](const ShellSample& a, const ShellSample& b) { return a.place < b.place; });
  shell.radius = kShellDistance * at.extent;
  shell.on_sphere = count;
  const double spacing = shell.radius * std::sqrt(4 * std::numbers::pi / static_cast<double>(count));
  shell.cloud.Resize(count, options.sh_degree);
  std::fill(shell.cloud.quats.begin(), shell.cloud.quats.end(), 0.0f);
  std::fill(shell.cloud.sh.begin(), shell.cloud.sh.end(), 0.0f);
  int64_t rows = 0;
  for (size_t begin = 0; begin < samples.size();) {
    size_t end = begin;
    bool open = false;
    for (; end < samples.size() && samples[end].place == samples[begin].place; ++end) open |= samples[end].open;
    if (open || !decides) {
      AddGaussian(at, sphere[static_cast<size_t>(samples[begin].place)], std::log(spacing),
                  MedianColor(std::span(samples).subspan(begin, end - begin), open), rows++, shell.cloud);
    }
    begin = end;
  }
  if (rows == 0) {
    shell.cloud = {};
    return none("as no picture shows it");
  }
  std::vector<int64_t> made(static_cast<size_t>(rows));
  for (int64_t i = 0; i < rows; ++i) made[static_cast<size_t>(i)] = i;
  ANCHORSPLAT_ASSIGN_OR_RETURN(shell.cloud, Subset(shell.cloud, made));
  shell.units = {at.center, at.extent};
  shell.why = Cat(WithThousands(rows), " Gaussians at a distance of ", Fixed(shell.radius, 2), ", ",
                  decides ? Cat("as no points cover ", PercentText(shell.open_share), " of the pictures")
                          : std::string("as requested"));
  return shell;
}

Result<AddedShell> AddFarShell(const TrainingViews& views, const InitialPoints& start, std::optional<int64_t> count,
                               bool points_tell, FitOptions& options, GaussianCloud& initial) {
  AddedShell added;
  const int64_t most = options.strategy == Strategy::kMcmc ? options.mcmc.cap_max : options.densification.max_gaussians;
  ANCHORSPLAT_ASSIGN_OR_RETURN(added.shell, MakeFarShell(views, start,
                                                         {.count = count,
                                                          .points_tell = points_tell,
                                                          .background = options.objective.render.background,
                                                          .sh_degree = options.objective.render.sh_degree,
                                                          .max_gaussians = most}));
  added.gaussians = added.shell.cloud.size();
  if (added.gaussians > 0) {
    ANCHORSPLAT_RETURN_IF_ERROR(Append(initial, added.shell.cloud));
    options.far = added.shell.units;
    added.shell.cloud = {};
  }
  if (count != 0) LogInfo(Cat("far shell: ", added.shell.why));
  return added;
}

}  // namespace anchorsplat
