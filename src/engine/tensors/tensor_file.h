#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "io/mapped_file.h"
#include "tensors/tensor_entry.h"

namespace anchorsplat {

// A checkpoint value that is not a tensor; std::monostate is Python's None.
using TensorFileScalar = std::variant<std::monostate, bool, int64_t, double, std::string>;

// Contents of a tensor file. Names are dotted paths through nested dictionaries and lists ("splats.means",
// "optimizer.param_groups.0.lr").
struct TensorFileContents {
  std::vector<TensorEntry> tensors;  // in file order, unique names
  std::map<std::string, TensorFileScalar> scalars;
  std::map<std::string, std::string> metadata;  // __metadata__ of safetensors
};

// Row-major float32 values of a tensor: in place if possible, else a converted copy.
class Float32Values {
 public:
  explicit Float32Values(std::span<const float> view) : view_(view) {}
  explicit Float32Values(Buffer<float> copy) : copy_(std::move(copy)), view_(copy_) {}
  Float32Values(Float32Values&&) = default;  // moving a Buffer keeps its elements in place
  Float32Values& operator=(Float32Values&&) = default;

  std::span<const float> values() const { return view_; }
  bool is_view() const { return copy_.empty(); }

 private:
  Buffer<float> copy_;
  std::span<const float> view_;
};

// Memory-mapped named arrays of a checkpoint: opening reads only the directory, and weights are paged in on use.
// Entries and views are valid as long as the TensorFile, which can be moved. For files that shrink while open, see
// io/mapped_file.h.
//
// Formats, detected by content:
//  * PyTorch's zip container (torch.save since 1.6) and its older bare pickles. Pickles are read as data: anything but
//    tensors, numbers, text, lists and dictionaries is refused by name, and nothing is executed. A dictionary under the
//    key "state_dict" is replaced by its contents; the prefix "module." (of DistributedDataParallel) is dropped.
//  * safetensors.
class TensorFile {
 public:
  // Errors: kNotFound; kIo: also folders, pipes and devices; kBadFile with path, byte and reason: truncated, damaged or
  // hostile, unknown format, big-endian, TorchScript, duplicate tensor names.
  static Result<TensorFile> Open(const std::filesystem::path& path);
  // The same for bytes in memory; `name` replaces the path in messages.
  static Result<TensorFile> FromBytes(Buffer<std::byte> bytes, std::string name);

  const std::string& name() const { return name_; }  // the path, for messages
  std::span<const TensorEntry> tensors() const { return contents_.tensors; }
  const std::map<std::string, TensorFileScalar>& scalars() const { return contents_.scalars; }
  const std::map<std::string, std::string>& metadata() const { return contents_.metadata; }

  // The tensor of that name, or null.
  const TensorEntry* Find(std::string_view name) const;

  // The tensor of that name. Errors (kBadFile with the path): missing; another shape.
  Result<const TensorEntry*> Require(std::string_view name) const;
  Result<const TensorEntry*> Require(std::string_view name, std::span<const int64_t> shape) const;

  // Values of a tensor with exactly this shape; float16, bfloat16, float64 and strided tensors are copied and
  // converted. Errors (kBadFile with the path): missing; another shape; not floating-point.
  Result<Float32Values> ReadFloat32(std::string_view name, std::span<const int64_t> shape) const;

 private:
  TensorFile(MappedFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  static Result<TensorFile> Parse(MappedFile file, std::string name);

  MappedFile file_;
  std::string name_;
  TensorFileContents contents_;
  std::unordered_map<std::string_view, size_t> index_;  // keys point to the entries' names
};

// Whether a file with these first bytes (16 are enough) is in a format that TensorFile reads.
bool LooksLikeTensorFile(std::span<const std::byte> beginning);

}  // namespace anchorsplat
