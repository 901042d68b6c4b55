#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <shared_mutex>
#include <utility>
#include <vector>

namespace anchorsplat {

// In-memory destination for OutputFiles (atomic_file.h): complete files by name.
struct OutputMemory {
  std::map<std::filesystem::path, std::vector<std::byte>> files;
};

// A file in memory that is being written. Thread-safe for disjoint ranges; gaps are 0, as in a file.
class MemoryBytes {
 public:
  void Reserve(uint64_t size);
  void WriteAt(uint64_t offset, const void* data, size_t size);
  std::vector<std::byte> Take() { return std::move(bytes_); }

 private:
  std::shared_mutex mutex_;  // exclusive while growing
  std::vector<std::byte> bytes_;
};

}  // namespace anchorsplat
