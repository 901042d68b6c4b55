#include "bench/io_bench.h"

#include <functional>
#include <system_error>

#include "bench/bare_costs.h"
#include "core/gaussian_cloud.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "formats/ply/ply_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

GaussianCloud RandomCloud(int64_t count, int sh_degree) {
  GaussianCloud cloud;
  cloud.Resize(count, sh_degree);
  uint64_t seed = 0;
  for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    ParallelFor(0, static_cast<int64_t>(array->size()), 1 << 16, [&](int64_t first, int64_t last) {
      Random random(seed + static_cast<uint64_t>(first));
      for (int64_t i = first; i < last; ++i) (*array)[static_cast<size_t>(i)] = static_cast<float>(random.Uniform());
    });
    ++seed;
  }
  return cloud;
}

}  // namespace

std::vector<IoBenchRow> IoBenchReport::Rows() const {
  return {{"read() to nowhere", cat_seconds, file_bytes, {}, ""},
          {"copy into fresh pages", fresh_copy_seconds, file_bytes, {}, ""},
          {"ReadCloud, PLY", read_seconds, file_bytes, read_ratio(), "times (read() to nowhere + fresh copy)"},
          {"bare write()", bare_write_seconds, file_bytes, {}, ""},
          {"WriteCloud, PLY", write_seconds, file_bytes, write_ratio(), "of the rate of bare write()"},
          {"reader's peak memory", 0, reader_peak_bytes, memory_ratio(), "times the cloud"}};
}

Result<IoBenchReport> RunIoBench(const IoBenchOptions& options) {
  if (options.gaussians < 1 || options.sh_degree < 0 || options.sh_degree > kMaxShDegree || options.repeats < 1) {
    return Error{ErrorCode::kBadArgument, "bench io needs at least one Gaussian, SH degree 0 to 3, one repeat"};
  }
  IoBenchReport report;
  report.gaussians = options.gaussians;
  report.sh_degree = options.sh_degree;
  report.file_bytes = PredictedPlySize(options.gaussians, options.sh_degree);

  ANCHORSPLAT_ASSIGN_OR_RETURN(const ScratchFolder folder,
                               ScratchFolder::Make(options.folder, 2 * report.file_bytes, "bench io"));
  const fs::path file = folder.path() / "cloud.ply";
  const fs::path bare = folder.path() / "bare.bin";

  std::error_code failed;
  Status status;
  const auto best = [&](double& seconds, const std::function<Status()>& work) {
    double now = 0;
    if (status.ok()) now = Seconds([&] { status = work(); });
    if (seconds == 0 || now < seconds) seconds = now;
  };
  const auto read = [&]() -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(file));
    report.cloud_bytes = static_cast<uint64_t>(cloud.bytes());
    return {};
  };
  const Buffer<char> bytes(report.file_bytes, 'x');
  // Each round measures everything, so that a slow minute affects all alike. The two writers alternate in order, as the
  // kernel may slow down whoever writes second. Files are new every time, because rewriting cached pages is different.
  for (int round = 0; status.ok() && round < options.repeats; ++round) {
    const GaussianCloud cloud = RandomCloud(options.gaussians, options.sh_degree);
    for (const bool write_bare : {round % 2 == 0, round % 2 != 0}) {
      if (write_bare) {
        best(report.bare_write_seconds, [&] { return WriteBare(bare, bytes.data(), bytes.size()); });
        fs::remove(bare, failed);
      } else {
        fs::remove(file, failed);
        best(report.write_seconds, [&] { return WriteCloud(file, cloud); });
      }
    }
    best(report.cat_seconds, [&] { return ReadToNowhere(file); });
    best(report.fresh_copy_seconds, [&] { return CopyToFreshPages(bytes.data(), bytes.size()); });
    best(report.read_seconds, read);
  }
  if (status.ok()) report.reader_peak_bytes = PeakGrowth([&] { status = read(); });
  ANCHORSPLAT_RETURN_IF_ERROR(status);
  return report;
}

}  // namespace anchorsplat
