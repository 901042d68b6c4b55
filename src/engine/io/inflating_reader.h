#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Decompresses a part of a file from front to back. Nothing is allocated for what the data promises: bytes come out as
// they are asked for.
class InflatingReader {
 public:
  virtual ~InflatingReader() = default;
  // The next `size` bytes, or fewer where the data ends; its checksum has been looked at then. kBadFile when it is
  // damaged, or when the file ends before the data does (the message gives the byte).
  virtual Result<size_t> ReadSome(void* out, size_t size) = 0;
  // Bytes of the file behind the data, once it has ended.
  virtual uint64_t BytesBehind() const = 0;

  // Exactly the next `size` bytes; kBadFile when the data ends before, too.
  Status Read(void* out, size_t size);
  // That nothing is left: neither data nor bytes of the file. kBadFile otherwise.
  Status ExpectEnd();

 protected:
  // "a.spz: byte 1,043: the gzip stream ends before its data does"; the byte is the next one.
  virtual Error Bad(std::string_view before, std::string_view after) const = 0;
};

// One that another can go on from: what lies far into a stream can be read again without all before it.
class CopyableReader : public InflatingReader {
 public:
  // A reader of its own at the same place: 200 kB. The file must outlive it.
  virtual std::unique_ptr<CopyableReader> Copy() const = 0;
};

// The gzip stream from `begin` on, of any number of members, or the zstd frames in bytes [begin, end). The file must
// outlive them.
std::unique_ptr<CopyableReader> OpenGzip(const InputFile& file, uint64_t begin);
// The bytes from `begin` on as they are, for what may be compressed or not.
std::unique_ptr<CopyableReader> OpenPlain(const InputFile& file, uint64_t begin);
std::unique_ptr<InflatingReader> OpenZstd(const InputFile& file, uint64_t begin, uint64_t end);

}  // namespace anchorsplat
