#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "io/atomic_file.h"
#include "io/zip_directory.h"

namespace anchorsplat {

// Reads stored or deflated members of a ZIP archive in memory. Nothing is extracted to disk, so names with ".." or "/"
// are harmless.
class ZipReader {
 public:
  // kBadFile: not a ZIP archive, or a damaged one (zip_directory.h). `name` is used in messages.
  static Result<ZipReader> Open(std::string name, std::string bytes);
  // The same with borrowed bytes, which must outlive the reader.
  static Result<ZipReader> View(std::string name, std::string_view bytes);

  // Names of all members in directory order; folders end in a slash.
  std::vector<std::string> Members() const;
  // Claimed size in bytes; 0 if there is no such member.
  uint64_t SizeOf(const std::string& member) const;
  // Decompresses a member. kBadFile: no such member, longer than `max_size`, damaged, another compression method, or a
  // ratio above 200.
  Result<std::string> Read(const std::string& member, uint64_t max_size) const;

 private:
  ZipReader() = default;

  std::string name_;
  std::unique_ptr<const std::string> bytes_;  // entries_ point into it; null: a view
  std::vector<ZipEntry> entries_;
};

// Writes a ZIP archive of stored members (their contents are compressed already, or meant to be read in place), with
// zip64 records where needed. All dates are 1980-01-01, so equal contents give equal files.
class ZipWriter {
 public:
  explicit ZipWriter(OutputFile& file) : file_(&file) {}
  // Adds a member whose contents are the concatenated `parts`.
  Status Add(const std::string& name, std::span<const std::string_view> parts);
  Status Add(const std::string& name, std::string_view contents) { return Add(name, {&contents, 1}); }
  // Writes the directory. Nothing can be added afterwards.
  Status Finish();

 private:
  struct Member {
    std::string name;
    uint32_t crc = 0;
    uint64_t size = 0, offset = 0;
  };
  OutputFile* file_;
  uint64_t written_ = 0;
  std::vector<Member> members_;
};

}  // namespace anchorsplat
