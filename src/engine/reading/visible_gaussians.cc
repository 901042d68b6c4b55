#include "reading/visible_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "reading/nearest_gaussians.h"

namespace anchorsplat {

namespace {

constexpr float kNearlyBlack = 0.04f;  // brightest DC channel; ten steps of 255
constexpr double kLargestAxis = 0.25;  // of central Gaussians, in radii that frame the cloud

std::array<float, 3> MiddleOf(const Framing& framing) {
  return {static_cast<float>(framing.target[0]), static_cast<float>(framing.target[1]),
          static_cast<float>(framing.target[2])};
}

// ln of the longest axis that a central Gaussian may have.
double LongestOf(const Framing& framing) { return std::log(kLargestAxis * framing.radius); }

bool IsLonger(const CloudView& rows, size_t i, double longest) {
  const float* scales = rows.log_scales.data() + 3 * i;
  return !(std::max({scales[0], scales[1], scales[2]}) <= longest);
}

// Collects CentralGaussians.
class CentralSearch {
 public:
  explicit CentralSearch(const Framing& framing) : framing_(framing), longest_(LongestOf(framing)) {}

  void Visit(const CloudBlock& block) {
    std::vector<NearestGaussians::Item> near;
    for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) {
      double distance = 0;
      for (size_t a = 0; a < 3; ++a) {
        const double d = block.rows.means[3 * i + a] - framing_.target[a];
        distance += d * d;
      }
      if (!(distance <= nearest_.farthest()) || !(std::sqrt(distance) <= kMaxVisibleDistance * framing_.radius))
        continue;
      if (IsLonger(block.rows, i, longest_) || block.usable[i] == 0) continue;
      near.push_back(NearestGaussians::ItemOf(distance, block.first + static_cast<int64_t>(i), block.rows, i));
    }
    nearest_.Add(near);
  }

  CentralGaussians Take() {
    std::optional<double> next;
    CentralGaussians out;
    out.cloud = nearest_.Take(&next, &out.rows);
    out.framing = framing_;
    if (next) out.reach = std::sqrt(*next);
    return out;
  }

 private:
  Framing framing_;
  double longest_;
  NearestGaussians nearest_{kMaxVisible};
};

}  // namespace

bool IsNearlyBlack(const CloudView& rows, size_t i) {
  const float* sh = rows.sh.data() + rows.sh_stride() * static_cast<int64_t>(i);
  return ColorFromDc(std::max({sh[0], sh[1], sh[2]})) < kNearlyBlack;
}

bool ShowsInPictures(const CloudView& cloud, size_t i) {
  return Sigmoid(cloud.opacity_logits[i]) >= kVisibleOpacity && !IsNearlyBlack(cloud, i);
}

double SquaredDistance(const float* a, const float* b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (double{a[k]} - double{b[k]}) * (double{a[k]} - double{b[k]});
  return sum;
}

struct VisibleGaussiansStudy::State {
  explicit State(int64_t gaussians) : framing_study(std::make_unique<FramingStudy>(gaussians)) {}

  int pass = 0;
  // First pass: finds the cloud's centre. Second pass: collects what lies there.
  std::unique_ptr<FramingStudy> framing_study;
  Framing framing;
  NearestGaussians all{kMaxVisible};
  std::unique_ptr<CentralSearch> central;

  void LookForShowing(const CloudBlock& block);
};

void VisibleGaussiansStudy::State::LookForShowing(const CloudBlock& block) {
  const std::array<float, 3> middle = MiddleOf(framing);
  const double longest = LongestOf(framing);
  std::vector<NearestGaussians::Item> near;
  for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) {
    if (block.usable[i] == 0) continue;
    const double distance = SquaredDistance(block.rows.means.data() + 3 * i, middle.data());
    if (distance > all.farthest() || std::sqrt(distance) > kMaxVisibleDistance * framing.radius) continue;
    if (Sigmoid(block.rows.opacity_logits[i]) < kVisibleOpacity || IsLonger(block.rows, i, longest)) continue;
    near.push_back(NearestGaussians::ItemOf(distance, block.first + static_cast<int64_t>(i), block.rows, i));
  }
  all.Add(near);
}

VisibleGaussiansStudy::VisibleGaussiansStudy(const CloudBlocks& blocks)
    : state_(std::make_unique<State>(blocks.size())) {}
VisibleGaussiansStudy::~VisibleGaussiansStudy() = default;

bool VisibleGaussiansStudy::done() const { return state_->pass >= 2; }

void VisibleGaussiansStudy::Visit(const CloudBlock& block) {
  if (state_->pass == 0) {
    state_->framing_study->Visit(block.first, block.rows);
  } else {
    state_->LookForShowing(block);
    state_->central->Visit(block);
  }
}

void VisibleGaussiansStudy::EndPass() {
  State& s = *state_;
  if (s.pass == 0) {
    s.framing = s.framing_study->Find();
    s.framing_study.reset();
    s.central = std::make_unique<CentralSearch>(s.framing);
  }
  ++s.pass;
}

VisibleGaussians VisibleGaussiansStudy::Take() {
  VisibleGaussians out;
  out.cloud = state_->all.Take(nullptr, &out.rows);
  out.central = state_->central->Take();
  return out;
}

VisibleGaussians FindVisibleGaussians(const CloudView& cloud) {
  MemoryBlocks blocks(cloud);
  VisibleGaussiansStudy study(blocks);
  RowStudy* const studies[] = {&study};
  (void)Study(blocks, studies);  // cannot fail in memory
  return study.Take();
}

}  // namespace anchorsplat
