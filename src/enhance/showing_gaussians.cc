#include "enhance/showing_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "enhance/nearest_gaussians.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

constexpr float kNearlyBlack = 0.04f;  // brightest channel of the constant colour; ten steps of 255
constexpr double kFewBlack = 0.01;     // share of the Gaussians below which black ones cannot move an outline
constexpr double kLargestAxis = 0.25;  // of Gaussians that tell, in units of the radius that frames the cloud

bool IsBlack(const CloudView& rows, size_t i) {
  const float* sh = rows.sh.data() + rows.sh_stride() * static_cast<int64_t>(i);
  return ColorFromDc(std::max({sh[0], sh[1], sh[2]})) < kNearlyBlack;
}

std::array<float, 3> MiddleOf(const Framing& framing) {
  return {static_cast<float>(framing.target[0]), static_cast<float>(framing.target[1]),
          static_cast<float>(framing.target[2])};
}

// Collects TellingGaussians.
class TellingSearch {
 public:
  explicit TellingSearch(const Framing& framing)
      : framing_(framing), longest_(std::log(kLargestAxis * framing.radius)) {}

  // Those rows for which `counts` holds; usable ones.
  template <typename Counts>
  void Look(const CloudBlock& block, Counts&& counts) {
    std::vector<NearestGaussians::Item> near;
    for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) {
      double distance = 0;
      for (size_t a = 0; a < 3; ++a) {
        const double d = block.rows.means[3 * i + a] - framing_.target[a];
        distance += d * d;
      }
      if (!(distance <= nearest_.farthest()) || !(std::sqrt(distance) <= kShowingFarthest * framing_.radius)) continue;
      const float* scales = block.rows.log_scales.data() + 3 * i;
      if (!(std::max({scales[0], scales[1], scales[2]}) <= longest_) || !counts(i)) continue;
      near.push_back(NearestGaussians::ItemOf(distance, block.first + static_cast<int64_t>(i), block.rows, i));
    }
    nearest_.Add(near);
  }

  TellingGaussians Take() {
    std::optional<double> next;
    TellingGaussians out;
    out.cloud = nearest_.Take(&next, &out.rows);
    out.framing = framing_;
    if (next) out.reach = std::sqrt(*next);
    return out;
  }

 private:
  Framing framing_;
  double longest_;
  NearestGaussians nearest_{kMostShowing};
};

}  // namespace

bool ShowsInPictures(const CloudView& cloud, size_t i) {
  return Sigmoid(cloud.opacity_logits[i]) >= kShowingOpacity && !IsBlack(cloud, i);
}

double SquaredDistance(const float* a, const float* b) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) sum += (double{a[k]} - double{b[k]}) * (double{a[k]} - double{b[k]});
  return sum;
}

struct ShowingStudy::State {
  explicit State(int64_t gaussians)
      : size(gaussians),
        framing_study(std::make_unique<FramingStudy>(gaussians)),
        not_black_before(static_cast<size_t>((gaussians + kCloudBlockRows - 1) / kCloudBlockRows + 1)) {}

  int64_t size;
  int pass = 0;
  // The first time: where the middle of the cloud is, and how many usable Gaussians of each block are not black.
  std::unique_ptr<FramingStudy> framing_study;
  std::vector<int64_t> not_black_before;  // [blocks + 1], then of all blocks before
  // The second time.
  Framing framing;
  NearestGaussians all{kMostShowing}, bright{kMostShowing};
  std::unique_ptr<TellingSearch> telling;
  std::unique_ptr<FramingStudy> not_black_framing;  // nothing where few are black
  // The third time.
  std::unique_ptr<TellingSearch> telling_not_black;

  static bool IsNotBlack(const CloudBlock& block, size_t i) { return block.usable[i] != 0 && !IsBlack(block.rows, i); }
  void CountNotBlack(const CloudBlock& block);
  void LookForShowing(const CloudBlock& block);
  void FrameNotBlack(const CloudBlock& block);
};

void ShowingStudy::State::CountNotBlack(const CloudBlock& block) {
  int64_t count = 0;
  for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) count += IsNotBlack(block, i) ? 1 : 0;
  not_black_before[static_cast<size_t>(block.first / kCloudBlockRows) + 1] = count;
}

void ShowingStudy::State::LookForShowing(const CloudBlock& block) {
  const std::array<float, 3> middle = MiddleOf(framing);
  std::vector<NearestGaussians::Item> near, near_bright;
  for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) {
    if (block.usable[i] == 0) continue;
    const double distance = SquaredDistance(block.rows.means.data() + 3 * i, middle.data());
    if (distance > std::max(all.farthest(), bright.farthest())) continue;
    if (std::sqrt(distance) > kShowingFarthest * framing.radius) continue;
    if (Sigmoid(block.rows.opacity_logits[i]) < kShowingOpacity) continue;
    const auto item = NearestGaussians::ItemOf(distance, block.first + static_cast<int64_t>(i), block.rows, i);
    if (distance <= all.farthest()) near.push_back(item);
    if (distance <= bright.farthest() && !IsBlack(block.rows, i)) near_bright.push_back(item);
  }
  all.Add(near);
  bright.Add(near_bright);
}

void ShowingStudy::State::FrameNotBlack(const CloudBlock& block) {
  GaussianCloud kept;
  kept.Resize(block.size(), 0);
  int64_t count = 0;
  for (size_t i = 0; i < static_cast<size_t>(block.size()); ++i) {
    if (!IsNotBlack(block, i)) continue;
    std::copy_n(block.rows.means.data() + 3 * i, 3, kept.means.data() + 3 * count);
    std::copy_n(block.rows.log_scales.data() + 3 * i, 3, kept.log_scales.data() + 3 * count);
    std::copy_n(block.rows.quats.data() + 4 * i, 4, kept.quats.data() + 4 * count);
    kept.opacity_logits[static_cast<size_t>(count++)] = block.rows.opacity_logits[i];
  }
  kept.Resize(count, 0);
  not_black_framing->Look(not_black_before[static_cast<size_t>(block.first / kCloudBlockRows)], kept);
}

ShowingStudy::ShowingStudy(const CloudBlocks& blocks) : state_(std::make_unique<State>(blocks.size())) {}
ShowingStudy::~ShowingStudy() = default;

bool ShowingStudy::done() const { return state_->pass >= (state_->not_black_framing ? 3 : 2); }

void ShowingStudy::Look(const CloudBlock& block) {
  State& s = *state_;
  if (s.pass == 0) {
    s.framing_study->Look(block.first, block.rows);
    s.CountNotBlack(block);
  } else if (s.pass == 1) {
    s.LookForShowing(block);
    s.telling->Look(block, [&](size_t i) { return block.usable[i] != 0; });
    if (s.not_black_framing) s.FrameNotBlack(block);
  } else {
    s.telling_not_black->Look(block, [&](size_t i) { return State::IsNotBlack(block, i); });
  }
}

void ShowingStudy::EndPass() {
  State& s = *state_;
  if (s.pass == 0) {
    s.framing = s.framing_study->Find();
    s.framing_study.reset();
    s.telling = std::make_unique<TellingSearch>(s.framing);
    for (size_t k = 1; k < s.not_black_before.size(); ++k) s.not_black_before[k] += s.not_black_before[k - 1];
    const int64_t not_black = s.not_black_before.back();
    if (static_cast<double>(s.size - not_black) > kFewBlack * static_cast<double>(s.size)) {
      s.not_black_framing = std::make_unique<FramingStudy>(not_black);
    }
  } else if (s.pass == 1 && s.not_black_framing) {
    s.telling_not_black = std::make_unique<TellingSearch>(s.not_black_framing->Find());
  }
  ++s.pass;
}

ShowingGaussians ShowingStudy::Take() {
  State& s = *state_;
  ShowingGaussians out;
  const size_t bright = s.bright.count();
  out.bright = s.bright.Take();
  out.all = s.all.Take(nullptr, &out.rows_of_all);
  if (bright < static_cast<size_t>(kLeastGaussians)) out.bright = out.all;
  out.telling = s.telling->Take();
  if (s.telling_not_black) out.telling_not_black = s.telling_not_black->Take();
  return out;
}

ShowingGaussians FindShowingGaussians(const CloudView& cloud) {
  MemoryBlocks blocks(cloud);
  ShowingStudy study(blocks);
  RowStudy* const studies[] = {&study};
  (void)Study(blocks, studies);  // memory can be read
  return study.Take();
}

TellingGaussians FindTellingGaussians(const CloudView& cloud) {
  LeaveIfAbandoned();
  TellingSearch search(FrameMeans(cloud));
  MemoryBlocks blocks(cloud);
  (void)blocks.ForEach(
      [&](const CloudBlock& block) { search.Look(block, [&](size_t i) { return block.usable[i] != 0; }); });
  return search.Take();
}

}  // namespace anchorsplat
