#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/buffer.h"
#include "core/source_dir_for_test.h"
#include "io/file_bytes_for_test.h"

// For tests of tensor files: files in testdata, and builders of zip archives, pickles and safetensors.
namespace anchorsplat::tensor_bytes {

inline std::string ReadTestFile(const std::string& name) {
  return FileBytes(SourceDirForTest() / ("testdata/tensors/" + name));
}

inline Buffer<std::byte> ToBuffer(std::string_view bytes) {
  const auto* begin = reinterpret_cast<const std::byte*>(bytes.data());
  return {begin, begin + bytes.size()};
}

template <typename T>
std::string Little(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// A zip archive of stored entries.
inline std::string MakeZip(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string zip;
  std::string directory;
  for (const auto& [name, data] : files) {
    const auto size = static_cast<uint32_t>(data.size());
    const std::string sizes =
        Little<uint32_t>(0) + Little(size) + Little(size) + Little(static_cast<uint16_t>(name.size()));
    directory += "PK\x01\x02" + std::string(4, '\0') + std::string(8, '\0') + sizes + std::string(12, '\0') +
                 Little(static_cast<uint32_t>(zip.size())) + name;
    zip += "PK\x03\x04" + std::string(10, '\0') + sizes + std::string(2, '\0') + name + data;
  }
  const auto count = static_cast<uint16_t>(files.size());
  return zip + directory + "PK\x05\x06" + std::string(4, '\0') + Little(count) + Little(count) +
         Little(static_cast<uint32_t>(directory.size())) + Little(static_cast<uint32_t>(zip.size())) +
         std::string(2, '\0');
}

// A checkpoint with this pickle and one storage, data/0.
inline std::string MakeCheckpoint(const std::string& pickle, const std::string& storage = std::string(16, '\0')) {
  return MakeZip({{"x/data.pkl", pickle}, {"x/byteorder", "little"}, {"x/data/0", storage}});
}

// Pickle opcodes.
inline std::string Text(const std::string& text) { return "X" + Little(static_cast<uint32_t>(text.size())) + text; }
inline std::string Int(int32_t value) { return "J" + Little(value); }
inline std::string Long(int64_t value) { return "\x8a\x08" + Little(value); }
inline std::string Tuple(const std::vector<std::string>& items) {
  std::string all = "(";
  for (const std::string& item : items) all += item;
  return all + "t";
}
inline std::string Integers(const std::vector<int64_t>& values) {
  std::vector<std::string> items;
  for (const int64_t value : values) items.push_back(Long(value));
  return Tuple(items);
}
inline std::string Tensor(const std::vector<int64_t>& shape, const std::vector<int64_t>& strides, int64_t offset = 0,
                          int64_t stored = 4, const std::string& storage_type = "FloatStorage") {
  const std::string storage =
      Tuple({Text("storage"), "ctorch\n" + storage_type + "\n", Text("0"), Text("cpu"), Long(stored)}) + "Q";
  return "ctorch._utils\n_rebuild_tensor_v2\n" +
         Tuple({storage, Long(offset), Integers(shape), Integers(strides), "\x89", "ccollections\nOrderedDict\n)R"}) +
         "R";
}
inline std::string Dict(const std::vector<std::pair<std::string, std::string>>& members) {
  std::string all = "}(";
  for (const auto& [key, value] : members) all += Text(key) + value;
  return all + "u";
}
inline std::string Pickle(const std::string& body) { return "\x80\x02" + body + "."; }

inline std::string MakeSafetensors(const std::string& header, const std::string& data) {
  return Little(static_cast<uint64_t>(header.size())) + header + data;
}

}  // namespace anchorsplat::tensor_bytes
