#include "edit/edit_plan.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/buffer.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/vector3.h"
#include "core/world_up.h"
#include "edit/floaters.h"
#include "edit/row_tests.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;

// The smallest rotation that takes unit vector `from` to `to` (Rodrigues); for opposite vectors, a half turn about a
// perpendicular axis.
std::array<double, 9> ShortestTurn(const Vec3& from, const Vec3& to) {
  const double cosine = Dot(from, to);
  if (cosine <= -1 + 1e-12) {
    const Vec3 other = std::abs(from[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
    Vec3 a = Cross(from, other);
    const double length = std::sqrt(Dot(a, a));
    for (double& x : a) x /= length;
    std::array<double, 9> half{};
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) half[3 * i + j] = 2 * a[i] * a[j] - (i == j ? 1 : 0);
    }
    return half;
  }
  const Vec3 v = Cross(from, to);
  const double f = 1 / (1 + cosine);
  return {cosine + f * v[0] * v[0], f * v[0] * v[1] - v[2],   f * v[0] * v[2] + v[1],
          f * v[0] * v[1] + v[2],   cosine + f * v[1] * v[1], f * v[1] * v[2] - v[0],
          f * v[0] * v[2] - v[1],   f * v[1] * v[2] + v[0],   cosine + f * v[2] * v[2]};
}

void Move(const Similarity& map, EditedSplat& splat) {
  splat.world = Compose(map, splat.world);
  if (map.rotation != Similarity{}.rotation) TurnUpComments(map.rotation, splat.comments);
}

// The part of an action that concerns the splat as a whole.
void ApplyToWhole(const EditAction& action, EditedSplat& splat) {
  if (const auto* const move = std::get_if<MoveWorld>(&action.what)) Move(move->map, splat);
  if (const auto* const turn = std::get_if<TurnToUp>(&action.what)) {
    Move({.rotation = ShortestTurn(turn->up, kUsualUp)}, splat);
    SetUp(kUsualUp, splat.comments);
  }
  if (const auto* const lower = std::get_if<LowerShDegree>(&action.what)) {
    splat.sh_degree = std::min(splat.sh_degree, lower->most);
  }
}

// Passes over a splat's rows once; adds to taken[k] what actions[k] removes.
Status TakeAway(EditedSplat& splat, std::span<const EditAction> actions, std::span<int64_t> taken) {
  std::vector<std::pair<size_t, RowTest>> tests;
  for (size_t k = 0; k < actions.size(); ++k) {
    auto test = RowTest::Of(actions[k], splat.world, splat.origin, splat.sh_degree, *splat.extras);
    if (!test.ok()) {
      return Error{test.error().code, Cat(splat.name, ": ", actions[k].words, ": ", test.error().message)};
    }
    if (*test) tests.emplace_back(k, **test);
    ApplyToWhole(actions[k], splat);
  }
  if (tests.empty()) return {};
  if (splat.keep.empty()) splat.keep.assign(static_cast<size_t>(splat.rows->size()), 1);
  std::vector<std::atomic<int64_t>> of_test(tests.size());
  ANCHORSPLAT_RETURN_IF_ERROR(splat.rows->ForEach([&](const RowBlock& block) {
    std::vector<int64_t> here(tests.size());
    for (int64_t i = 0; i < block.size(); ++i) {
      char& keep = splat.keep[static_cast<size_t>(block.first + i)];
      for (size_t t = 0; t < tests.size() && keep != 0; ++t) {
        if (tests[t].second.Keeps(block, i)) continue;
        keep = 0;
        ++here[t];
      }
    }
    for (size_t t = 0; t < tests.size(); ++t) of_test[t] += here[t];
  }));
  for (size_t t = 0; t < tests.size(); ++t) {
    taken[tests[t].first] += of_test[t];
    splat.kept -= of_test[t];
  }
  return {};
}

// Finds the floaters of all splats together. Distances do not depend on position, so means are relative to where the
// first splat's origin is now.
Result<int64_t> TakeFloaters(std::span<EditedSplat> splats, const FloaterOptions& options) {
  const Vec3 middle = splats[0].world.Apply(splats[0].origin);
  // Start of each splat's rows among those that are kept and have a finite position.
  constexpr uint32_t kNone = UINT32_MAX;
  int64_t most = 0;
  for (const EditedSplat& splat : splats) most += splat.kept;
  if (most >= int64_t{kNone}) return Error{ErrorCode::kBadArgument, "too many Gaussians for --filter-floaters"};
  Buffer<float> places(static_cast<size_t>(3 * most)), lengths(static_cast<size_t>(most));
  std::vector<std::vector<uint32_t>> number(splats.size());
  int64_t begin = 0;
  for (size_t k = 0; k < splats.size(); ++k) {
    EditedSplat& splat = splats[k];
    number[k].assign(static_cast<size_t>(splat.rows->size()), kNone);
    int64_t next = begin;
    for (size_t i = 0; i < number[k].size(); ++i) {
      if (splat.has(static_cast<int64_t>(i))) number[k][i] = static_cast<uint32_t>(next++);
    }
    begin = next;
    const double log_scale = std::log(splat.world.scale);
    ANCHORSPLAT_RETURN_IF_ERROR(splat.rows->ForEach([&](const RowBlock& block) {
      for (int64_t i = 0; i < block.size(); ++i) {
        uint32_t& at = number[k][static_cast<size_t>(block.first + i)];
        if (at == kNone) continue;
        const Vec3 place = Minus(splat.world.Apply(ToWorld(block.rows.means.data() + 3 * i, splat.origin)), middle);
        const float* s = block.rows.log_scales.data() + 3 * i;
        bool usable = HasUsableShape(block.rows, i);
        for (size_t a = 0; a < 3; ++a) {
          places[3 * size_t{at} + a] = static_cast<float>(place[a]);
          usable = usable && std::isfinite(places[3 * size_t{at} + a]);
        }
        const double longest = std::exp(double{std::max({s[0], s[1], s[2]})} + log_scale);
        lengths[at] = usable ? static_cast<float>(longest) : NAN;
      }
    }));
  }
  // Undrawable Gaussians are nobody's neighbours.
  std::vector<uint32_t> closed(static_cast<size_t>(most), kNone);
  uint32_t count = 0;
  for (size_t i = 0; i < closed.size(); ++i) {
    if (std::isnan(lengths[i])) continue;
    std::copy_n(places.data() + 3 * i, 3, places.data() + 3 * size_t{count});
    lengths[count] = lengths[i];
    closed[i] = count++;
  }
  const Buffer<uint8_t> floats =
      FindFloaters(std::span(places).first(3 * size_t{count}), std::span(lengths).first(count), options);
  int64_t taken = 0;
  for (size_t k = 0; k < splats.size(); ++k) {
    EditedSplat& splat = splats[k];
    if (splat.keep.empty()) splat.keep.assign(number[k].size(), 1);
    int64_t here = 0;
    for (size_t i = 0; i < number[k].size(); ++i) {
      if (number[k][i] == kNone || closed[number[k][i]] == kNone || floats[closed[number[k][i]]] == 0) continue;
      splat.keep[i] = 0;
      ++here;
    }
    splat.kept -= here;
    taken += here;
  }
  return taken;
}

bool TakesAway(const EditAction& action) {
  return !std::holds_alternative<MoveWorld>(action.what) && !std::holds_alternative<TurnToUp>(action.what) &&
         !std::holds_alternative<LowerShDegree>(action.what);
}

int64_t Kept(std::span<const EditedSplat> splats) {
  return std::accumulate(splats.begin(), splats.end(), int64_t{0},
                         [](int64_t sum, const EditedSplat& splat) { return sum + splat.kept; });
}

}  // namespace

Result<std::vector<EditStep>> ApplyActions(std::span<EditedSplat> splats, std::span<const EditAction> actions,
                                           const std::string& input) {
  std::vector<EditStep> steps;
  for (size_t first = 0; first < actions.size();) {
    const auto* const floaters = std::get_if<DropFloaters>(&actions[first].what);
    size_t last = first + 1;
    while (floaters == nullptr && last < actions.size() && !std::holds_alternative<DropFloaters>(actions[last].what)) {
      ++last;
    }
    const int64_t before = Kept(splats);
    std::vector<int64_t> taken(last - first);
    if (floaters != nullptr) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(taken[0], TakeFloaters(splats, floaters->options));
    } else {
      for (EditedSplat& splat : splats) {
        ANCHORSPLAT_RETURN_IF_ERROR(TakeAway(splat, actions.subspan(first, last - first), taken));
      }
    }
    int64_t left = before;
    for (size_t k = first; k < last; ++k) {
      left -= taken[k - first];
      steps.push_back({actions[k].words, input, taken[k - first], left, TakesAway(actions[k]), actions[k].axes});
    }
    first = last;
  }
  return steps;
}

Result<WorldOrigin> ChooseEditedOrigin(std::span<const EditedSplat> splats) {
  const bool unmoved = std::ranges::all_of(splats, [&](const EditedSplat& splat) {
    return splat.world == Similarity{} && splat.origin == splats[0].origin;
  });
  if (splats.empty() || unmoved) return splats.empty() ? WorldOrigin{} : splats[0].origin;
  constexpr int64_t kSamples = 1 << 16, kRun = 1 << 10;
  std::vector<double> points;
  std::vector<float> lengths;
  int64_t rows = 0;
  for (const EditedSplat& splat : splats) rows += splat.rows->size();
  const int64_t step = std::max<int64_t>(1, (rows + kSamples - 1) / kSamples) * kRun;
  for (const EditedSplat& splat : splats) {
    const auto log_scale = static_cast<float>(std::log(splat.world.scale));
    for (int64_t first = 0; first < splat.rows->size(); first += step) {
      const int64_t last = std::min(first + kRun, splat.rows->size());
      ANCHORSPLAT_RETURN_IF_ERROR(splat.rows->Show(first, last, [&](const RowBlock& block) {
        for (int64_t i = 0; i < block.size(); ++i) {
          if (!splat.has(block.first + i) || !HasUsableShape(block.rows, i)) continue;
          const Vec3 at = splat.world.Apply(ToWorld(block.rows.means.data() + 3 * i, splat.origin));
          points.insert(points.end(), at.begin(), at.end());
          const float* s = block.rows.log_scales.data() + 3 * i;
          const float longest = std::max({s[0], s[1], s[2]});
          if (std::isfinite(longest)) lengths.push_back(longest + log_scale);
        }
      }));
    }
  }
  if (lengths.empty()) return WorldOrigin{};
  // Other programs ignore origins, so one is chosen only if floats are off by more than a sixteenth of a typical
  // length; for files with doubles the limit is a 512th.
  constexpr double kCoarser = 32;
  return ChooseOrigin(points, kCoarser * std::exp(double{Quantile(lengths, 0.5)}));
}

}  // namespace anchorsplat
