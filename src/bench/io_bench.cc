#include "bench/io_bench.h"

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <system_error>
#include <thread>

#include "core/gaussian_cloud.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "formats/ply_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

double Seconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

class ScratchFolder {
 public:
  explicit ScratchFolder(const fs::path& parent) {
    std::string name = (parent / "anchorsplat-bench-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Anonymous memory of this process in bytes; 0 where the system does not say.
uint64_t AnonymousBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "RssAnon:") continue;
    uint64_t kibibytes = 0;
    status >> kibibytes;
    return kibibytes * 1024;
  }
  return 0;
}

// Highest anonymous memory while `work` runs, less what there was before. Sampled: arrays of a cloud take many samples
// to be touched.
uint64_t PeakGrowth(const std::function<void()>& work) {
#ifdef __GLIBC__
  malloc_trim(0);  // memory kept from before would be used again without showing as growth
#endif
  const uint64_t before = AnonymousBytes();
  std::atomic<bool> done{false};
  std::atomic<uint64_t> peak{before};
  std::thread sampler([&] {
    while (!done) {
      peak = std::max(peak.load(), AnonymousBytes());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  work();
  const uint64_t after = AnonymousBytes();
  done = true;
  sampler.join();
  return std::max(peak.load(), after) - before;
}

Status ReadToNowhere(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot open")};
  std::vector<char> block(size_t{128} << 10);  // as cat does
  while (::read(descriptor, block.data(), block.size()) > 0) {
  }
  ::close(descriptor);
  return {};
}

Status WriteBare(const fs::path& path, const char* bytes, uint64_t size) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  bool ok = descriptor >= 0;
  for (uint64_t at = 0; ok && at < size;) {
    const ssize_t n = ::write(descriptor, bytes + at, std::min<uint64_t>(size - at, uint64_t{1} << 20));
    ok = n > 0;
    at += static_cast<uint64_t>(std::max<ssize_t>(n, 0));
  }
  if (descriptor >= 0) ok = ::close(descriptor) == 0 && ok;
  if (!ok) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot write")};
  return {};
}

// Plain pages, as any program gets them.
Status CopyToFreshPages(const char* bytes, uint64_t size) {
  void* pages = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) return Error{ErrorCode::kIo, Cat("no memory for a copy of ", HumanBytes(size))};
  std::memcpy(pages, bytes, size);
  ::munmap(pages, size);
  return {};
}

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

  std::error_code failed;
  const fs::path parent = options.folder.empty() ? fs::temp_directory_path(failed) : options.folder;
  const fs::space_info space = fs::space(parent, failed);
  const uint64_t needed = 2 * report.file_bytes;
  if (failed || space.available < needed) {
    return Error{ErrorCode::kIo,
                 Cat(parent.string(), ": bench io needs ", HumanBytes(needed), " of free space, there is ",
                     failed ? std::string("no such folder") : HumanBytes(space.available))};
  }
  const ScratchFolder folder(parent);
  if (folder.path().empty()) return Error{ErrorCode::kIo, Cat(parent.string(), ": cannot make a folder in it")};
  const fs::path file = folder.path() / "cloud.ply";
  const fs::path bare = folder.path() / "bare.bin";

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
  // All kinds in every round, so that a slow minute of the machine hits them alike, and the two writers take turns to
  // be first, as the kernel may slow down whoever writes second. Files are new every time: writing into pages that are
  // cached already is another thing.
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
