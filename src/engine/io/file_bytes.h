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

// A regular file opened for reading, with its size at that time in bytes.
struct OpenedFile {
  FileHandle handle;
  uint64_t size = 0;
};

// Opens a regular file. Folders, pipes and devices are refused: all our bounds rest on a known size. Errors: kNotFound,
// kIo.
Result<OpenedFile> OpenForReading(const std::filesystem::path& path);

// Reads a whole file or pipe. Errors: those of InputFile::Open; kBadFile: longer than `max_bytes`.
Result<std::string> ReadFileBytes(const std::filesystem::path& path, uint64_t max_bytes);

}  // namespace anchorsplat
