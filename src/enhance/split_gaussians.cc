#include "enhance/split_gaussians.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/rotation.h"
#include "core/text.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {
constexpr int64_t kRowsPerTask = 4096;
constexpr int64_t kMostRows = int64_t{1} << 31;
}  // namespace

Result<GaussianCloud> SplitGaussians(const GaussianCloud& cloud, const SplitOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (options.copies < 1 || cloud.size() > kMostRows / std::max(1, options.copies)) {
    return Error{ErrorCode::kBadArgument, Cat(WithThousands(cloud.size()), " Gaussians cannot become ", options.copies,
                                              " each; at least 1, and 2^31 in all")};
  }
  if (!(options.spread >= 0 && options.shrink >= 0)) {
    return Error{ErrorCode::kBadArgument, "copies of Gaussians need a spread and a shrink of 0 or more"};
  }
  if (options.copies == 1) return cloud;
  const int64_t n = cloud.size(), copies = options.copies, stride = cloud.sh_stride();
  const auto shorter = static_cast<float>(0.5 * std::log(static_cast<double>(copies)) * options.shrink);
  GaussianCloud out;
  out.Resize(n * copies, cloud.sh_degree);
  out.render_mode = cloud.render_mode;
  out.comments = cloud.comments;
  ParallelFor(0, n, kRowsPerTask, [&](int64_t first, int64_t last) {
    Random random = RandomStream(options.seed, RandomPurpose::kCopies, first / kRowsPerTask);
    for (int64_t i = first; i < last; ++i) {
      const float* q = cloud.quats.data() + 4 * i;
      const float* s = cloud.log_scales.data() + 3 * i;
      const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
      for (int64_t k = i * copies; k < (i + 1) * copies; ++k) {
        double along[3];
        for (size_t a = 0; a < 3; ++a) along[a] = options.spread * std::exp(double{s[a]}) * random.Normal();
        for (size_t a = 0; a < 3; ++a) {
          out.means[static_cast<size_t>(3 * k) + a] =
              static_cast<float>(cloud.means[static_cast<size_t>(3 * i) + a] + r[3 * a] * along[0] +
                                 r[3 * a + 1] * along[1] + r[3 * a + 2] * along[2]);
          out.log_scales[static_cast<size_t>(3 * k) + a] = s[a] - shorter;
        }
        std::copy_n(q, 4, out.quats.data() + 4 * k);
        out.opacity_logits[static_cast<size_t>(k)] = cloud.opacity_logits[static_cast<size_t>(i)];
        std::copy_n(cloud.sh.data() + stride * i, stride, out.sh.data() + stride * k);
      }
    }
  });
  return out;
}

}  // namespace anchorsplat
