#include "io/file_bytes.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "core/text.h"
#include "io/input_file.h"
#include "io/input_record.h"

namespace anchorsplat {

Result<OpenedFile> OpenForReading(const std::filesystem::path& path) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (status.type() == std::filesystem::file_type::not_found) {
    return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file")};
  }
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": ", code.message())};
  if (status.type() != std::filesystem::file_type::regular) {
    return Error{ErrorCode::kIo,
                 Cat(path.string(), ": expected a file, found ",
                     status.type() == std::filesystem::file_type::directory ? "a folder" : "something else")};
  }
  OpenedFile file;
  file.size = std::filesystem::file_size(path, code);
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": ", code.message())};
  file.handle.reset(std::fopen(path.c_str(), "rb"));
  if (!file.handle) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot be opened: ", std::strerror(errno))};
  RecordInput(::fileno(file.handle.get()), path);
  return file;
}

Result<std::string> ReadFileBytes(const std::filesystem::path& path, uint64_t max_bytes) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return file.ReadAll(max_bytes);
}

}  // namespace anchorsplat
