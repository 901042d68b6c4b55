#include "tensors/tensor_checksum.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/fingerprint.h"
#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kChecksumChunk = int64_t{1} << 20;  // bytes per task; part of the checksum's definition

// Arrays are hashed in parallel chunks, because checkpoints have gigabytes.
void AddBytes(std::span<const std::byte> bytes, Fingerprint& print) {
  const int64_t size = std::ssize(bytes);
  std::vector<uint64_t> chunks(static_cast<size_t>((size + kChecksumChunk - 1) / kChecksumChunk));
  ParallelFor(0, std::ssize(chunks), 1, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      Fingerprint chunk;
      chunk.Add(bytes.subspan(static_cast<size_t>(i * kChecksumChunk),
                              static_cast<size_t>(std::min(kChecksumChunk, size - i * kChecksumChunk))));
      chunks[static_cast<size_t>(i)] = chunk.value();
    }
  });
  print.Add(chunks);
}

// Includes the length, so that different texts cannot collide when joined.
void AddText(const std::string& text, Fingerprint& print) { print.Add(Cat(text.size(), ':', text)); }

Result<std::string> ChecksumOf(const std::map<std::string, std::string>& metadata,
                               std::span<const TensorEntry> tensors) {
  Fingerprint print;
  for (const auto& [key, value] : metadata) {
    if (key == kChecksumKey) continue;
    AddText(key, print);
    AddText(value, print);
  }
  for (const TensorEntry& tensor : tensors) {
    AddText(Cat(tensor.name, ' ', TypeName(tensor.type), ' ', tensor.ShapeText()), print);
    if (tensor.contiguous()) {
      AddBytes({tensor.data, static_cast<size_t>(tensor.bytes())}, print);
    } else {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<std::byte> copy, CopyContiguous(tensor));
      AddBytes(copy, print);
    }
  }
  return print.text();
}

}  // namespace

Result<std::map<std::string, std::string>> WithChecksum(std::map<std::string, std::string> metadata,
                                                        std::span<const TensorEntry> tensors) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(metadata[kChecksumKey], ChecksumOf(metadata, tensors));
  return metadata;
}

Status VerifyChecksum(const TensorFile& file) {
  const auto bad = [&](const char* what) { return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", what)}; };
  const auto said = file.metadata().find(kChecksumKey);
  if (said == file.metadata().end()) return bad("has no checksum in its metadata");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string found, ChecksumOf(file.metadata(), file.tensors()));
  if (found == said->second) return {};
  return bad("is damaged: its contents do not add up to its checksum");
}

}  // namespace anchorsplat
