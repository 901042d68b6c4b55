#include "formats/file_bytes.h"

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/text.h"

namespace anchorsplat {

Result<OpenedFile> OpenForReading(const std::filesystem::path& path) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (status.type() == std::filesystem::file_type::not_found) {
    return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file")};
  }
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": ", code.message())};
  if (!std::filesystem::is_regular_file(status)) {
    return Error{ErrorCode::kIo, Cat(path.string(), ": expected a file, found ",
                                     std::filesystem::is_directory(status) ? "a folder" : "something else")};
  }
  OpenedFile file;
  file.size = std::filesystem::file_size(path, code);
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": ", code.message())};
  file.handle.reset(std::fopen(path.c_str(), "rb"));
  if (!file.handle) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot be opened: ", std::strerror(errno))};
  return file;
}

Result<std::string> ReadFileBytes(const std::filesystem::path& path, uint64_t max_bytes) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedFile file, OpenForReading(path));
  if (file.size > max_bytes) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", HumanBytes(file.size), ", more than the ",
                                          HumanBytes(max_bytes), " allowed")};
  }
  std::string bytes(file.size, '\0');
  if (std::fread(bytes.data(), 1, bytes.size(), file.handle.get()) != bytes.size()) {
    return Error{ErrorCode::kIo, Cat(path.string(), ": could not be read to its end")};
  }
  return bytes;
}

}  // namespace anchorsplat
