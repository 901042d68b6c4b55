#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/result.h"

namespace anchorsplat {

// What moving bytes costs at the least on this machine, for ratios; and how time and memory are taken.

double Seconds(const std::function<void()>& work);

// Highest anonymous memory of the process while `work` runs, less what there was before; bytes. Sampled every
// millisecond: arrays of a cloud take many samples to be touched. 0 where the system does not say.
uint64_t PeakGrowth(const std::function<void()>& work);

Status ReadToNowhere(const std::filesystem::path& path);  // read() of the whole file, as `cat file >/dev/null`
Status WriteBare(const std::filesystem::path& path, const char* bytes, uint64_t size);  // in blocks of 1 MiB
Status CopyToFreshPages(const char* bytes,
                        uint64_t size);  // plain pages never touched before, as any program gets them

// A new folder in `parent` (the system's temporary one when empty) with at least `needed` bytes of free space, which is
// removed with all that is in it.
class ScratchFolder {
 public:
  // kIo: no such folder, or too little space; `who` needs it.
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
