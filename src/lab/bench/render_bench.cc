#include "bench/render_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/camera.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/text.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

// Per pixel, for one Gaussian on a 4×4 block: 5 for the exponent, 5 for the exponential, 2 for weight and
// transmittance, 3 for the colour.
constexpr double kBlendMultiplications = 15;
constexpr double kBlockPixels = 16;
constexpr double kProjectedBytes = 64 + 8;  // written per Gaussian: record and tile range

struct Measurement {
  double seconds = 0;
  RenderStatistics mean;  // per picture
};

Result<Measurement> RenderAll(Rasterizer& rasterizer, const GaussianCloud& cloud, const CameraSet& set,
                              RenderOutput& output) {
  Measurement m;
  const double n = static_cast<double>(set.cameras.size());
  double visible = 0, pairs = 0, evaluations = 0;
  for (const Camera& camera : set.cameras) {
    const auto start = std::chrono::steady_clock::now();
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, {}, output));
    m.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / n;
    const RenderStatistics& s = rasterizer.statistics();
    m.mean.project += s.project / n;
    m.mean.spherical_harmonics += s.spherical_harmonics / n;
    m.mean.sort += s.sort / n;
    m.mean.bin += s.bin / n;
    m.mean.blend += s.blend / n;
    visible += static_cast<double>(s.visible) / n;
    pairs += static_cast<double>(s.pairs) / n;
    evaluations += static_cast<double>(s.evaluations) / n;
  }
  m.mean.visible = std::llround(visible);
  m.mean.pairs = std::llround(pairs);
  m.mean.evaluations = std::llround(evaluations);
  return m;
}

Result<RenderBenchRow> BenchOne(const GaussianCloud& cloud, const std::string& scene, int width,
                                const RenderBenchOptions& options, const MachineLimits& limits) {
  const double fov = options.fov_degrees * std::numbers::pi / 180;
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const CameraSet set, OrbitCameras(options.poses, options.radius, {0, 0, 0}, PinholeFromFov(width, width, fov)));
  Rasterizer rasterizer;
  RenderOutput output;
  Measurement best;
  best.seconds = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat <= options.repeats; ++repeat) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Measurement m, RenderAll(rasterizer, cloud, set, output));
    if (repeat > 0 && m.seconds < best.seconds) best = m;  // the first run allocates
  }
  RenderBenchRow row;
  row.scene = scene;
  row.gaussians = cloud.size();
  row.width = width;
  row.ms = 1e3 * best.seconds;
  row.project_ms = 1e3 * best.mean.project;
  row.spherical_harmonics_ms = 1e3 * best.mean.spherical_harmonics;
  row.sort_ms = 1e3 * best.mean.sort;
  row.bin_ms = 1e3 * best.mean.bin;
  row.blend_ms = 1e3 * best.mean.blend;
  row.visible = best.mean.visible;
  row.pairs = best.mean.pairs;
  row.evaluations = best.mean.evaluations;
  const double multiplications = static_cast<double>(row.evaluations) * kBlockPixels * kBlendMultiplications;
  row.blend_of_fma_limit = multiplications / best.mean.blend / limits.fma_per_second;
  const double bytes = static_cast<double>(cloud.bytes()) + kProjectedBytes * static_cast<double>(cloud.size());
  row.project_of_memory_limit = bytes / (best.mean.project + best.mean.spherical_harmonics) / limits.bytes_per_second;
  return row;
}

}  // namespace

GaussianCloud SplitGaussians(const GaussianCloud& cloud, int factor, uint64_t seed) {
  GaussianCloud out;
  out.Resize(cloud.size() * factor, cloud.sh_degree);
  out.render_mode = cloud.render_mode;
  const float shrink = static_cast<float>(std::log(static_cast<double>(factor)) / 3);
  Random random(seed);
  const size_t stride = static_cast<size_t>(cloud.sh_stride());
  size_t to = 0;
  for (size_t i = 0; i < static_cast<size_t>(cloud.size()); ++i) {
    const float* q = &cloud.quats[4 * i];
    const auto rotation = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
    for (int part = 0; part < factor; ++part, ++to) {
      std::array<double, 3> offset;
      for (size_t a = 0; a < 3; ++a) offset[a] = std::exp(double{cloud.log_scales[3 * i + a]}) * random.Normal();
      for (size_t a = 0; a < 3; ++a) {
        const double* r = &rotation[3 * a];
        out.means[3 * to + a] =
            static_cast<float>(cloud.means[3 * i + a] + r[0] * offset[0] + r[1] * offset[1] + r[2] * offset[2]);
        out.log_scales[3 * to + a] = cloud.log_scales[3 * i + a] - shrink;
      }
      std::copy_n(q, 4, &out.quats[4 * to]);
      out.opacity_logits[to] = cloud.opacity_logits[i];
      std::copy_n(&cloud.sh[stride * i], stride, &out.sh[stride * to]);
    }
  }
  return out;
}

Result<RenderBenchReport> BenchRender(const GaussianCloud& cloud, const std::string& scene,
                                      const RenderBenchOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (cloud.empty()) return Error{ErrorCode::kBadArgument, Cat(scene, ": no Gaussians to render")};
  if (options.repeats < 1 || options.split < 1 || !(options.fov_degrees > 0 && options.fov_degrees < 180)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("render benchmark: repeats ", options.repeats, ", split ", options.split, ", field of view ",
                     options.fov_degrees, "°; needs at least 1, at least 1, and between 0 and 180")};
  }
  if (cloud.size() > std::numeric_limits<int32_t>::max() / options.split) {
    return Error{ErrorCode::kBadArgument,
                 Cat(scene, ": split ", options.split, "-fold, these are more Gaussians than ", "can be drawn")};
  }
  // Rejects bad options before anything slow.
  const auto orbit = OrbitCameras(options.poses, options.radius, {0, 0, 0}, PinholeFromFov(1, 1, 1));
  if (!orbit.ok()) return orbit.error();
  RenderBenchReport report;
  report.limits = MeasureMachineLimits();
  for (const int width : {256, 1024}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(RenderBenchRow row, BenchOne(cloud, scene, width, options, report.limits));
    report.rows.push_back(std::move(row));
  }
  const GaussianCloud split = SplitGaussians(cloud, options.split, options.seed);
  ANCHORSPLAT_ASSIGN_OR_RETURN(RenderBenchRow row,
                               BenchOne(split, Cat(scene, " x", options.split), 1024, options, report.limits));
  report.rows.push_back(std::move(row));
  return report;
}

}  // namespace anchorsplat
