#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "core/result.h"

namespace anchorsplat {

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, FileCloser>;

// A regular file opened for reading, and how long it was when it was opened.
struct OpenedFile {
  FileHandle handle;
  uint64_t size = 0;
};

// Folders, pipes and devices are refused: their length is unknown, and every bound we check rests on it.
// Errors: kNotFound, kIo.
Result<OpenedFile> OpenForReading(const std::filesystem::path& path);

// The whole file, or pipe. Errors of InputFile::Open; kBadFile when it is longer than `max_bytes`.
Result<std::string> ReadFileBytes(const std::filesystem::path& path, uint64_t max_bytes);

}  // namespace anchorsplat
