#include "bench/convert_bench.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <system_error>

#include "bench/bare_costs.h"
#include "core/buffer.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "formats/convert.h"
#include "formats/ply/ply_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Mean and standard deviation of value k in a row.
struct Spread {
  double mean = 0, deviation = 1;
};

template <typename SpreadOf>
void FillNormal(Buffer<float>& array, int64_t width, uint64_t seed, SpreadOf&& spread_of) {
  const int64_t rows = static_cast<int64_t>(array.size()) / width;
  ParallelFor(0, rows, 1 << 13, [&](int64_t first, int64_t last) {
    Random random(seed << 32 | static_cast<uint64_t>(first));
    for (int64_t i = first * width; i < last * width; ++i) {
      const Spread spread = spread_of(i % width);
      array[static_cast<size_t>(i)] = static_cast<float>(spread.mean + spread.deviation * random.Normal());
    }
  });
}

}  // namespace

GaussianCloud MadeUpSplat(int64_t count, int sh_degree) {
  GaussianCloud cloud;
  cloud.Resize(count, sh_degree);
  FillNormal(cloud.means, 3, 1, [](int64_t) { return Spread{0, 2}; });
  FillNormal(cloud.log_scales, 3, 2, [](int64_t) { return Spread{-5, 0.8}; });
  FillNormal(cloud.quats, 4, 3, [](int64_t) { return Spread{}; });
  FillNormal(cloud.opacity_logits, 1, 4, [](int64_t) { return Spread{0.5, 2}; });
  FillNormal(cloud.sh, cloud.sh_stride(), 5, [](int64_t k) {
    return Spread{0, k < 3 ? 0.6 : k < 12 ? 0.12 : k < 27 ? 0.08 : 0.05};
  });
  return cloud;
}

Result<ConvertBenchReport> RunConvertBench(const ConvertBenchOptions& options) {
  if (options.gaussians < 1 || options.sh_degree < 0 || options.sh_degree > kMaxShDegree || options.repeats < 1 ||
      options.targets.empty()) {
    return Error{ErrorCode::kBadArgument,
                 "bench convert needs at least one Gaussian, SH degree 0 to 3, one repeat, one target"};
  }
  ConvertBenchReport report;
  std::error_code failed;
  const uint64_t size = options.file.empty() ? PredictedPlySize(options.gaussians, options.sh_degree)
                                             : fs::file_size(options.file, failed);
  if (failed) return Error{ErrorCode::kNotFound, Cat(options.file.string(), ": no such file")};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ScratchFolder folder,
                               ScratchFolder::Make(options.folder, 2 * size, "bench convert"));
  fs::path input = options.file;
  if (input.empty()) {
    input = folder.path() / "made-up.ply";
    ANCHORSPLAT_RETURN_IF_ERROR(WritePly(input, MadeUpSplat(options.gaussians, options.sh_degree)));
  }
  {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(input));
    report.gaussians = cloud.size();
    report.sh_degree = cloud.sh_degree;
    report.cloud_bytes = static_cast<uint64_t>(cloud.bytes());
  }
  report.input_bytes = fs::file_size(input, failed);

  const fs::path bare = folder.path() / "bare.bin";
  Status status;
  const auto best = [&status](double& seconds, const std::function<Status()>& work) {
    double now = 0;
    if (status.ok()) now = Seconds([&] { status = work(); });
    if (seconds == 0 || now < seconds) seconds = now;
  };
  report.rows.resize(options.targets.size());
  const auto convert = [&](size_t k) -> Status {
    ConvertBenchRow& row = report.rows[k];
    row.target = options.targets[k];
    ConvertOptions how;
    how.write.spz_version = row.target.ends_with("3.spz") ? 3 : 4;
    const fs::path output = folder.path() / ("out" + row.target);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvertReport converted, ConvertFile(input, output, how));
    const double sum = converted.read_seconds + converted.write_seconds;
    if (row.bytes == 0 || sum < row.read_seconds + row.write_seconds) {
      row.read_seconds = converted.read_seconds;
      row.write_seconds = converted.write_seconds;
    }
    row.bytes = converted.output_bytes;
    return {};
  };
  // Each round measures everything, so that a slow minute affects all alike. Files are new every time.
  for (int round = 0; status.ok() && round < options.repeats; ++round) {
    best(report.cat_seconds, [&] { return ReadToNowhere(input); });
    {
      const Buffer<char> bytes(static_cast<size_t>(report.input_bytes), 'x');
      best(report.fresh_copy_seconds, [&] { return CopyToFreshPages(bytes.data(), bytes.size()); });
      best(report.write_seconds, [&] { return WriteBare(bare, bytes.data(), bytes.size()); });
    }
    fs::remove(bare, failed);
    for (size_t k = 0; k < options.targets.size(); ++k) {
      const auto once = [&] { best(report.rows[k].seconds, [&] { return convert(k); }); };
      if (round == 0) {
        report.rows[k].peak_bytes = PeakGrowth(once);
      } else {
        once();
      }
      fs::remove(folder.path() / ("out" + options.targets[k]), failed);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(status);
  for (ConvertBenchRow& row : report.rows) {
    const double share = static_cast<double>(row.bytes) / static_cast<double>(report.input_bytes);
    row.bare_ratio = row.seconds / (report.cat_seconds + report.fresh_copy_seconds + share * report.write_seconds);
    row.memory_ratio = static_cast<double>(row.peak_bytes) / static_cast<double>(report.cloud_bytes);
  }
  return report;
}

}  // namespace anchorsplat
