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

// A value of a checkpoint that is not a tensor; std::monostate is Python's None.
using TensorFileScalar = std::variant<std::monostate, bool, int64_t, double, std::string>;

// What a tensor file holds. Names are paths with dots through nested dictionaries and lists ("splats.means",
// "optimizer.param_groups.0.lr").
struct TensorFileContents {
  std::vector<TensorEntry> tensors;  // in file order, names unique
  std::map<std::string, TensorFileScalar> scalars;
  std::map<std::string, std::string> metadata;  // __metadata__ of safetensors
};

// Row-major float32 values of a tensor: where they lie in the file when that is possible, else a converted copy.
class Float32Values {
 public:
  explicit Float32Values(std::span<const float> view) : view_(view) {}
  explicit Float32Values(Buffer<float> copy) : copy_(std::move(copy)), view_(copy_) {}
  Float32Values(Float32Values&&) = default;  // moving a Buffer leaves its elements where they are
  Float32Values& operator=(Float32Values&&) = default;

  std::span<const float> values() const { return view_; }
  bool is_view() const { return copy_.empty(); }

 private:
  Buffer<float> copy_;
  std::span<const float> view_;
};

// Named host arrays of a checkpoint, by memory map: opening reads the directory only, and weights are paged in where
// they are used. Entries, and views taken from them, live as long as the TensorFile (moving it is fine). About files
// that shrink while they are open see io/mapped_file.h.
//
// Formats, found by content:
//  * PyTorch's zip container (torch.save since 1.6) and its older bare pickles. The pickle is read as data: whatever is
//    not a tensor, number, text, list or dictionary is refused by name, nothing is ever executed.
//    A dictionary under the key "state_dict" stands for its contents, and "module." before a name (left by
//    DistributedDataParallel) is dropped.
//  * safetensors.
class TensorFile {
 public:
  // Errors: kNotFound; kIo, also for folders, pipes and devices; kBadFile with path, byte and reason: cut off, damaged
  // or hostile, unknown format, big-endian, TorchScript, two tensors of the same name.
  static Result<TensorFile> Open(const std::filesystem::path& path);
  // The same for bytes in memory; `name` takes the place of the path in messages.
  static Result<TensorFile> FromBytes(Buffer<std::byte> bytes, std::string name);

  const std::string& name() const { return name_; }  // the path, for messages
  std::span<const TensorEntry> tensors() const { return contents_.tensors; }
  const std::map<std::string, TensorFileScalar>& scalars() const { return contents_.scalars; }
  const std::map<std::string, std::string>& metadata() const { return contents_.metadata; }

  // The tensor of that name, or null.
  const TensorEntry* Find(std::string_view name) const;

  // The tensor of that name. Errors (kBadFile with the path): there is none; another shape.
  Result<const TensorEntry*> Require(std::string_view name) const;
  Result<const TensorEntry*> Require(std::string_view name, std::span<const int64_t> shape) const;

  // Values of a tensor of exactly this shape; float16, bfloat16, float64 and strided tensors are converted to a copy.
  // Errors (kBadFile with the path): no such tensor; another shape; not floating-point.
  Result<Float32Values> ReadFloat32(std::string_view name, std::span<const int64_t> shape) const;

 private:
  TensorFile(MappedFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  static Result<TensorFile> Parse(MappedFile file, std::string name);

  MappedFile file_;
  std::string name_;
  TensorFileContents contents_;
  std::unordered_map<std::string_view, size_t> index_;  // keys view the entries' names
};

// True when the first bytes of a file are those of a format that TensorFile reads. 16 bytes are enough.
bool LooksLikeTensorFile(std::span<const std::byte> beginning);

}  // namespace anchorsplat
