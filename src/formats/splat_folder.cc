#include "formats/splat_folder.h"

#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/file_system.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Names of what a trainer writes at a step: "ckpt_", its number, "_rank0.pt"; in a folder, a file of it.
struct Steps {
  const char* folder;  // of results
  std::string_view before, after;
  const char* inside;
};
constexpr Steps kSteps[] = {{"point_cloud", "iteration_", "", "point_cloud.ply"},
                            {"ckpts", "ckpt_", "_rank0.pt", ""},
                            {"nerfstudio_models", "step-", ".ckpt", ""}};

std::optional<int64_t> StepOf(const Steps& steps, const std::string& name) {
  if (!name.starts_with(steps.before) || !name.ends_with(steps.after)) return std::nullopt;
  int64_t step = 0;
  const char* const end = name.data() + name.size() - steps.after.size();
  const auto [stop, failed] = std::from_chars(name.data() + steps.before.size(), end, step);
  return failed == std::errc() && stop == end && step >= 0 ? std::optional(step) : std::nullopt;
}

// Of the steps in this folder; nothing where there are none.
std::optional<FoundSplat> LatestIn(const fs::path& folder, const Steps& steps) {
  std::map<int64_t, fs::path> found;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed), end;
  for (; !failed && entry != end; entry.increment(failed)) {
    const std::optional<int64_t> step = StepOf(steps, entry->path().filename().string());
    if (!step) continue;
    const fs::path file = *steps.inside != '\0' ? entry->path() / steps.inside : entry->path();
    if (IsFile(file)) found[*step] = file;
  }
  if (found.empty()) return std::nullopt;
  FoundSplat latest{found.rbegin()->second, {}};
  found.erase(std::prev(found.end()));
  for (const auto& [step, file] : found) {
    const fs::path name = *steps.inside != '\0' ? file.parent_path().filename() : file.filename();
    latest.others += (latest.others.empty() ? "" : ", ") + name.string();
  }
  return latest;
}

}  // namespace

FoundSplat FindSplat(const fs::path& path) {
  if (!IsFolder(path)) return {path, {}};
  for (const char* name : {"meta.json", "lod-meta.json"}) {
    if (fs::path meta = path / name; Exists(meta)) return {meta, {}};
  }
  for (const Steps& steps : kSteps) {
    for (const fs::path& folder : {path / steps.folder, path}) {
      if (const std::optional<FoundSplat> latest = LatestIn(folder, steps)) return *latest;
    }
    const fs::path inside = path / steps.inside;
    const fs::path named = path.has_filename() ? path : path.parent_path();  // "iteration_7000/"
    if (StepOf(steps, named.filename().string()) && IsFile(inside)) return {inside, {}};
  }
  return {path, {}};
}

}  // namespace anchorsplat
