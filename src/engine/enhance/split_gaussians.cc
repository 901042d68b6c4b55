#include "enhance/split_gaussians.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/rotation.h"
#include "core/text.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {
constexpr int64_t kSplitRowsPerTask = 4096;
constexpr int64_t kMostRows = int64_t{1} << 31;
constexpr int kDoublings = 64, kHalvings = 40;
}  // namespace

Result<GaussianCloud> SplitGaussians(const GaussianCloud& cloud, const SplitOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const int64_t n = cloud.size(), copies = options.copies, stride = cloud.sh_stride();
  const bool uneven = !options.each.empty();
  if (copies < 1 || n > kMostRows / std::max<int64_t>(1, copies)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(WithThousands(n), " Gaussians cannot become ", copies, " each; at least 1, and 2^31 in all")};
  }
  if (uneven && (std::ssize(options.each) != n || *std::min_element(options.each.begin(), options.each.end()) < 1)) {
    return Error{ErrorCode::kBadArgument, "every Gaussian needs a number of copies of its own, at least 1"};
  }
  if (!(options.spread >= 0 && options.shrink >= 0)) {
    return Error{ErrorCode::kBadArgument, "copies of Gaussians need a spread and a shrink of 0 or more"};
  }
  if (copies == 1 && !uneven) return cloud;
  Buffer<int64_t> first_row(static_cast<size_t>(n) + 1);
  first_row[0] = 0;
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    first_row[i + 1] = first_row[i] + (uneven ? options.each[i] : copies);
  }
  if (first_row.back() > kMostRows) {
    return Error{ErrorCode::kBadArgument, Cat(WithThousands(first_row.back()), " Gaussians are more than 2^31")};
  }
  GaussianCloud out;
  out.Resize(first_row.back(), cloud.sh_degree);
  out.render_mode = cloud.render_mode;
  out.comments = cloud.comments;
  ParallelFor(0, n, kSplitRowsPerTask, [&](int64_t first, int64_t last) {
    Random random = RandomStream(options.seed, RandomPurpose::kCopies, first / kSplitRowsPerTask);
    for (int64_t i = first; i < last; ++i) {
      const float* q = cloud.quats.data() + 4 * i;
      const float* s = cloud.log_scales.data() + 3 * i;
      const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
      const int64_t begin = first_row[static_cast<size_t>(i)], end = first_row[static_cast<size_t>(i) + 1];
      const auto shorter = static_cast<float>(0.5 * std::log(static_cast<double>(end - begin)) * options.shrink);
      const double spread = end - begin > 1 ? options.spread : 0;
      for (int64_t k = begin; k < end; ++k) {
        double along[3];
        for (size_t a = 0; a < 3; ++a) along[a] = spread * std::exp(double{s[a]}) * random.Normal();
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

std::vector<int> CopiesByResidual(std::span<const double> residuals, int copies, int64_t all) {
  std::vector<int> each(residuals.size(), copies);
  const auto fill = [&](double factor) {
    int64_t sum = 0;
    for (size_t i = 0; i < each.size(); ++i) {
      const double wanted = std::round(factor * std::sqrt(std::max(0.0, residuals[i])));
      each[i] = static_cast<int>(std::clamp(wanted, 1.0, double{kMostShare} * copies));
      sum += each[i];
    }
    return sum;
  };
  // Bisection: the total increases with the factor.
  double largest = 0;
  for (const double residual : residuals) largest = std::max(largest, residual);
  if (!(largest > 0) || !std::isfinite(largest)) return each;
  double low = 0, high = 1 / std::sqrt(largest);
  for (int i = 0; i < kDoublings && fill(high) < all; ++i) high *= 2;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (fill(middle) > all ? high : low) = middle;
  }
  fill(low);
  return each;
}

}  // namespace anchorsplat
