#include "io/unpack.h"

#include <memory>
#include <utility>

#include "core/buffer.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "io/compression_ratio.h"
#include "io/inflating_reader.h"

namespace anchorsplat {

namespace {

constexpr size_t kPiece = size_t{1} << 20;

unsigned Byte(std::string_view bytes, size_t at) { return static_cast<unsigned char>(bytes[at]); }

std::unique_ptr<InflatingReader> OpenPacked(const InputFile& file, Packing packing) {
  if (packing == Packing::kGzip) return OpenGzip(file, 0);
  return OpenZstd(file, 0, file.size());
}

// Tapes and block devices pad with zeros.
Result<bool> AreZeros(const InputFile& file, uint64_t begin) {
  SequentialReader reader(file, begin);
  for (;;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view bytes, reader.Peek());
    if (bytes.empty()) return true;
    if (bytes.find_first_not_of('\0') != bytes.npos) return false;
    reader.Consume(bytes.size());
  }
}

Status WarnOfBytesBehind(const InputFile& file, uint64_t behind, Packing packing) {
  if (behind == 0) return {};
  const uint64_t begin = file.size() - behind;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool zeros, AreZeros(file, begin));
  if (zeros) return {};
  LogWarning(Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(begin)), ": ignoring ",
                 WithThousands(static_cast<int64_t>(behind)), " bytes after its ", NameOf(packing), " stream"));
  return {};
}

}  // namespace

Packing PackingOf(std::string_view head) {
  // Only deflate (the only method), and no reserved flags.
  if (head.size() >= 10 && head.starts_with("\x1f\x8b\x08") && (Byte(head, 3) & 0xe0) == 0) return Packing::kGzip;
  if (head.starts_with("\x28\xb5\x2f\xfd")) return Packing::kZstd;
  return Packing::kNone;
}

std::string_view NameOf(Packing packing) {
  return packing == Packing::kGzip ? "gzip" : packing == Packing::kZstd ? "zstd" : "nothing";
}

Result<std::string> HeadInside(const InputFile& file, Packing packing, size_t size) {
  std::string head(size, '\0');
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t read, OpenPacked(file, packing)->ReadSome(head.data(), size));
  head.resize(read);
  return head;
}

Result<InputFile> Unpack(const InputFile& file, Packing packing, uint64_t compressed_size) {
  const std::unique_ptr<InflatingReader> reader = OpenPacked(file, packing);
  Buffer<char> bytes;
  for (;;) {
    LeaveIfAbandoned();
    const size_t had = bytes.size();
    bytes.resize(had + kPiece);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t read, reader->ReadSome(bytes.data() + had, kPiece));
    bytes.resize(had + read);
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(file.name(), compressed_size, bytes.size()));
    if (read < kPiece) break;
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WarnOfBytesBehind(file, reader->TrailingBytes(), packing));
  return InputFile::Inside(file, Cat(file.name(), " (unpacked)"), std::move(bytes));
}

std::string NameInGzip(std::string_view head) {
  constexpr unsigned kExtra = 4, kName = 8;
  size_t at = 10;
  if (PackingOf(head) != Packing::kGzip || (Byte(head, 3) & kName) == 0) return {};
  if ((Byte(head, 3) & kExtra) != 0) {
    if (head.size() < at + 2) return {};
    at += 2 + Byte(head, at) + 256 * Byte(head, at + 1);
  }
  const size_t end = head.find('\0', at);
  return at > head.size() || end == head.npos ? std::string() : std::string(head.substr(at, end - at));
}

}  // namespace anchorsplat
