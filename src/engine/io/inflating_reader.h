#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Decompresses part of a file sequentially. Allocates nothing based on sizes that the data claim.
class InflatingReader {
 public:
  virtual ~InflatingReader() = default;
  // Reads the next `size` bytes. Returns fewer at the end of the data, whose checksum is then verified. kBadFile:
  // damaged, or the file ends too early (the message gives the byte).
  virtual Result<size_t> ReadSome(void* out, size_t size) = 0;
  // Bytes of the file after the end of the data. Valid once the end has been reached.
  virtual uint64_t TrailingBytes() const = 0;

  // Reads exactly `size` bytes; also kBadFile if the data end before.
  Status Read(void* out, size_t size);
  // kBadFile unless both the data and the file have ended.
  Status ExpectEnd();

 protected:
  // "a.spz: byte 1,043: the gzip stream ends before its data does"; the byte is the next to be read.
  virtual Error Bad(std::string_view before, std::string_view after) const = 0;
};

// Reader that can be cloned, to reread from the middle of a stream without decompressing everything before it.
class CopyableReader : public InflatingReader {
 public:
  // A reader at the same position; costs 200 kB. The file must outlive it.
  virtual std::unique_ptr<CopyableReader> Copy() const = 0;
};

// Readers of `file`, which must outlive them: the gzip stream from byte `begin` on, with any number of members; the raw
// bytes from `begin` on; and the zstd frames in bytes [begin, end).
std::unique_ptr<CopyableReader> OpenGzip(const InputFile& file, uint64_t begin);
std::unique_ptr<CopyableReader> OpenPlain(const InputFile& file, uint64_t begin);
std::unique_ptr<InflatingReader> OpenZstd(const InputFile& file, uint64_t begin, uint64_t end);

}  // namespace anchorsplat
