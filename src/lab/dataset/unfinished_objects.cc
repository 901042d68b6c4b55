#include "dataset/unfinished_objects.h"

#include <algorithm>
#include <map>
#include <system_error>
#include <utility>

#include "core/file_system.h"
#include "core/text.h"
#include "dataset/object_builder.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kListName = "unfinished";  // reserved in object_name.cc
constexpr uint64_t kMaxListBytes = uint64_t{1} << 28;

}  // namespace

Status WriteUnfinished(const fs::path& dataset, const std::vector<std::string>& names) {
  const fs::path path = dataset / kBuildingName / kListName;
  if (names.empty()) {
    std::error_code code;
    fs::remove(path, code);
    if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot remove: ", code.message())};
    return {};
  }
  std::string text;
  for (const std::string& name : names) text += name + "\n";
  return WriteWholeFile(path, text, true);
}

Result<std::vector<UnfinishedObject>> FindUnfinished(const fs::path& dataset,
                                                     const std::vector<ObjectFailure>& failures) {
  std::map<std::string, UnfinishedObject> found;
  const fs::path building = dataset / kBuildingName, list = building / kListName;
  std::error_code ignored;
  if (Exists(list)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(list, kMaxListBytes));
    for (size_t at = 0; at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      const std::string name = Printable(text.substr(at, end - at));
      if (!name.empty()) found[name] = {name, true, {}};
      at = end + 1;
    }
  }
  std::error_code code;
  for (fs::directory_iterator it(building, code), end; !code && it != end; it.increment(code)) {
    if (!it->is_directory(ignored)) continue;
    const std::string name = it->path().filename().string();
    UnfinishedObject& object = found[name];
    object.name = name;
    object.folder = it->path();
  }
  for (const ObjectFailure& failure : failures) found.erase(failure.name);
  std::vector<UnfinishedObject> objects;
  for (auto& [name, object] : found) objects.push_back(std::move(object));
  return objects;
}

}  // namespace anchorsplat
