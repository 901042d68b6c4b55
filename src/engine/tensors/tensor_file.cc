#include "tensors/tensor_file.h"

#include <algorithm>
#include <new>
#include <utility>

#include "core/text.h"
#include "tensors/safetensors.h"
#include "tensors/torch_file.h"

namespace anchorsplat {

namespace {

Error Bad(const std::string& file, const std::string& what) { return {ErrorCode::kBadFile, Cat(file, ": ", what)}; }

Result<TensorFileContents> ReadContents(std::span<const std::byte> bytes, const std::string& file) {
  if (bytes.empty()) return Bad(file, "is empty");
  if (LooksLikeTorchZip(bytes)) return ReadTorchZip(bytes, file);
  if (LooksLikeTorchLegacy(bytes)) return ReadTorchLegacy(bytes, file);
  if (LooksLikeSafetensors(bytes)) return ReadSafetensors(bytes, file);
  return Bad(file, "is neither a PyTorch checkpoint (.pth, .pt) nor a safetensors file");
}

}  // namespace

bool LooksLikeTensorFile(std::span<const std::byte> beginning) {
  return LooksLikeTorchZip(beginning) || LooksLikeTorchLegacy(beginning) || LooksLikeSafetensors(beginning);
}

Result<TensorFile> TensorFile::Open(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(MappedFile file, MappedFile::Open(path));
  return Parse(std::move(file), path.string());
}

Result<TensorFile> TensorFile::FromBytes(Buffer<std::byte> bytes, std::string name) {
  return Parse(MappedFile::FromBytes(std::move(bytes)), std::move(name));
}

Result<TensorFile> TensorFile::Parse(MappedFile file, std::string name) {
  TensorFile opened(std::move(file), std::move(name));
  try {
    ANCHORSPLAT_ASSIGN_OR_RETURN(opened.contents_, ReadContents(opened.file_.bytes(), opened.name_));
    for (size_t i = 0; i < opened.contents_.tensors.size(); ++i) {
      const std::string& tensor = opened.contents_.tensors[i].name;
      if (!opened.index_.emplace(tensor, i).second) {
        return Bad(opened.name_, Cat("holds two tensors named \"", Printable(tensor), "\""));
      }
    }
  } catch (const std::bad_alloc&) {
    return Bad(opened.name_, "its directory does not fit into memory");
  }
  return opened;
}

const TensorEntry* TensorFile::Find(std::string_view name) const {
  const auto found = index_.find(name);
  return found == index_.end() ? nullptr : &contents_.tensors[found->second];
}

Result<const TensorEntry*> TensorFile::Require(std::string_view name) const {
  const TensorEntry* entry = Find(name);
  if (entry != nullptr) return entry;
  const std::string first =
      contents_.tensors.empty() ? "" : Cat(", the first is \"", Printable(contents_.tensors[0].name), "\"");
  return Bad(name_, Cat("has no tensor \"", Printable(std::string(name)), "\" (it holds ", contents_.tensors.size(),
                        " tensors", first, ")"));
}

Result<const TensorEntry*> TensorFile::Require(std::string_view name, std::span<const int64_t> shape) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, Require(name));
  if (std::ranges::equal(entry->shape, shape)) return entry;
  TensorEntry expected;
  expected.shape.assign(shape.begin(), shape.end());
  return Bad(name_, Cat("tensor \"", Printable(entry->name), "\" has shape ", entry->ShapeText(), ", expected ",
                        expected.ShapeText()));
}

Result<Float32Values> TensorFile::ReadFloat32(std::string_view name, std::span<const int64_t> shape) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, Require(name, shape));
  if (const auto view = ViewFloat32(*entry)) return Float32Values(*view);
  Result<Buffer<float>> copy = CopyFloat32(*entry);
  if (!copy.ok()) return Bad(name_, copy.error().message);
  return Float32Values(*std::move(copy));
}

}  // namespace anchorsplat
