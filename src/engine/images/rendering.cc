#include "images/rendering.h"

#include <cstddef>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "core/text.h"
#include "images/png_file.h"
#include "io/atomic_file.h"

namespace anchorsplat {

Status WriteRendering(const std::filesystem::path& path, const Image& image, const WriteOptions& options,
                      const std::string& comment) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  auto bytes = EncodePng(image, true, comment);
  if (!bytes.ok()) return Error{bytes.error().code, Cat(path.string(), ": ", bytes.error().message)};
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(*bytes));
  return file.Commit();
}

bool IsOwnRendering(const std::filesystem::path& path) {
  std::string head(256, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), std::ssize(head));
  return IsMarkedAsRendering(std::string_view(head).substr(0, static_cast<size_t>(file.gcount())));
}

}  // namespace anchorsplat
