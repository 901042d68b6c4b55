#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/result.h"

namespace anchorsplat {

// Lower bounds for moving bytes on this machine, for ratios; and measurement of time and memory.

double Seconds(const std::function<void()>& work);

// Peak growth of the process's anonymous memory while `work` runs, bytes. Sampled every millisecond, which is often
// compared to the time it takes to touch a cloud's arrays. 0 if the system does not report it.
uint64_t PeakGrowth(const std::function<void()>& work);

Status ReadToNowhere(const std::filesystem::path& path);  // reads the whole file, like `cat file >/dev/null`
Status WriteBare(const std::filesystem::path& path, const char* bytes, uint64_t size);  // in blocks of 1 MiB
// Copies to ordinary pages that were never touched before.
Status CopyToFreshPages(const char* bytes, uint64_t size);

// A new folder in `parent` (empty: the system's temporary folder) with at least `needed` bytes of free space; removed
// with its contents at the end.
class ScratchFolder {
 public:
  // kIo: no such folder, or too little space (the message names `who`).
  static Result<ScratchFolder> Make(const std::filesystem::path& parent, uint64_t needed, const char* who);
  ScratchFolder(ScratchFolder&& other) noexcept;
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder();
  const std::filesystem::path& path() const { return path_; }

 private:
  ScratchFolder() = default;
  std::filesystem::path path_;
};

}  // namespace anchorsplat
