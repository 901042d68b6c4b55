#include "formats/hidden_rows.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kHiddenGrain = 1 << 14;

Buffer<int64_t> UnusableRows(const CloudView& cloud) {
  std::vector<Buffer<int64_t>> parts(static_cast<size_t>((cloud.size() + kHiddenGrain - 1) / kHiddenGrain));
  ParallelFor(0, cloud.size(), kHiddenGrain, [&](int64_t first, int64_t last) {
    Buffer<int64_t>& part = parts[static_cast<size_t>(first / kHiddenGrain)];
    for (int64_t i = first; i < last; ++i) {
      if (!IsUsable(cloud, i)) part.push_back(i);
    }
  });
  Buffer<int64_t> rows;
  for (const Buffer<int64_t>& part : parts) rows.insert(rows.end(), part.begin(), part.end());
  return rows;
}

// `rows` are ascending.
void Hide(std::span<const int64_t> rows, GaussianCloud& cloud) {
  int64_t like = 0;  // first row not hidden; none if all are
  for (size_t k = 0; k < rows.size() && rows[k] == like; ++k) ++like;
  const auto put = [&](Buffer<float>& array, int64_t width, int64_t row, float otherwise) {
    float* const to = array.data() + row * width;
    if (like < cloud.size()) {
      std::copy_n(array.data() + like * width, width, to);
    } else {
      std::fill_n(to, width, otherwise);
    }
  };
  for (const int64_t row : rows) {
    if (row > like) like = row - 1;  // the previous row, already replaced if it was hidden
    put(cloud.means, 3, row, 0);
    put(cloud.log_scales, 3, row, 0);
    put(cloud.quats, 4, row, 1);
    put(cloud.sh, cloud.sh_stride(), row, 0);
    cloud.opacity_logits[static_cast<size_t>(row)] = -std::numeric_limits<float>::infinity();
  }
}

}  // namespace

HiddenRows HideRows(const SplatFormat& format, const CloudView& cloud) {
  HiddenRows hidden;
  // Formats that drop rows drop these too, and report them.
  if (format.keeps_all_values || format.written_rows != nullptr) return hidden;
  hidden.unusable = UnusableRows(cloud);
  if (format.strays != nullptr) hidden.strays = format.strays(cloud);
  if (hidden.unusable.empty() && hidden.strays.rows.empty()) return hidden;
  hidden.written = CopyOf(cloud);
  Buffer<int64_t> rows;
  std::ranges::set_union(hidden.unusable, hidden.strays.rows, std::back_inserter(rows));
  Hide(rows, hidden.written);
  return hidden;
}

void WarnOfHiddenRows(const std::filesystem::path& path, const SplatFormat& format, const HiddenRows& hidden) {
  const std::string of = Cat(" of ", WithThousands(hidden.written.size()), " Gaussians");
  if (!hidden.unusable.empty()) {
    LogWarning(Cat(path.string(), ": ", WithThousands(std::ssize(hidden.unusable)), of, " cannot be drawn (",
                   kWhyUnusable, "): written with opacity 0"));
  }
  if (!hidden.strays.rows.empty()) {
    LogWarning(Cat(path.string(), ": ", WithThousands(std::ssize(hidden.strays.rows)), of, " lie up to ",
                   hidden.strays.farthest, " from the centre: written with opacity 0, as ", format.article, " ",
                   format.name,
                   " file that reaches so far would round all other positions too coarsely (a PLY keeps them all)"));
  }
}

}  // namespace anchorsplat
