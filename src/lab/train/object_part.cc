#include "train/object_part.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/constants.h"

namespace anchorsplat {

namespace {

// Minimum side of windows in pixels: SSIM needs some, and smaller ones show little besides the spot.
constexpr int kLeastSide = 64;
// Visible extent of a Gaussian in standard deviations: an opaque one falls below 1/255 at 3.33.
constexpr double kReach = 3.4;
// Added to it for filter, dilation and cropping, pixels.
constexpr double kMargin = 4;

struct Projected {
  double x = 0, y = 0;  // pixels
  double reach = 0;     // pixels
  bool in_front = false;
};

// σ along the longest axis, world units.
double LongestAxis(const GaussianCloud& cloud, int64_t row) {
  const float* scales = cloud.log_scales.data() + 3 * row;
  return std::exp(double{std::max({scales[0], scales[1], scales[2]})});
}

Projected Project(const GaussianCloud& cloud, int64_t row, double size, const Camera& camera) {
  const float* m = cloud.means.data() + 3 * row;
  const std::array<double, 3> p = camera.ToCamera({m[0], m[1], m[2]});
  if (!(p[2] > double{kNear})) return {};
  const Pinhole& pinhole = camera.intrinsics;
  const double x = p[0] / p[2], y = p[1] / p[2];
  // Off-axis, a sphere's projection is elongated.
  const double stretch = std::sqrt(1 + x * x + y * y);
  return {pinhole.fx * x + pinhole.cx, pinhole.fy * y + pinhole.cy,
          kReach * std::max(pinhole.fx, pinhole.fy) * size / p[2] * stretch + kMargin, true};
}

bool Inside(const Projected& p, const PixelBox& window, double reach) {
  return p.in_front && p.x + reach >= window.x0 && p.x - reach < window.x1 && p.y + reach >= window.y0 &&
         p.y - reach < window.y1;
}

PixelBox WindowAround(double x, double y, const Pinhole& pinhole, int side) {
  const int w = side > 0 ? std::min(side, pinhole.width) : pinhole.width;
  const int h = side > 0 ? std::min(side, pinhole.height) : pinhole.height;
  const auto begin = [](double center, int extent, int limit) {
    return static_cast<int>(std::clamp(center - extent / 2.0, 0.0, static_cast<double>(limit - extent)));
  };
  const int x0 = begin(x, w, pinhole.width), y0 = begin(y, h, pinhole.height);
  return {x0, y0, x0 + w, y0 + h};
}

// Finds windows of `side` around the spot in each view, and the Gaussians visible there.
void Look(const GaussianCloud& cloud, std::span<const Camera> cameras, const SeenGaussians& seen, int64_t spot,
          int side, ObjectPart& part) {
  part.windows.clear();
  part.wanted.clear();
  part.others.clear();
  for (const size_t view : part.views) {
    const Pinhole& pinhole = cameras[view].intrinsics;
    const Projected p = Project(cloud, spot, 0, cameras[view]);
    part.windows.push_back(p.in_front ? WindowAround(p.x, p.y, pinhole, side)
                                      : WindowAround(pinhole.width / 2.0, pinhole.height / 2.0, pinhole, side));
  }

  for (int64_t i = 0; i < cloud.size(); ++i) {
    bool wanted = false, shows = false;
    const double size = LongestAxis(cloud, i);
    for (size_t v = 0; v < part.views.size() && !wanted; ++v) {
      const Projected p = Project(cloud, i, size, cameras[part.views[v]]);
      shows = shows || Inside(p, part.windows[v], p.reach);
      wanted = seen.In(part.views[v], i) && Inside(p, part.windows[v], 0);
    }
    wanted = wanted || i == spot;  // a view may show it without its centre
    if (wanted) {
      part.wanted.push_back(i);
    } else if (shows) {
      part.others.push_back(i);
    }
  }
}

}  // namespace

PixelBox RandomWindow(int width, int height, const PixelBox& object, int side, Random& random) {
  const int w = std::min(side, width), h = std::min(side, height);
  const PixelBox where = object.empty() ? PixelBox{0, 0, width, height} : object;
  const auto place = [&](int begin, int end, int extent, int limit) {
    const int center = begin + static_cast<int>(random.Below(end - begin));
    return std::clamp(center - extent / 2, 0, limit - extent);
  };
  const int x = place(where.x0, where.x1, w, width), y = place(where.y0, where.y1, h, height);
  return {x, y, x + w, y + h};
}

ObjectPart ChoosePart(const GaussianCloud& cloud, std::span<const Camera> cameras, std::span<const size_t> order,
                      const SeenGaussians& seen, const PartRequest& request, Random& random) {
  ObjectPart part;
  const int64_t n = cloud.size();
  if (order.empty() || n == 0) return part;
  std::vector<int64_t> candidates;
  for (int64_t i = 0; i < n; ++i) {
    if (seen.In(order[0], i)) candidates.push_back(i);
  }
  const int64_t draw = random.Below(candidates.empty() ? n : static_cast<int64_t>(candidates.size()));
  const int64_t spot = candidates.empty() ? draw : candidates[static_cast<size_t>(draw)];

  part.views.assign(order.begin(), order.end());
  std::stable_partition(part.views.begin() + 1, part.views.end(), [&](size_t view) { return seen.In(view, spot); });
  part.views.resize(std::min(part.views.size(), request.views));
  // Where Gaussians are dense, windows shrink. Gaussians beyond `most` are drawn filtered, and a window full of those
  // would show the network's own behind a haze that does not exist in use.
  int side = request.side;
  Look(cloud, cameras, seen, spot, side, part);
  while (side > kLeastSide && static_cast<int64_t>(part.wanted.size()) > request.most) {
    const double share = static_cast<double>(request.most) / static_cast<double>(part.wanted.size());
    side = std::max(kLeastSide, static_cast<int>(side * std::clamp(std::sqrt(share), 0.5, 0.95)));
    Look(cloud, cameras, seen, spot, side, part);
  }
  if (static_cast<int64_t>(part.wanted.size()) > request.most) {
    const float* at = cloud.means.data() + 3 * spot;
    const auto nearer = [&](int64_t a, int64_t b) {
      const auto square = [&](int64_t i) {
        const float* m = cloud.means.data() + 3 * i;
        double sum = 0;
        for (int c = 0; c < 3; ++c) sum += (double{m[c]} - at[c]) * (double{m[c]} - at[c]);
        return sum;
      };
      const double first = square(a), second = square(b);
      return first != second ? first < second : a < b;
    };
    const auto middle = part.wanted.begin() + request.most;
    std::nth_element(part.wanted.begin(), middle, part.wanted.end(), nearer);
    part.others.insert(part.others.end(), middle, part.wanted.end());
    part.wanted.erase(middle, part.wanted.end());
    std::sort(part.wanted.begin(), part.wanted.end());
    std::sort(part.others.begin(), part.others.end());
  }
  return part;
}

}  // namespace anchorsplat
