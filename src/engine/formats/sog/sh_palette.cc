#include "formats/sog/sh_palette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <vector>

#include "core/parallel.h"
#include "formats/sog/nearest_centroid.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMaxWidth = 48;
constexpr int64_t kPaletteGrain = 1 << 13;
constexpr int64_t kBranches = 64;          // approximate number of independent branches
constexpr int64_t kSmallBranch = 1 << 14;  // smaller sets are not worth a branch
constexpr int32_t kSteps = 2047;

// Centroids that a vector chooses from: more in small sets, where comparisons are cheap.
int64_t GroupEntries(int64_t count) { return std::clamp((int64_t{1} << 24) / count, int64_t{256}, int64_t{4096}); }

// SH vectors of a cloud as rows of `width` int16, zero beyond `values`. Computed on access, as a copy of all would take
// 40 % of the cloud.
struct Vectors {
  CloudView cloud;
  float scale = 0;  // factor to 12 bits
  int64_t count = 0, width = 0, values = 0;

  void Copy(int64_t row, int16_t* out) const {
    const float* sh = cloud.sh.data() + row * cloud.sh_stride() + 3;
    constexpr float kMost = kSteps;
    for (int64_t k = 0; k < values; ++k) {  // vectorizable
      const float number = sh[k] == sh[k] ? sh[k] * scale : 0.0f;
      const float below = number < kMost ? number : kMost;
      const float bounded = below > -kMost ? below : -kMost;
      out[k] = static_cast<int16_t>(static_cast<int32_t>(bounded + (bounded < 0 ? -0.5f : 0.5f)));
    }
    for (int64_t k = values; k < width; ++k) out[k] = 0;
  }
};

float SpreadOf(const CloudView& cloud) {
  const int64_t parts = (cloud.size() + kPaletteGrain - 1) / kPaletteGrain;
  std::vector<std::array<double, 2>> sums(static_cast<size_t>(parts));  // sum of squares, largest
  ParallelFor(0, cloud.size(), kPaletteGrain, [&](int64_t first, int64_t last) {
    std::array<double, 2>& sum = sums[static_cast<size_t>(first / kPaletteGrain)];
    for (int64_t i = first; i < last; ++i) {
      const float* sh = cloud.sh.data() + i * cloud.sh_stride();
      for (int64_t k = 3; k < cloud.sh_stride(); ++k) {
        if (!std::isfinite(sh[k])) continue;
        sum[0] += double{sh[k]} * double{sh[k]};
        sum[1] = std::max(sum[1], double{std::fabs(sh[k])});
      }
    }
  });
  double squares = 0, largest = 0;
  for (const auto& sum : sums) {
    squares += sum[0];
    largest = std::max(largest, sum[1]);
  }
  const double values = static_cast<double>(cloud.size() * (cloud.sh_stride() - 3));
  return static_cast<float>(std::min(largest, 64 * std::sqrt(squares / values)));
}

Vectors VectorsOf(const CloudView& cloud, float spread) {
  Vectors out;
  out.cloud = cloud;
  out.scale = spread > 0 ? static_cast<float>(kSteps) / spread : 0;
  out.count = cloud.size();
  out.values = cloud.sh_stride() - 3;
  out.width = (out.values + 15) / 16 * 16;
  return out;
}

// A part of a set of vectors: indices[begin … end).
struct Part {
  int64_t begin = 0, end = 0;
  double squares = 0;  // Σ |x − mean|²
  int64_t left = -1;   // index of its first half; the second follows it
};

// Splits parts of a set by reordering indices. `Rows` provides row(index): a pointer to `width` numbers, valid until
// the next call.
template <typename Rows>
class Splitter {
 public:
  Splitter(const Rows& rows, int64_t width) : rows_(rows), width_(width) {}

  // Sum of squared distances to the mean; also computes mean and main direction for Split().
  double Measure(const uint32_t* indices, int64_t count) {
    std::array<int64_t, kMaxWidth> sums{}, squares{};
    for (int64_t begin = 0; begin < count; begin += kBlock) {
      std::array<int32_t, kMaxWidth> sum{}, square{};  // 256 · 2047² fits
      for (int64_t i = begin; i < std::min(begin + kBlock, count); ++i) {
        const int16_t* x = rows_(indices[i]);
        for (int64_t k = 0; k < width_; ++k) {
          sum[static_cast<size_t>(k)] += x[k];
          square[static_cast<size_t>(k)] += int32_t{x[k]} * x[k];
        }
      }
      for (size_t k = 0; k < kMaxWidth; ++k) {
        sums[k] += sum[k];
        squares[k] += square[k];
      }
    }
    double total = 0, largest = -1;
    for (size_t k = 0; k < static_cast<size_t>(width_); ++k) {
      const double mean = static_cast<double>(sums[k]) / static_cast<double>(count);
      const double scatter = static_cast<double>(squares[k]) - mean * static_cast<double>(sums[k]);
      mean_[k] = static_cast<float>(mean);
      total += std::max(0.0, scatter);
      if (scatter > largest) {
        largest = scatter;
        widest_ = k;
      }
    }
    // Rounding must not make a set of equal vectors look worth splitting.
    return total < 0.25 ? 0 : total;
  }

  // Partitions the indices into two halves; returns the size of the first (0 < size < count if Measure, called just
  // before, is positive).
  int64_t Split(uint32_t* indices, int64_t count) {
    // One power iteration from the widest coordinate: its row of the covariance.
    std::array<double, kMaxWidth> direction{};
    for (int64_t begin = 0; begin < count; begin += kBlock) {
      std::array<float, kMaxWidth> sum{};
      for (int64_t i = begin; i < std::min(begin + kBlock, count); ++i) {
        const int16_t* x = rows_(indices[i]);
        const float factor = static_cast<float>(x[widest_]) - mean_[widest_];
        for (size_t k = 0; k < static_cast<size_t>(width_); ++k) {
          sum[k] += factor * (static_cast<float>(x[k]) - mean_[k]);
        }
      }
      for (size_t k = 0; k < kMaxWidth; ++k) direction[k] += static_cast<double>(sum[k]);
    }
    double norm = 0;
    for (const double x : direction) norm += x * x;
    std::array<float, kMaxWidth> unit{};
    for (size_t k = 0; k < kMaxWidth; ++k) unit[k] = static_cast<float>(direction[k] / std::sqrt(norm));
    const auto is_first = [&](uint32_t index) {
      const int16_t* x = rows_(index);
      float dot = 0;
      for (size_t k = 0; k < static_cast<size_t>(width_); ++k) dot += unit[k] * (static_cast<float>(x[k]) - mean_[k]);
      return dot > 0;
    };
    int64_t size = std::stable_partition(indices, indices + count, is_first) - indices;
    if (size == 0 || size == count) {
      // After rounding or for a zero direction: the widest coordinate always separates some.
      size = std::stable_partition(
                 indices, indices + count,
                 [&](uint32_t index) { return static_cast<float>(rows_(index)[widest_]) > mean_[widest_]; }) -
             indices;
    }
    return size;
  }

 private:
  static constexpr int64_t kBlock = 256;

  Rows rows_;
  int64_t width_;
  std::array<float, kMaxWidth> mean_{};
  size_t widest_ = 0;
};

// Rows computed from the cloud.
class CloudRows {
 public:
  explicit CloudRows(const Vectors& all) : all_(&all) {}
  const int16_t* operator()(uint32_t index) {
    all_->Copy(index, row_.data());
    return row_.data();
  }

 private:
  const Vectors* all_;
  std::array<int16_t, kMaxWidth> row_{};
};

// Copied rows, for repeated access.
struct CopiedRows {
  const int16_t* first;
  int64_t width;
  const int16_t* operator()(uint32_t index) const { return first + int64_t{index} * width; }
};

// An independent branch: the tree of its splits in the order they were made.
struct Branch {
  std::vector<uint32_t> rows;     // of the cloud
  std::vector<uint32_t> indices;  // into `rows`
  std::vector<Part> parts;
  std::vector<double> gains;   // of the 1st, 2nd, … split: non-increasing
  std::vector<int64_t> split;  // the part that was split
  int64_t kept = 0;            // number of splits used
  int64_t first_entry = 0;     // first of its kept + 1 centroids

  void Grow(const Vectors& all, int64_t max_leaves) {
    const auto count = static_cast<int64_t>(rows.size());
    Buffer<int16_t> vectors(static_cast<size_t>(count * all.width));
    for (int64_t i = 0; i < count; ++i) all.Copy(rows[static_cast<size_t>(i)], vectors.data() + i * all.width);
    indices.resize(rows.size());
    std::iota(indices.begin(), indices.end(), 0u);
    Splitter splitter(CopiedRows{vectors.data(), all.width}, all.width);
    parts.push_back({0, count, splitter.Measure(indices.data(), count)});
    const auto smaller = [this](int64_t a, int64_t b) {
      const double x = parts[static_cast<size_t>(a)].squares, y = parts[static_cast<size_t>(b)].squares;
      return x != y ? x < y : a > b;
    };
    std::priority_queue<int64_t, std::vector<int64_t>, decltype(smaller)> queue(smaller);
    queue.push(0);
    while (!queue.empty() && static_cast<int64_t>(gains.size()) + 1 < max_leaves) {
      const int64_t at = queue.top();
      const Part part = parts[static_cast<size_t>(at)];
      if (part.squares <= 0) break;
      queue.pop();
      uint32_t* begin = indices.data() + part.begin;
      splitter.Measure(begin, part.end - part.begin);
      const int64_t middle = part.begin + splitter.Split(begin, part.end - part.begin);
      if (middle == part.begin || middle == part.end) continue;
      const auto left = static_cast<int64_t>(parts.size());
      parts[static_cast<size_t>(at)].left = left;
      for (const auto& [from, to] : {std::pair(part.begin, middle), std::pair(middle, part.end)}) {
        // A half never exceeds the whole; enforced against rounding, as gains must be non-increasing.
        const double squares = std::min(part.squares, splitter.Measure(indices.data() + from, to - from));
        parts.push_back({from, to, squares});
        queue.push(static_cast<int64_t>(parts.size()) - 1);
      }
      gains.push_back(part.squares);
      split.push_back(at);
    }
  }

  // Leaves of the tree of the first `kept` splits, in groups of up to `most` that form a subtree.
  struct Group {
    int64_t begin, end;           // indices
    std::vector<int64_t> leaves;  // parts
  };
  std::vector<Group> Groups(int64_t most) const {
    std::vector<char> is_split(parts.size(), 0);
    for (int64_t k = 0; k < kept; ++k) is_split[static_cast<size_t>(split[static_cast<size_t>(k)])] = 1;
    std::vector<int64_t> leaves(parts.size(), 1);
    for (auto k = static_cast<size_t>(kept); k-- > 0;) {  // children are split after their parents
      const auto part = static_cast<size_t>(split[k]);
      const auto left = static_cast<size_t>(parts[part].left);
      leaves[part] = leaves[left] + leaves[left + 1];
    }
    std::vector<Group> groups;
    std::vector<int64_t> stack = {0};
    while (!stack.empty()) {
      const auto at = static_cast<size_t>(stack.back());
      stack.pop_back();
      if (leaves[at] > most) {
        stack.push_back(parts[at].left + 1);
        stack.push_back(parts[at].left);
        continue;
      }
      Group group{parts[at].begin, parts[at].end, {}};
      std::vector<int64_t> inner = {static_cast<int64_t>(at)};
      while (!inner.empty()) {
        const auto part = static_cast<size_t>(inner.back());
        inner.pop_back();
        if (is_split[part] == 0) {
          group.leaves.push_back(static_cast<int64_t>(part));
          continue;
        }
        inner.push_back(parts[part].left + 1);
        inner.push_back(parts[part].left);
      }
      groups.push_back(std::move(group));
    }
    return groups;
  }
};

// Splits the set into parts of at most about 1/kBranches.
std::vector<Branch> Branches(const Vectors& all) {
  std::vector<uint32_t> indices(static_cast<size_t>(all.count));
  std::iota(indices.begin(), indices.end(), 0u);
  const int64_t target = std::max(kSmallBranch, all.count / kBranches);
  std::vector<Part> waiting = {{0, all.count}}, done;
  for (int level = 0; level < 32 && !waiting.empty(); ++level) {
    std::vector<std::array<Part, 2>> halves(waiting.size());
    ParallelFor(0, static_cast<int64_t>(waiting.size()), 1, [&](int64_t first, int64_t last) {
      for (int64_t k = first; k < last; ++k) {
        const Part part = waiting[static_cast<size_t>(k)];
        Splitter splitter(CloudRows(all), all.width);
        uint32_t* begin = indices.data() + part.begin;
        const int64_t count = part.end - part.begin;
        const int64_t middle =
            splitter.Measure(begin, count) > 0 ? part.begin + splitter.Split(begin, count) : part.end;
        halves[static_cast<size_t>(k)] = {Part{part.begin, middle}, Part{middle, part.end}};
      }
    });
    waiting.clear();
    for (const auto& pair : halves) {
      for (const Part& part : pair) {
        if (part.begin == part.end) continue;
        const bool whole = pair[0].begin == pair[0].end || pair[1].begin == pair[1].end;
        (whole || part.end - part.begin <= target ? done : waiting).push_back(part);
      }
    }
  }
  done.insert(done.end(), waiting.begin(), waiting.end());
  std::vector<Branch> branches(done.size());
  for (size_t b = 0; b < done.size(); ++b) {
    branches[b].rows.assign(indices.begin() + done[b].begin, indices.begin() + done[b].end);
  }
  return branches;
}

// Distributes the entries: the splits with the largest gains over all branches are used. Returns the number of
// centroids.
int64_t KeepBestSplits(std::vector<Branch>& branches, int64_t entries) {
  struct Gain {
    double gain;
    uint32_t branch;
  };
  std::vector<Gain> gains;
  for (size_t b = 0; b < branches.size(); ++b) {
    for (const double gain : branches[b].gains) gains.push_back({gain, static_cast<uint32_t>(b)});
  }
  std::ranges::stable_sort(gains, [](const Gain& a, const Gain& b) { return a.gain > b.gain; });
  const auto wanted = static_cast<size_t>(std::max<int64_t>(0, entries - static_cast<int64_t>(branches.size())));
  gains.resize(std::min(gains.size(), wanted));
  for (const Gain& gain : gains) ++branches[gain.branch].kept;
  int64_t next = 0;
  for (Branch& branch : branches) {
    branch.first_entry = next;
    next += branch.kept + 1;
  }
  return next;
}

// k-means between the vectors and centroids of a group; writes labels and centroids.
void Refine(const Branch& branch, const Branch::Group& group, int64_t first_entry, int iterations, const Vectors& all,
            float step, ShPalette& out) {
  const int64_t count = group.end - group.begin;
  const auto entries = static_cast<int64_t>(group.leaves.size());
  Buffer<int16_t> points(static_cast<size_t>(count * all.width));
  for (int64_t i = 0; i < count; ++i) {
    all.Copy(branch.rows[branch.indices[static_cast<size_t>(group.begin + i)]], points.data() + i * all.width);
  }
  Buffer<uint16_t> nearest(static_cast<size_t>(count));
  for (int64_t c = 0; c < entries; ++c) {
    const Part& leaf = branch.parts[static_cast<size_t>(group.leaves[static_cast<size_t>(c)])];
    std::fill(nearest.begin() + (leaf.begin - group.begin), nearest.begin() + (leaf.end - group.begin),
              static_cast<uint16_t>(c));
  }
  Buffer<int16_t> centroids(static_cast<size_t>(entries * all.width));
  std::vector<double> means(static_cast<size_t>(entries * all.width), 0.0);
  for (int round = 0;; ++round) {
    std::vector<int64_t> sums(means.size(), 0), members(static_cast<size_t>(entries), 0);
    for (int64_t i = 0; i < count; ++i) {
      const auto c = int64_t{nearest[static_cast<size_t>(i)]};
      ++members[static_cast<size_t>(c)];
      for (int64_t k = 0; k < all.width; ++k) {
        sums[static_cast<size_t>(c * all.width + k)] += points[static_cast<size_t>(i * all.width + k)];
      }
    }
    for (size_t k = 0; k < sums.size(); ++k) {
      const int64_t size = members[k / static_cast<size_t>(all.width)];
      if (size > 0) means[k] = static_cast<double>(sums[k]) / static_cast<double>(size);  // an empty one is unchanged
      centroids[k] = static_cast<int16_t>(std::lrint(means[k]));
    }
    if (round == iterations || entries == 1) break;
    NearestCentroids(points.data(), count, centroids.data(), entries, all.width, nearest.data());
  }
  for (int64_t i = 0; i < count; ++i) {
    const uint32_t row = branch.rows[branch.indices[static_cast<size_t>(group.begin + i)]];
    out.labels[row] = static_cast<uint16_t>(first_entry + nearest[static_cast<size_t>(i)]);
  }
  for (int64_t c = 0; c < entries; ++c) {
    for (int64_t k = 0; k < all.values; ++k) {
      out.centroids[static_cast<size_t>((first_entry + c) * all.values + k)] =
          static_cast<float>(means[static_cast<size_t>(c * all.width + k)] * static_cast<double>(step));
    }
  }
}

}  // namespace

ShPalette BuildShPalette(const CloudView& cloud, int64_t entries, int iterations) {
  const float spread = SpreadOf(cloud);
  const Vectors all = VectorsOf(cloud, spread);
  std::vector<Branch> branches = Branches(all);
  ParallelFor(0, static_cast<int64_t>(branches.size()), 1, [&](int64_t first, int64_t last) {
    for (int64_t b = first; b < last; ++b) {
      Branch& branch = branches[static_cast<size_t>(b)];
      // Some branches need more than their share of entries, but hardly more than this.
      const auto size = static_cast<int64_t>(branch.rows.size());
      branch.Grow(all, std::min(size, 3 * entries * size / all.count + 64));
    }
  });
  ShPalette palette;
  palette.entries = KeepBestSplits(branches, entries);
  palette.centroids.resize(static_cast<size_t>(palette.entries * all.values));
  palette.labels.resize(static_cast<size_t>(all.count));
  ParallelFor(0, static_cast<int64_t>(branches.size()), 1, [&](int64_t first, int64_t last) {
    for (int64_t b = first; b < last; ++b) {
      Branch& branch = branches[static_cast<size_t>(b)];
      int64_t entry = branch.first_entry;
      for (const Branch::Group& group : branch.Groups(GroupEntries(all.count))) {
        Refine(branch, group, entry, iterations, all, spread / static_cast<float>(kSteps), palette);
        entry += static_cast<int64_t>(group.leaves.size());
      }
      branch = {};
    }
  });
  return palette;
}

}  // namespace anchorsplat
