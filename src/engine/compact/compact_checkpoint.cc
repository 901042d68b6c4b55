#include "compact/compact_checkpoint.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "compact/compact_network.h"
#include "core/file_system.h"
#include "core/fingerprint.h"
#include "core/log.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
#include "fit/fingerprints.h"
#include "io/atomic_file.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kMagic = "anchorsplat network 1\n";
constexpr uint64_t kMostSettings = 1 << 16;

// Precedes a block's arrays, in the machine's byte order: a run resumes on the machine that began it.
struct BlockHeader {
  int64_t block, unlike_training, partly_unlike_training, not_finite, copied, made, rows;
  uint64_t checksum;  // of the fields above and the arrays
};
static_assert(sizeof(BlockHeader) == 64);

uint64_t ChecksumOf(const BlockHeader& header, const CompactPart& part) {
  Fingerprint print;
  print.Add(std::array{header.block, header.unlike_training, header.partly_unlike_training, header.not_finite,
                       header.copied, header.made, header.rows});
  print.Add(part.keys);
  for (const auto array : kCloudArrays) print.AddWords(part.cloud.*array);
  return print.value();
}

// Reads exactly `bytes`; false with errno otherwise, EIO at the end of the file.
bool ReadAll(int descriptor, void* to, size_t bytes, uint64_t at) {
  for (auto* next = static_cast<char*>(to); bytes > 0;) {
    const ssize_t read = ::pread(descriptor, next, bytes, static_cast<off_t>(at));
    if (read < 0 && errno == EINTR) continue;
    if (read == 0) errno = EIO;
    if (read <= 0) return false;
    next += read;
    bytes -= static_cast<size_t>(read);
    at += static_cast<uint64_t>(read);
  }
  return true;
}

bool WriteAll(int descriptor, const void* from, size_t bytes, uint64_t at) {
  for (const auto* next = static_cast<const char*>(from); bytes > 0;) {
    const ssize_t written = ::pwrite(descriptor, next, bytes, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = EIO;
    if (written <= 0) return false;
    next += written;
    bytes -= static_cast<size_t>(written);
    at += static_cast<uint64_t>(written);
  }
  return true;
}

std::string HeaderOf(const std::string& settings) {
  Fingerprint print;
  print.Add(settings);
  return Cat(kMagic, print.text(), " ", settings, "\n");
}

Error CannotOpen(const fs::path& path) {
  return {errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo,
          Cat(path.string(), ": cannot be opened: ", std::generic_category().message(errno))};
}

// Reads the settings, the first line.
Result<std::string> ReadSettings(const fs::path& path, int descriptor, uint64_t size) {
  std::string text(std::min<uint64_t>(size, kMagic.size() + kMostSettings), '\0');
  if (!ReadAll(descriptor, text.data(), text.size(), 0)) return CannotOpen(path);
  if (!text.starts_with(kMagic)) {
    return Error{ErrorCode::kBadFile, Cat(path.string(),
                                          ": is not a checkpoint of a network (pass another with "
                                          "--checkpoint FILE)")};
  }
  const size_t end = text.find('\n', kMagic.size());
  constexpr size_t kDigits = 16;
  if (end != std::string::npos && end > kMagic.size() + kDigits) {
    std::string settings = text.substr(kMagic.size() + kDigits + 1, end - kMagic.size() - kDigits - 1);
    if (text.compare(0, end + 1, HeaderOf(settings)) == 0) return settings;
  }
  return Error{ErrorCode::kBadFile,
               Cat(path.string(), ": byte ", kMagic.size(), ": the checkpoint's settings are damaged; -w starts over")};
}

}  // namespace

std::string CheckpointSettings(const std::string& network, const GaussianCloud& cloud, const CompactTask& task) {
  const auto print_of = [](const auto& values) {
    Fingerprint print;
    print.Add(values);
    return print.text();
  };
  const CopyChoice choice = task.choice.value_or(CopyChoice{.copies = -1});
  return nlohmann::json{{"gaussians", cloud.size()},
                        {"input", FingerprintOf(cloud)},
                        {"rasterization", cloud.render_mode ? NameOf(*cloud.render_mode) : ""},
                        {"network", network},
                        {"pixel size", print_of(task.pixel_sizes)},
                        {"upscale", task.upscale},
                        {"filter strength", task.strength},
                        {"copies", choice.copies.value_or(0)},
                        {"merge cost", choice.merge_cost},
                        {"bound of Gaussians", choice.max_gaussians},
                        {"least opacity", choice.invisible},
                        {"choice of dust", print_of(task.single)},
                        {"region", print_of(task.in_region)},
                        {"size of blocks", task.block_gaussians}}
      .dump();
}

bool FitsBlock(const CompactBlockResult& result, const Buffer<int32_t>& places, int64_t block_gaussians, int64_t copies,
               bool merging_deferred, bool stand_ins) {
  const auto n = static_cast<int64_t>(places.size());
  const CompactPart& part = result.part;
  const auto rows = static_cast<int64_t>(part.keys.size());
  const int64_t first = result.block * block_gaussians, own = std::min(block_gaussians, n - first);
  if (part.copied < 0 || part.copied > own) return false;
  const int64_t standing = merging_deferred && stand_ins ? part.copied : 0;  // deferred stand-in rows
  if (part.made < rows - standing || part.made > copies * own) return false;
  std::vector<char> seen(static_cast<size_t>((copies + 1) * own), 0);
  for (const int64_t key : part.keys) {
    if (key < 0 || key >= (copies + 1) * n) return false;
    const int64_t place = places[static_cast<size_t>(key % n)] - first;
    if (place < 0 || place >= own) return false;
    char& before = seen[static_cast<size_t>(key / n * own + place)];
    if (before != 0) return false;
    before = 1;
  }
  if (!merging_deferred) return true;
  const int64_t each = copies + (stand_ins ? 1 : 0);
  if (part.made != rows - standing || each * part.copied > rows) return false;
  for (int64_t k = 0; k < each; ++k) {
    for (int64_t g = 0; g < part.copied; ++g) {
      if (part.keys[static_cast<size_t>(k * part.copied + g)] != k * n + part.keys[static_cast<size_t>(g)])
        return false;
    }
  }
  return true;
}

Result<CompactCheckpoint> CompactCheckpoint::Open(const fs::path& path, const std::string& settings, bool resume) {
  const std::string header = HeaderOf(settings);
  if (!resume || !Exists(path)) {
    ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(path, header, /*overwrite=*/IsCompactCheckpoint(path)));
  }
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return CannotOpen(path);
  CompactCheckpoint checkpoint(path, descriptor, header.size(), 0);
  struct stat info {};
  if (::fstat(descriptor, &info) != 0) return CannotOpen(path);
  checkpoint.size_ = static_cast<uint64_t>(info.st_size);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string theirs, ReadSettings(path, descriptor, checkpoint.size_));
  RecordOwnFile(path);
  ANCHORSPLAT_RETURN_IF_ERROR(CompareSettings(path.string(), theirs, settings));
  return checkpoint;
}

CompactCheckpoint::CompactCheckpoint(CompactCheckpoint&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      at_(other.at_),
      size_(other.size_),
      full_(other.full_) {}

CompactCheckpoint::~CompactCheckpoint() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<bool> CompactCheckpoint::Next(const GaussianCloud& of, CompactBlockResult& result) {
  BlockHeader header;
  if (size_ - at_ < sizeof header) return false;
  if (!ReadAll(descriptor_, &header, sizeof header, at_)) return CannotOpen(path_);
  const auto per_row = static_cast<uint64_t>(11 + of.sh_stride()) * sizeof(float) + sizeof(int64_t);
  const uint64_t left = size_ - at_ - sizeof header;
  if (header.rows < 0 || static_cast<uint64_t>(header.rows) > left / per_row) return false;
  result = {header.block, header.unlike_training, header.partly_unlike_training, header.not_finite,
            std::move(result.part)};
  CompactPart& part = result.part;
  part.copied = header.copied;
  part.made = header.made;
  part.cloud.render_mode = of.render_mode;
  part.cloud.Resize(header.rows, of.sh_degree);
  part.keys.resize(static_cast<size_t>(header.rows));
  uint64_t at = at_ + sizeof header;
  const auto read = [&](auto& array) {
    const size_t bytes = array.size() * sizeof(array[0]);
    const bool all = bytes == 0 || ReadAll(descriptor_, array.data(), bytes, at);
    at += bytes;
    return all;
  };
  bool all = read(part.keys);
  for (const auto array : kCloudArrays) all = all && read(part.cloud.*array);
  if (!all) return CannotOpen(path_);
  if (ChecksumOf(header, part) != header.checksum) return false;
  at_ = at;
  return true;
}

void CompactCheckpoint::Append(const CompactBlockResult& result) {
  if (full_) return;
  const CompactPart& part = result.part;
  BlockHeader header{result.block,
                     result.unlike_training,
                     result.partly_unlike_training,
                     result.not_finite,
                     part.copied,
                     part.made,
                     part.cloud.size(),
                     0};
  header.checksum = ChecksumOf(header, part);
  uint64_t at = at_ + sizeof header;
  const auto write = [&](const auto& array) {
    const size_t bytes = array.size() * sizeof(array[0]);
    const bool all = WriteAll(descriptor_, array.data(), bytes, at);
    at += bytes;
    return all;
  };
  // Cuts off a torn block, and writes the header last: a block without header does not exist.
  bool all = ::ftruncate(descriptor_, static_cast<off_t>(at_)) == 0 && write(part.keys);
  for (const auto array : kCloudArrays) all = all && write(part.cloud.*array);
  all = all && WriteAll(descriptor_, &header, sizeof header, at_);
  if (all) {
    at_ = size_ = at;
    return;
  }
  full_ = true;
  const std::string why = std::generic_category().message(errno);
  (void)!::ftruncate(descriptor_, static_cast<off_t>(at_));
  LogWarning(Cat(path_.string(), ": cannot write the checkpoint: ", why,
                 "; continuing without. --resume would use what it holds"));
}

bool IsCompactCheckpoint(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  std::string text(kMagic.size(), '\0');
  const bool is = ReadAll(descriptor, text.data(), text.size(), 0) && text == kMagic;
  ::close(descriptor);
  if (is) RecordOwnFile(path);
  return is;
}

}  // namespace anchorsplat
