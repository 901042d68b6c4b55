#include "scene/assimp_files.h"

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <cstdint>
#include <cstring>
#include <utility>

namespace anchorsplat {

namespace {

class MemoryStream : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::string bytes) : bytes_(std::move(bytes)) {}

  size_t Read(void* out, size_t size, size_t count) override {
    if (size == 0) return 0;
    const size_t items = std::min(count, (bytes_.size() - at_) / size);
    std::memcpy(out, bytes_.data() + at_, items * size);
    at_ += items * size;
    return items;
  }
  size_t Write(const void*, size_t, size_t) override { return 0; }
  aiReturn Seek(size_t offset, aiOrigin origin) override {
    const size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
    const size_t to = base + offset;  // negative offsets wrap around, as the interface is unsigned
    if (to > bytes_.size()) return aiReturn_FAILURE;
    at_ = to;
    return aiReturn_SUCCESS;
  }
  size_t Tell() const override { return at_; }
  size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::string bytes_;
  size_t at_ = 0;
};

}  // namespace

int64_t BlankLinesAndPoints(std::string& obj) {
  int64_t elements = 0;
  size_t begin = 0;
  while (begin < obj.size()) {
    size_t first = begin;
    while (first < obj.size() && (obj[first] == ' ' || obj[first] == '\t')) ++first;
    const bool blank = first < obj.size() && (obj[first] == 'l' || obj[first] == 'p');
    const bool element = blank && first + 1 < obj.size() && (obj[first + 1] == ' ' || obj[first + 1] == '\t');
    // To the end of the line, including lines joined by a backslash.
    size_t end = first;
    for (; end < obj.size(); ++end) {
      if (obj[end] != '\n') continue;
      size_t before = end;
      if (before > first && obj[before - 1] == '\r') --before;
      if (before == first || obj[before - 1] != '\\') break;
    }
    if (element) ++elements;
    if (blank) {
      for (size_t i = first; i < end; ++i) {
        if (obj[i] != '\n' && obj[i] != '\r') obj[i] = ' ';
      }
    }
    begin = end + 1;
  }
  return elements;
}

Assimp::IOStream* AssimpFiles::Open(const char* name, const char* mode) {
  if (std::strpbrk(mode, "wa+") != nullptr) return nullptr;
  auto bytes = read_(name);
  if (!bytes) return nullptr;
  return new MemoryStream(*std::move(bytes));
}

void AssimpFiles::Close(Assimp::IOStream* stream) { delete stream; }

}  // namespace anchorsplat
