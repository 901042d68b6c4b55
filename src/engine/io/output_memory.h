#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <shared_mutex>
#include <utility>
#include <vector>

namespace anchorsplat {

// Where an OutputFile (atomic_file.h) is put instead of a folder: files in memory by their names, whole or not at all.
struct OutputMemory {
  std::map<std::filesystem::path, std::vector<std::byte>> files;
};

// The bytes of one that is being written. Disjoint ranges may be written from several threads; what nobody has written
// is 0, as in a file.
class MemoryBytes {
 public:
  void Reserve(uint64_t size);
  void WriteAt(uint64_t offset, const void* data, size_t size);
  std::vector<std::byte> Take() { return std::move(bytes_); }

 private:
  std::shared_mutex mutex_;  // alone: to grow
  std::vector<std::byte> bytes_;
};

}  // namespace anchorsplat
