#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Decompresses a part of a file from front to back. Nothing is allocated for what the data promises: bytes come out as
// they are asked for.
class InflatingReader {
 public:
  virtual ~InflatingReader() = default;
  // Exactly the next `size` bytes; kBadFile when the data is damaged or ends before (the message gives the byte).
  virtual Status Read(void* out, size_t size) = 0;
  // That nothing is left: neither data (its checksum is looked at) nor bytes of the file. kBadFile otherwise.
  virtual Status ExpectEnd() = 0;
};

// One that another can go on from: what lies far into a stream can be read again without all before it.
class CopyableReader : public InflatingReader {
 public:
  // A reader of its own at the same place: 200 kB. The file must outlive it.
  virtual std::unique_ptr<CopyableReader> Copy() const = 0;
};

// The one gzip stream from `begin` on, or the zstd frames in bytes [begin, end).
std::unique_ptr<CopyableReader> OpenGzip(const InputFile& file, uint64_t begin);
std::unique_ptr<InflatingReader> OpenZstd(const InputFile& file, uint64_t begin, uint64_t end);

}  // namespace anchorsplat
