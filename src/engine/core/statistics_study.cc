#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/framing.h"
#include "core/quaternion_length.h"
#include "core/rank_search.h"
#include "core/statistics.h"
#include "core/stored_values.h"

namespace anchorsplat {

namespace {

// Columns with quantiles. Those of lengths and opacities use the stored logarithms and logits: the order is the same,
// and it saves two exponentials per Gaussian.
enum Column : size_t { kLargest, kSmallest, kRatio, kOpacity, kColumns };

constexpr float kEndless = std::numeric_limits<float>::infinity();
constexpr Bounds kNowhere = {{kEndless, kEndless, kEndless}, {-kEndless, -kEndless, -kEndless}};

void Widen(Bounds& box, const float* low, const float* high) {
  for (size_t a = 0; a < 3; ++a) {
    box.min[a] = std::min(box.min[a], low[a]);
    box.max[a] = std::max(box.max[a], high[a]);
  }
}

// Values of one block, one array per column.
struct Values {
  std::array<Buffer<float>, kColumns> columns;

  // Calls per_row(i) for usable rows.
  template <typename PerRow>
  void Take(const CloudBlock& block, PerRow&& per_row) {
    const auto rows = static_cast<size_t>(block.size());
    for (Buffer<float>& column : columns) {
      column.clear();
      column.reserve(rows);
    }
    for (size_t i = 0; i < rows; ++i) {
      if (block.usable[i] == 0) continue;
      per_row(i);
      columns[kOpacity].push_back(block.rows.opacity_logits[i]);
      const float* s = block.rows.log_scales.data() + 3 * i;
      const float low = std::min({s[0], s[1], s[2]}), high = std::max({s[0], s[1], s[2]});
      if (!std::isfinite(high)) continue;
      columns[kLargest].push_back(high);
      columns[kSmallest].push_back(low);
      if (std::isfinite(low)) columns[kRatio].push_back(high - low);
    }
  }
};

bool IsPlausible(const CloudView& cloud, size_t i) {
  static const float kLongest = std::log(kPlausibleExtent);
  const float* mean = cloud.means.data() + 3 * i;
  const float* scale = cloud.log_scales.data() + 3 * i;
  return std::all_of(mean, mean + 3, [](float x) { return std::fabs(x) <= kPlausibleExtent; }) &&
         std::all_of(scale, scale + 3, [](float x) { return x <= kLongest; });
}

float Between(float low, float high, double fraction) {
  if (fraction == 0 || low == high) return low;  // avoids Inf − Inf
  return static_cast<float>(low + fraction * (static_cast<double>(high) - low));
}

// Counters of one thread.
struct Tally {
  std::array<std::vector<uint32_t>, kColumns> counts;
  CloudStatistics sums;
  int64_t usable = 0;
  Values values;

  Tally() { counts.fill(std::vector<uint32_t>(RankSearch::kCoarse)); }

  void Add(const CloudBlock& block) {
    values.Take(block, [&](size_t i) { Count(block.rows, i); });
    for (size_t c = 0; c < kColumns; ++c) {
      for (const float value : values.columns[c]) ++counts[c][RankSearch::CoarseBin(value)];
    }
    sums.not_finite += block.size() - std::ssize(values.columns[kOpacity]);
  }

  void Count(const CloudView& rows, size_t i) {
    ++usable;
    if (!IsPlausible(rows, i)) ++sums.implausible;
    const double length = QuaternionLength(rows.quats.data() + 4 * i);
    if (length == 0) {
      ++sums.zero_quaternions;
    } else if (IsNotNormalised(length)) {
      ++sums.unnormalised_quaternions;
    }
    const float logit = rows.opacity_logits[i];
    if (logit < -5 && !IsOpaqueEnough(logit)) ++sums.invisible;  // ln(1/254) is −5.5
    const float* s = rows.log_scales.data() + 3 * i;
    const float low = std::min({s[0], s[1], s[2]});
    if (!std::isfinite(low)) ++sums.zero_scales;
  }
};

}  // namespace

struct StatisticsStudy::State {
  int pass = 0;
  const int64_t gaussians;
  int sh_degree = 0;
  std::mutex mutex;
  std::vector<std::unique_ptr<Tally>> tallies;  // not in use by a thread
  std::map<int64_t, StoredSample> samples;      // by first row of the block, so that threads do not matter
  std::vector<Bounds> bounds;                   // per block: −0 or 0 must not depend on threads
  std::vector<RankSearch> searches;             // one per column
  Tally sum;
  FramingStudy framing_study;
  Framing framing;
  std::atomic<int64_t> outliers = 0;

  explicit State(int64_t count) : gaussians(count), framing_study(count) {}

  std::unique_ptr<Tally> Borrow() {
    {
      const std::lock_guard lock(mutex);
      if (!tallies.empty()) {
        std::unique_ptr<Tally> tally = std::move(tallies.back());
        tallies.pop_back();
        return tally;
      }
    }
    return std::make_unique<Tally>();
  }
  void GiveBack(std::unique_ptr<Tally> tally) {
    const std::lock_guard lock(mutex);
    tallies.push_back(std::move(tally));
  }

  void CountBlock(const CloudBlock& block) {
    framing_study.Visit(block.first, block.rows);
    Bounds& box = bounds[static_cast<size_t>(block.first / kCloudBlockRows)];
    for (size_t i = 0; i < block.usable.size(); ++i) {
      if (block.usable[i] != 0) {
        const float* mean = block.rows.means.data() + 3 * i;
        Widen(box, mean, mean);
      }
    }
    std::unique_ptr<Tally> tally = Borrow();
    tally->Add(block);
    GiveBack(std::move(tally));
    TakeSample(block);
  }
  void TakeSample(const CloudBlock& block);
  StoredSample WholeSample() const;
  void SumUp();
  void RefineBlock(const CloudBlock& block);
  Percentiles PercentilesOf(Column column, float (*meaning)(float)) const;
};

void StatisticsStudy::State::TakeSample(const CloudBlock& block) {
  const int64_t step = StoredSample::Stride(gaussians);
  StoredSample sample;
  for (int64_t row = (block.first + step - 1) / step * step; row < block.first + block.size(); row += step) {
    sample.Add(block.rows, row - block.first);
  }
  if (sample.opacities.empty()) return;
  const std::lock_guard lock(mutex);
  samples.emplace(block.first, std::move(sample));
}

StoredSample StatisticsStudy::State::WholeSample() const {
  StoredSample whole;
  whole.total = gaussians;
  for (const auto& [first, part] : samples) {
    for (const auto array :
         {&StoredSample::means, &StoredSample::scales, &StoredSample::opacities, &StoredSample::colors}) {
      (whole.*array).insert((whole.*array).end(), (part.*array).begin(), (part.*array).end());
    }
  }
  return whole;
}

void StatisticsStudy::State::SumUp() {
  for (const std::unique_ptr<Tally>& tally : tallies) {
    for (size_t c = 0; c < kColumns; ++c) searches[c].Count(tally->counts[c]);
    for (int64_t CloudStatistics::*count :
         {&CloudStatistics::not_finite, &CloudStatistics::zero_quaternions, &CloudStatistics::unnormalised_quaternions,
          &CloudStatistics::zero_scales, &CloudStatistics::invisible, &CloudStatistics::implausible}) {
      sum.sums.*count += tally->sums.*count;
    }
    sum.usable += tally->usable;
  }
  tallies.clear();
  for (RankSearch& search : searches) search.EndCounting();
}

void StatisticsStudy::State::RefineBlock(const CloudBlock& block) {
  Values values;
  values.Take(block, [](size_t) {});
  for (size_t c = 0; c < kColumns; ++c) searches[c].Refine(values.columns[c]);
  int64_t far_out = 0;
  for (size_t i = 0; i < block.usable.size(); ++i) {
    far_out += block.usable[i] != 0 && IsFarOut(framing, block.rows.means.data() + 3 * i) ? 1 : 0;
  }
  outliers += far_out;
}

Percentiles StatisticsStudy::State::PercentilesOf(Column column, float (*meaning)(float)) const {
  Percentiles out;
  for (size_t k = 0; k < out.size(); ++k) {
    const RankSearch::Place place = searches[column].At(k);
    out[k] = Between(meaning(place.low), meaning(place.high), place.fraction);
  }
  return out;
}

StatisticsStudy::StatisticsStudy(const CloudBlocks& blocks) : state_(std::make_unique<State>(blocks.size())) {
  state_->sh_degree = blocks.sh_degree();
  state_->bounds.resize(static_cast<size_t>((blocks.size() + kCloudBlockRows - 1) / kCloudBlockRows), kNowhere);
  for (size_t c = 0; c < kColumns; ++c) state_->searches.emplace_back(kPercentiles);
}

StatisticsStudy::~StatisticsStudy() = default;

bool StatisticsStudy::done() const { return state_->pass >= 2; }

void StatisticsStudy::Visit(const CloudBlock& block) {
  if (state_->pass == 0) {
    state_->CountBlock(block);
  } else {
    state_->RefineBlock(block);
  }
}

void StatisticsStudy::EndPass() {
  if (state_->pass == 0) {
    state_->SumUp();
    state_->framing = state_->framing_study.Find();
  }
  ++state_->pass;
}

CloudStatistics StatisticsStudy::Find() const {
  const State& s = *state_;
  CloudStatistics out = s.sum.sums;
  out.gaussians = s.gaussians;
  out.sh_degree = s.sh_degree;
  Bounds all = kNowhere;
  for (const Bounds& box : s.bounds) Widen(all, box.min.data(), box.max.data());
  if (all.min[0] <= all.max[0]) out.bounds = all;
  const auto exp = [](float x) { return std::exp(x); };
  out.largest_axis = s.PercentilesOf(kLargest, exp);
  out.smallest_axis = s.PercentilesOf(kSmallest, exp);
  out.axis_ratio = s.PercentilesOf(kRatio, exp);
  out.opacity = s.PercentilesOf(kOpacity, [](float x) { return Sigmoid(x); });
  out.outliers = s.outliers;

  const StoredSample sample = s.WholeSample();
  out.linear_looking_scales = LooksLikeLengths(sample);
  out.linear_looking_opacities = LooksLikeOpacities(sample);
  out.color_looking_harmonics = LooksLikeColors(sample);
  return out;
}

CloudStatistics ComputeStatistics(const CloudView& cloud) {
  MemoryBlocks blocks(cloud);
  StatisticsStudy study(blocks);
  RowStudy* const studies[] = {&study};
  (void)Study(blocks, studies);  // memory can be read
  return study.Find();
}

}  // namespace anchorsplat
