#include <algorithm>
#include <charconv>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/splat_order.h"
#include "formats/tables/table_writers.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

constexpr int64_t kRowsPerTask = 1 << 12;
constexpr int64_t kTasksAtOnce = 32;
constexpr uint64_t kBytesPerNumber = 13;  // "-0.123456789" and a separator

std::string Names(int degree) {
  std::string line = "x,y,z";
  for (int k = 0; k < 3; ++k) line += Cat(",f_dc_", k);
  for (int k = 0; k < 3 * (ShCoefficients(degree) - 1); ++k) line += Cat(",f_rest_", k);
  line += ",opacity";
  for (int k = 0; k < 3; ++k) line += Cat(",scale_", k);
  for (int k = 0; k < 4; ++k) line += Cat(",rot_", k);
  return line + "\n";
}

void AppendRow(const CloudView& cloud, int64_t i, std::string& text) {
  const auto append = [&text](auto value) {
    char digits[32];
    const auto [end, error] = std::to_chars(digits, digits + sizeof digits, value);
    text.append(digits, end);
    text += ',';
  };
  const float* mean = cloud.means.data() + 3 * i;
  if (IsZero(cloud.origin)) {
    std::for_each_n(mean, 3, append);
  } else {
    std::ranges::for_each(ToWorld(mean, cloud.origin), append);
  }
  const float* sh = cloud.sh.data() + i * cloud.sh_stride();
  for (int64_t k = 0; k < 3; ++k) append(sh[k]);
  for (int64_t channel = 0; channel < 3; ++channel) {
    for (int64_t k = 1; k < cloud.coefficients(); ++k) append(sh[3 * k + channel]);
  }
  append(cloud.opacity_logits[static_cast<size_t>(i)]);
  for (int64_t k = 0; k < 3; ++k) append(cloud.log_scales[static_cast<size_t>(3 * i + k)]);
  for (int64_t k = 0; k < 4; ++k) append(cloud.quats[static_cast<size_t>(4 * i + k)]);
  text.back() = '\n';
}

}  // namespace

uint64_t EstimatedCsvSize(int64_t count, int sh_degree) {
  const uint64_t numbers = 11 + 3 * static_cast<uint64_t>(ShCoefficients(sh_degree));
  return Names(sh_degree).size() + static_cast<uint64_t>(count) * numbers * kBytesPerNumber;
}

Status WriteCsv(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const Buffer<uint32_t> order = WriteOrder(cloud, options.order, SplatOrder::kKeep);
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(Names(cloud.sh_degree)));
  std::vector<std::string> texts(static_cast<size_t>(kTasksAtOnce));
  for (int64_t begin = 0; begin < cloud.size(); begin += kTasksAtOnce * kRowsPerTask) {
    const int64_t end = std::min(begin + kTasksAtOnce * kRowsPerTask, cloud.size());
    for (std::string& text : texts) text.clear();
    ParallelFor(begin, end, kRowsPerTask, [&](int64_t first, int64_t last) {
      std::string& text = texts[static_cast<size_t>((first - begin) / kRowsPerTask)];
      for (int64_t i = first; i < last; ++i) {
        AppendRow(cloud, order.empty() ? i : int64_t{order[static_cast<size_t>(i)]}, text);
      }
    });
    for (const std::string& text : texts) ANCHORSPLAT_RETURN_IF_ERROR(file.Write(text));
  }
  return file.Commit();
}

}  // namespace anchorsplat
