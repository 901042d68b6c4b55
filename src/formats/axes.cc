#include "formats/axes.h"

#include <cctype>

#include "core/parallel.h"
#include "core/world_up.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kPositive = "rdf";
constexpr std::string_view kNegative = "lub";

// Coordinates that each SH basis function is odd in: 1 = x, 2 = y, 4 = z.
constexpr std::array<int, 16> kOddIn = {0, 2, 4, 1, 3, 6, 0, 5, 0, 2, 7, 2, 4, 1, 4, 1};

}  // namespace

std::optional<Axes> AxesFromName(std::string_view name) {
  if (name.size() != 3) return std::nullopt;
  Axes axes;
  for (size_t k = 0; k < 3; ++k) {
    const char letter = static_cast<char>(std::tolower(static_cast<unsigned char>(name[k])));
    if (letter != kPositive[k] && letter != kNegative[k]) return std::nullopt;
    axes.sign[k] = letter == kPositive[k] ? 1.0f : -1.0f;
  }
  return axes;
}

std::string NameOfAxes(const Axes& axes) {
  std::string name;
  for (size_t k = 0; k < 3; ++k) {
    name += static_cast<char>(std::toupper(static_cast<unsigned char>((axes.sign[k] > 0 ? kPositive : kNegative)[k])));
  }
  return name;
}

AxisFlip FlipBetween(const Axes& from, const Axes& to) {
  AxisFlip flip{};
  std::array<float, 3>& s = flip.mean;
  for (size_t k = 0; k < 3; ++k) s[k] = from.sign[k] * to.sign[k];
  flip.quat = {1, s[1] * s[2], s[0] * s[2], s[0] * s[1]};
  for (size_t k = 0; k < 16; ++k) {
    flip.sh[k] = 1;
    for (size_t a = 0; a < 3; ++a) {
      if ((kOddIn[k] >> a & 1) != 0) flip.sh[k] *= s[a];
    }
  }
  return flip;
}

void FlipAxes(GaussianCloud& cloud, const AxisFlip& flip) {
  if (flip.changes_nothing()) return;
  FlipUp(flip.mean, cloud.comments);
  for (size_t k = 0; k < 3; ++k) cloud.origin[k] *= flip.mean[k];
  ParallelFor(0, cloud.size(), 1 << 14, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      float* mean = cloud.means.data() + 3 * i;
      for (size_t k = 0; k < 3; ++k) mean[k] *= flip.mean[k];
      float* quat = cloud.quats.data() + 4 * i;
      for (size_t k = 0; k < 4; ++k) quat[k] *= flip.quat[k];
      float* sh = cloud.sh.data() + i * cloud.sh_stride();
      for (int64_t k = 0; k < cloud.sh_stride(); ++k) sh[k] *= flip.sh[static_cast<size_t>(k / 3)];
    }
  });
}

}  // namespace anchorsplat
