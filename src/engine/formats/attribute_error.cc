#include "formats/attribute_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kGrain = 1 << 14;
constexpr float kLowestLogScale = -20;

struct Sum {
  double squares = 0;
  double max = 0;
  int64_t values = 0;

  void Add(double difference) {
    squares += difference * difference;
    max = std::max(max, std::fabs(difference));
    ++values;
  }
  void Add(const Sum& other) {
    squares += other.squares;
    max = std::max(max, other.max);
    values += other.values;
  }
  Deviation Result() const { return {values > 0 ? std::sqrt(squares / static_cast<double>(values)) : 0.0, max}; }
};

struct Sums {
  std::array<Sum, 6> attribute;  // in the order of AttributeError
  int64_t compared = 0;
};

double AngleBetween(const float* p, const float* q) {
  const auto unit = [](const float* from) {
    std::array<double, 4> out = {from[0], from[1], from[2], from[3]};
    const double norm = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3]);
    if (!(norm > 0)) return std::array<double, 4>{1, 0, 0, 0};
    for (double& x : out) x /= norm;
    return out;
  };
  const std::array<double, 4> a = unit(p), b = unit(q);
  // From the chord, as the arc cosine loses half of the digits near 1.
  double minus = 0, plus = 0;
  for (size_t k = 0; k < 4; ++k) {
    minus += (a[k] - b[k]) * (a[k] - b[k]);
    plus += (a[k] + b[k]) * (a[k] + b[k]);
  }
  return 4 * std::asin(std::min(1.0, std::sqrt(std::min(minus, plus)) / 2));
}

// `apart`: difference of their positions.
void CompareRow(const CloudView& a, int64_t i, const CloudView& b, int64_t j, const std::array<double, 3>& apart,
                Sums& sums) {
  double distance = 0;
  for (int k = 0; k < 3; ++k) {
    distance += apart[static_cast<size_t>(k)] * apart[static_cast<size_t>(k)];
    sums.attribute[1].Add(double{std::max(kLowestLogScale, a.log_scales[static_cast<size_t>(3 * i + k)])} -
                          double{std::max(kLowestLogScale, b.log_scales[static_cast<size_t>(3 * j + k)])});
  }
  sums.attribute[0].Add(std::sqrt(distance));
  sums.attribute[2].Add(AngleBetween(a.quats.data() + 4 * i, b.quats.data() + 4 * j));
  sums.attribute[3].Add(double{Sigmoid(a.opacity_logits[static_cast<size_t>(i)])} -
                        double{Sigmoid(b.opacity_logits[static_cast<size_t>(j)])});
  const float* p = a.sh.data() + i * a.sh_stride();
  const float* q = b.sh.data() + j * b.sh_stride();
  for (int64_t k = 0; k < std::max(a.sh_stride(), b.sh_stride()); ++k) {
    const double difference = (k < a.sh_stride() ? double{p[k]} : 0) - (k < b.sh_stride() ? double{q[k]} : 0);
    if (k < 3) {
      sums.attribute[4].Add(double{kSh0} * difference);
    } else {
      sums.attribute[5].Add(difference);
    }
  }
  ++sums.compared;
}

}  // namespace

Result<AttributeError> CompareAttributes(const CloudView& a, const CloudView& b, const Buffer<uint32_t>& rows,
                                         const Buffer<double>& world_b, const Buffer<double>& world_a) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(a));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(b));
  if (a.size() != b.size() || (!rows.empty() && rows.size() != static_cast<size_t>(a.size()))) {
    return Error{ErrorCode::kBadArgument, Cat("clouds of ", WithThousands(a.size()), " and ", WithThousands(b.size()),
                                              " Gaussians cannot be compared row by row")};
  }
  std::vector<Sums> parts(static_cast<size_t>((a.size() + kGrain - 1) / kGrain));
  ParallelFor(0, a.size(), kGrain, [&](int64_t first, int64_t last) {
    Sums& sums = parts[static_cast<size_t>(first / kGrain)];
    for (int64_t i = first; i < last; ++i) {
      const int64_t j = rows.empty() ? i : int64_t{rows[static_cast<size_t>(i)]};
      if (j >= b.size() || !IsUsable(a, i) || !IsUsable(b, j)) continue;
      std::array<double, 3> difference{};
      for (size_t k = 0; k < 3; ++k) {
        const auto at_a = static_cast<size_t>(3 * i) + k, at_b = static_cast<size_t>(3 * j) + k;
        if (world_a.empty()) {
          // Relative to a's origin, which is exact if both have the same.
          const double from_origin =
              world_b.empty() ? (b.origin[k] - a.origin[k]) + double{b.means[at_b]} : world_b[at_b] - a.origin[k];
          difference[k] = double{a.means[at_a]} - from_origin;
        } else {
          difference[k] = world_a[at_a] - (world_b.empty() ? b.origin[k] + double{b.means[at_b]} : world_b[at_b]);
        }
      }
      CompareRow(a, i, b, j, difference, sums);
    }
  });
  Sums total;
  for (const Sums& part : parts) {
    for (size_t k = 0; k < total.attribute.size(); ++k) total.attribute[k].Add(part.attribute[k]);
    total.compared += part.compared;
  }
  AttributeError error;
  error.compared = total.compared;
  error.left_out = a.size() - total.compared;
  Deviation* const deviations[] = {&error.means,     &error.log_scales, &error.rotations,
                                   &error.opacities, &error.colors,     &error.harmonics};
  for (size_t k = 0; k < total.attribute.size(); ++k) *deviations[k] = total.attribute[k].Result();
  return error;
}

std::string FormatAttributeError(const AttributeError& error) {
  std::ostringstream out;
  out.precision(3);
  const auto line = [&out](const char* name, const Deviation& deviation, double factor, const char* unit) {
    out << "  " << name << "  rms " << deviation.rms * factor << ", max " << deviation.max * factor << unit << "\n";
  };
  line("means      ", error.means, 1, " world units");
  line("log-scales ", error.log_scales, 1, "");
  line("rotations  ", error.rotations, 180 / 3.14159265358979323846, " degrees");
  line("opacities  ", error.opacities, 1, "");
  line("colours    ", error.colors, 1, "");
  line("harmonics  ", error.harmonics, 1, "");
  if (error.left_out > 0) out << "  " << WithThousands(error.left_out) << " invisible Gaussians left out\n";
  return std::move(out).str();
}

}  // namespace anchorsplat
