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

// Reads members of a ZIP archive that is in memory, stored or deflated. Only the member's name is ever looked up:
// nothing is written anywhere, so names with ".." or "/" lead nowhere.
class ZipReader {
 public:
  // kBadFile: no ZIP archive, or a damaged one (zip_directory.h). `name` is what messages call it.
  static Result<ZipReader> Open(std::string name, std::string bytes);
  // The same of bytes that stay where they are as long as the reader.
  static Result<ZipReader> View(std::string name, std::string_view bytes);

  // Names of all members, in the order of the directory; those that end in a slash are folders.
  std::vector<std::string> Members() const;
  // What it promises to be; 0 where there is no such member.
  uint64_t SizeOf(const std::string& member) const;
  // kBadFile: no such member, longer than `max_size`, damaged, packed in another way, or more than 200 times as long as
  // it is compressed.
  Result<std::string> Read(const std::string& member, uint64_t max_size) const;

 private:
  ZipReader() = default;

  std::string name_;
  std::unique_ptr<const std::string> bytes_;  // what the entries point into, wherever the reader moves; null: a view
  std::vector<ZipEntry> entries_;
};

// Writes a ZIP archive of members that are stored as they are (what comes in is compressed already, or meant to be read
// in place), with the 64-bit extensions where sizes need them. Dates are those of 1980, so equal contents make equal
// files.
class ZipWriter {
 public:
  explicit ZipWriter(OutputFile& file) : file_(&file) {}
  // One member, its contents in parts that follow each other.
  Status Add(const std::string& name, std::span<const std::string_view> parts);
  Status Add(const std::string& name, std::string_view contents) { return Add(name, {&contents, 1}); }
  // The directory. Nothing may be added afterwards.
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
