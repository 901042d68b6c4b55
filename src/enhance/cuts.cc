#include "enhance/cuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/run_context.h"
#include "core/vector3.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

constexpr int64_t kMostSamples = 20'000;
constexpr int64_t kLeastSamples = 64;
constexpr int kRays = 512;       // to look for faces of the hull along; one each 0.025 sr
constexpr int kMostRounds = 40;  // until a face is found; a dozen are usual
constexpr int kRaysPerTask = 64;
constexpr double kOnFace = 1e-5;  // of a face's distance: a point this near lies in it
constexpr int kBallDraws = 400;
constexpr double kLargestBall = 4;   // radii, in units of the cloud's
constexpr double kBallSlack = 0.02;  // how far beyond a ball hull points may lie, to look at it closer
// Of the Gaussians whose centres lie less than 4 of their standard deviations inside, an eighth are within ½ at a cut,
// as anywhere else. Where a surface ends by itself it is 5 % at most; what chance makes of that is allowed for.
constexpr double kNear = 0.5, kFar = 4;
constexpr double kShareOfEnds = 0.05, kMore = 3;
constexpr double kMoreOfBalls = 5;  // one of very many that were tried
// More than a fifth, and a bit for chance, is a straight edge that the face of the hull leans on.
constexpr double kMostShare = 0.2, kMoreOfEdges = 1.5;
// So many within ½, and this share of all: a few large ones on the outside are no cut, and a cut of few makes few
// outlines.
constexpr int64_t kLeastNear = 12;
constexpr double kLeastNearShare = 0.005;
// Those that lie flat in it do not count, by their deviation across it in units of their middle axis: they are a face.
constexpr double kLying = 0.5;

double Variance(const GaussianCloud& cloud, size_t i, const Vec3& n) {
  const float* q = cloud.quats.data() + 4 * i;
  const std::array<double, 9> r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  double sum = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double along = r[a] * n[0] + r[3 + a] * n[1] + r[6 + a] * n[2];
    const double scale = std::exp(double{cloud.log_scales[3 * i + a]});
    sum += along * along * scale * scale;
  }
  return sum;
}

// Centres in units of the cloud's radius, seen from its middle.
struct Sample {
  std::vector<float> x, y, z;
  std::vector<int64_t> rows;
  std::vector<double> largest, middle_axis;
  std::vector<bool> left;  // at a cut that was found
  Vec3 middle{};
  double radius = 0;

  size_t size() const { return rows.size(); }
  Vec3 At(size_t k) const { return {x[k], y[k], z[k]}; }
};

Sample TakeSample(const GaussianCloud& cloud) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) >= kShowingOpacity) rows.push_back(i);
  }
  Sample sample;
  const auto count = static_cast<int64_t>(rows.size());
  const int64_t taken = std::min(count, kMostSamples);
  for (int64_t k = 0; k < taken; ++k) sample.rows.push_back(rows[static_cast<size_t>(k * count / taken)]);
  for (const int64_t i : sample.rows) {
    for (size_t a = 0; a < 3; ++a) sample.middle[a] += cloud.means[static_cast<size_t>(3 * i) + a];
  }
  for (double& m : sample.middle) m /= static_cast<double>(std::max<int64_t>(1, taken));
  for (const int64_t i : sample.rows) {
    double squares = 0;
    for (size_t a = 0; a < 3; ++a) {
      squares += std::pow(cloud.means[static_cast<size_t>(3 * i) + a] - sample.middle[a], 2);
    }
    sample.radius = std::max(sample.radius, std::sqrt(squares));
  }
  if (!(sample.radius > 0)) return {};
  sample.left.resize(sample.rows.size());
  for (const int64_t i : sample.rows) {
    const auto at = static_cast<size_t>(3 * i);
    const auto part = [&](size_t a) {
      return static_cast<float>((cloud.means[at + a] - sample.middle[a]) / sample.radius);
    };
    sample.x.push_back(part(0));
    sample.y.push_back(part(1));
    sample.z.push_back(part(2));
    std::array<float, 3> axes;
    std::copy_n(cloud.log_scales.data() + at, 3, axes.begin());
    std::ranges::sort(axes);
    sample.middle_axis.push_back(std::exp(double{axes[1]}) / sample.radius);
    sample.largest.push_back(std::exp(double{axes[2]}) / sample.radius);
  }
  return sample;
}

// Farthest of the sample along `n`.
size_t Farthest(const Sample& sample, const Vec3& n) {
  const auto a = static_cast<float>(n[0]), b = static_cast<float>(n[1]), c = static_cast<float>(n[2]);
  constexpr size_t kLanes = 16;
  std::array<float, kLanes> best;
  best.fill(-std::numeric_limits<float>::infinity());
  const size_t count = sample.size();
  size_t k = 0;
  for (; k + kLanes <= count; k += kLanes) {
    for (size_t l = 0; l < kLanes; ++l) {
      const float value = a * sample.x[k + l] + b * sample.y[k + l] + c * sample.z[k + l];
      best[l] = value > best[l] ? value : best[l];
    }
  }
  float most = *std::ranges::max_element(best);
  for (; k < count; ++k) most = std::max(most, a * sample.x[k] + b * sample.y[k] + c * sample.z[k]);
  for (k = 0; k < count; ++k) {
    if (a * sample.x[k] + b * sample.y[k] + c * sample.z[k] >= most) return k;
  }
  return 0;
}

// The same of some of the sample; 0 for none.
size_t FarthestOf(const Sample& sample, std::span<const size_t> some, const Vec3& n) {
  double most = -std::numeric_limits<double>::infinity();
  size_t best = 0;
  for (const size_t k : some) {
    const double value = Dot(sample.At(k), n);
    if (value <= most) continue;
    most = value;
    best = k;
  }
  return best;
}

struct Bound {  // g · y ≤ most
  Vec3 g;
  double most;
};

std::optional<Vec3> Meeting(const Bound& a, const Bound& b, const Bound& c) {
  const Vec3 bc = Cross(b.g, c.g);
  const double volume = Dot(a.g, bc);
  if (std::abs(volume) < 1e-12) return std::nullopt;
  const Vec3 ca = Cross(c.g, a.g), ab = Cross(a.g, b.g);
  Vec3 y;
  for (size_t k = 0; k < 3; ++k) y[k] = (a.most * bc[k] + b.most * ca[k] + c.most * ab[k]) / volume;
  return y;
}

struct Face {
  Vec3 normal;      // unit
  double distance;  // from the middle
};

// The face of the hull that the ray from the middle along `ray` passes: of all planes y · x = 1 with every point at
// y · x ≤ 1 the one with the largest y · ray. Bounds are added where a point violates them most. Corners of the face go
// to `corners`. `outer`: points that bounded other rays, tried before the whole sample is; those of this one are added.
std::optional<Face> FaceAlong(const Sample& sample, const Vec3& ray, std::vector<size_t>& outer,
                              std::vector<size_t>& corners) {
  constexpr double kSteepest = 1e3;
  std::vector<Bound> bounds;
  Vec3 y;
  for (size_t a = 0; a < 3; ++a) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 g{};
      g[a] = sign;
      bounds.push_back({g, kSteepest});
    }
    y[a] = ray[a] < 0 ? -kSteepest : kSteepest;
  }
  std::vector<size_t> points;
  for (int round = 0; round < kMostRounds; ++round) {
    size_t next = FarthestOf(sample, outer, y);
    if (outer.empty() || Dot(sample.At(next), y) <= 1 + kOnFace) next = Farthest(sample, y);
    const Bound added{sample.At(next), 1};
    if (Dot(added.g, y) <= 1 + kOnFace) {
      const double length = std::sqrt(Dot(y, y));
      if (length > 0.5 * kSteepest) return std::nullopt;  // the middle lies on the hull
      for (size_t p = 0; p < points.size(); ++p) {
        if (Dot(bounds[6 + p].g, y) > 1 - kOnFace) corners.push_back(points[p]);
      }
      return Face{{y[0] / length, y[1] / length, y[2] / length}, 1 / length};
    }
    double best = -std::numeric_limits<double>::infinity();
    std::optional<Vec3> at;
    for (size_t i = 0; i < bounds.size(); ++i) {
      for (size_t j = i + 1; j < bounds.size(); ++j) {
        const std::optional<Vec3> corner = Meeting(added, bounds[i], bounds[j]);
        if (!corner || Dot(*corner, ray) <= best) continue;
        const bool allowed = std::ranges::all_of(
            bounds, [&](const Bound& b) { return Dot(b.g, *corner) <= b.most + 1e-7 * (1 + std::abs(b.most)); });
        if (!allowed) continue;
        best = Dot(*corner, ray);
        at = corner;
      }
    }
    if (!at) return std::nullopt;
    bounds.push_back(added);
    points.push_back(next);
    if (std::ranges::find(outer, next) == outer.end()) outer.push_back(next);
    y = *at;
  }
  return std::nullopt;
}

Vec3 Ray(int k) {
  const double up = 1 - 2 * (k + 0.5) / kRays, ring = std::sqrt(1 - up * up);
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
  return {ring * std::cos(turn), up, ring * std::sin(turn)};
}

struct Evidence {
  int64_t near = 0, far = 0, all = 0;

  bool Convinces(double more = kMore) const {
    const double ends = kShareOfEnds * static_cast<double>(far), edges = kMostShare * static_cast<double>(far);
    if (static_cast<double>(near) > edges + kMoreOfEdges * std::sqrt(edges)) return false;
    return near >= kLeastNear && static_cast<double>(near) >= kLeastNearShare * static_cast<double>(all) &&
           static_cast<double>(near) > ends + more * std::sqrt(ends) + more;
  }
};

// `depth_of` (k) → distance to the cut in units of the radius and direction across it.
template <typename DepthOf>
Evidence CountNear(const GaussianCloud& cloud, const Sample& sample, DepthOf&& depth_of) {
  Evidence evidence;
  evidence.all = static_cast<int64_t>(sample.size());
  for (size_t k = 0; k < sample.size(); ++k) {
    const std::pair<double, Vec3> at = depth_of(k);
    if (sample.left[k] || at.first > kFar * sample.largest[k]) continue;
    const double deviation = std::sqrt(Variance(cloud, static_cast<size_t>(sample.rows[k]), at.second)) / sample.radius;
    if (deviation < kLying * sample.middle_axis[k] || !(at.first < kFar * deviation)) continue;
    ++evidence.far;
    if (at.first < kNear * deviation) ++evidence.near;
  }
  return evidence;
}

Evidence NearAndFar(const GaussianCloud& cloud, const Sample& sample, const Face& face) {
  return CountNear(cloud, sample, [&](size_t k) {
    return std::pair(std::max(0.0, face.distance - Dot(face.normal, sample.At(k))), face.normal);
  });
}

struct Ball {
  Vec3 middle;
  double radius;
};

std::optional<Ball> BallThrough(const std::array<Vec3, 4>& p) {
  std::array<Bound, 3> planes;
  for (size_t k = 0; k < 3; ++k) {
    const Vec3 d = Minus(p[k + 1], p[0]);
    planes[k] = {d, 0.5 * Dot(d, d)};
  }
  const std::optional<Vec3> to = Meeting(planes[0], planes[1], planes[2]);
  if (!to) return std::nullopt;
  return Ball{{p[0][0] + (*to)[0], p[0][1] + (*to)[1], p[0][2] + (*to)[2]}, std::sqrt(Dot(*to, *to))};
}

double Away(const Ball& ball, const Vec3& p) {
  const Vec3 d = Minus(p, ball.middle);
  return std::sqrt(Dot(d, d));
}

Evidence NearAndFar(const GaussianCloud& cloud, const Sample& sample, const Ball& ball) {
  return CountNear(cloud, sample, [&](size_t k) {
    const Vec3 out = Minus(sample.At(k), ball.middle);
    const double away = std::max(1e-30, std::sqrt(Dot(out, out)));
    return std::pair(std::max(0.0, ball.radius - away), Vec3{out[0] / away, out[1] / away, out[2] / away});
  });
}

void Leave(const GaussianCloud& cloud, const Cut& cut, Sample& sample) {
  for (size_t k = 0; k < sample.size(); ++k) {
    if (cut.Depth(cloud, sample.rows[k]) < kCutReach) sample.left[k] = true;
  }
}

std::optional<Ball> FindBall(const GaussianCloud& cloud, const Sample& sample, std::span<const size_t> hull) {
  if (hull.size() < 16) return std::nullopt;
  Random random(1);
  std::optional<Ball> best;
  Evidence most;
  for (int draw = 0; draw < kBallDraws; ++draw) {
    std::array<Vec3, 4> p;
    for (Vec3& corner : p) {
      corner = sample.At(hull[static_cast<size_t>(random.Below(static_cast<int64_t>(hull.size())))]);
    }
    std::optional<Ball> ball = BallThrough(p);
    if (!ball || !(ball->radius < kLargestBall)) continue;
    double farthest = 0;
    for (const size_t k : hull) farthest = std::max(farthest, Away(*ball, sample.At(k)));
    if (farthest > (1 + kBallSlack) * ball->radius) continue;
    ball->radius = farthest;
    const Evidence evidence = NearAndFar(cloud, sample, *ball);
    if (evidence.near > most.near) {
      most = evidence;
      best = ball;
    }
  }
  return most.Convinces(kMoreOfBalls) ? best : std::nullopt;
}

}  // namespace

double Cut::Depth(const GaussianCloud& cloud, int64_t i) const {
  const auto row = static_cast<size_t>(i);
  const Vec3 at = {cloud.means[3 * row], cloud.means[3 * row + 1], cloud.means[3 * row + 2]};
  Vec3 across = direction;
  double depth = reach - Dot(direction, at);
  if (ball) {
    across = Minus(at, direction);
    const double away = std::sqrt(Dot(across, across));
    depth = reach - away;
    if (away > 0) {
      for (double& a : across) a /= away;
    }
  }
  const double deviation = std::sqrt(Variance(cloud, row, across));
  return deviation > 0 ? depth / deviation : std::numeric_limits<double>::infinity();
}

std::vector<Cut> FindCuts(const GaussianCloud& cloud) {
  LeaveIfAbandoned();
  Sample sample = TakeSample(cloud);
  if (static_cast<int64_t>(sample.size()) < kLeastSamples) return {};
  std::vector<std::optional<Face>> along(kRays);
  std::vector<std::vector<size_t>> corners(kRays);
  ParallelFor(0, kRays, kRaysPerTask, [&](int64_t first, int64_t last) {
    std::vector<size_t> outer;
    for (int64_t k = first; k < last; ++k) {
      along[static_cast<size_t>(k)] =
          FaceAlong(sample, Ray(static_cast<int>(k)), outer, corners[static_cast<size_t>(k)]);
    }
  });
  std::vector<Face> faces;
  std::vector<size_t> hull;
  for (size_t k = 0; k < along.size(); ++k) {
    hull.insert(hull.end(), corners[k].begin(), corners[k].end());
    if (!along[k]) continue;
    const auto known = [&](const Face& f) { return Dot(f.normal, along[k]->normal) > 1 - 1e-9; };
    if (std::ranges::none_of(faces, known)) faces.push_back(*along[k]);
  }
  std::ranges::sort(hull);
  hull.erase(std::unique(hull.begin(), hull.end()), hull.end());
  std::vector<Evidence> evidence(faces.size());
  ParallelFor(0, static_cast<int64_t>(faces.size()), 8, [&](int64_t first, int64_t last) {
    for (int64_t k = first; k < last; ++k) {
      evidence[static_cast<size_t>(k)] = NearAndFar(cloud, sample, faces[static_cast<size_t>(k)]);
    }
  });
  std::vector<size_t> order(faces.size());
  for (size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return evidence[a].near > evidence[b].near; });
  // The strongest first; what lies at one cut is no evidence of another.
  std::vector<Cut> cuts;
  for (const size_t k : order) {
    if (!evidence[k].Convinces()) continue;
    const Face& face = faces[k];
    if (!cuts.empty() && !NearAndFar(cloud, sample, face).Convinces()) continue;
    cuts.push_back({false, face.normal, face.distance * sample.radius + Dot(face.normal, sample.middle)});
    Leave(cloud, cuts.back(), sample);
  }
  const std::optional<Ball> ball = FindBall(cloud, sample, hull);
  if (ball) {
    Cut cut{true, {}, ball->radius * sample.radius};
    for (size_t a = 0; a < 3; ++a) cut.direction[a] = sample.middle[a] + ball->middle[a] * sample.radius;
    cuts.push_back(cut);
  }
  return cuts;
}

}  // namespace anchorsplat
