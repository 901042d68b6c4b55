#include "formats/splat_folder.h"

#include <charconv>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/file_system.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Naming of a trainer's files per step: "ckpt_", step, "_rank", rank, ".pt"; for folders, the file inside.
struct Steps {
  const char* folder;  // result folder; empty: files are beside such folders
  std::string_view before, rank, after;
  const char* inside;
};
constexpr Steps kSteps[] = {{"point_cloud", "iteration_", "", "", "point_cloud.ply"},
                            {"ckpts", "ckpt_", "_rank", ".pt", ""},
                            {"nerfstudio_models", "step-", "", ".ckpt", ""},
                            {"", "chkpnt", "", ".pth", ""}};

// A step and rank (0 if names have none).
using StepAndRank = std::pair<int64_t, int64_t>;

std::optional<int64_t> TakeNumber(std::string_view& text) {
  int64_t number = 0;
  const auto [stop, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failed != std::errc() || number < 0) return std::nullopt;
  text.remove_prefix(static_cast<size_t>(stop - text.data()));
  return number;
}

std::optional<StepAndRank> StepOf(const Steps& steps, std::string_view name) {
  if (!name.starts_with(steps.before)) return std::nullopt;
  name.remove_prefix(steps.before.size());
  const std::optional<int64_t> step = TakeNumber(name);
  if (!step || !name.starts_with(steps.rank)) return std::nullopt;
  name.remove_prefix(steps.rank.size());
  const std::optional<int64_t> rank = steps.rank.empty() ? 0 : TakeNumber(name);
  return rank && name == steps.after ? std::optional(StepAndRank(*step, *rank)) : std::nullopt;
}

// Files in a folder by step, with the lowest rank.
std::map<int64_t, fs::path> FilesIn(const fs::path& folder, const Steps& steps) {
  std::map<StepAndRank, fs::path> found;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed), end;
  for (; !failed && entry != end; entry.increment(failed)) {
    const std::optional<StepAndRank> step = StepOf(steps, entry->path().filename().string());
    if (!step) continue;
    const fs::path file = *steps.inside != '\0' ? entry->path() / steps.inside : entry->path();
    if (IsFile(file)) found[*step] = file;
  }
  std::map<int64_t, fs::path> files;
  for (const auto& [step, file] : found) files.emplace(step.first, file);
  return files;
}

// The latest step in a folder; none if there are no steps.
std::optional<FoundSplat> LatestIn(const fs::path& folder, const Steps& steps) {
  std::map<int64_t, fs::path> found = FilesIn(folder, steps);
  if (found.empty()) return std::nullopt;
  FoundSplat latest{found.rbegin()->second, {}, true};
  found.erase(std::prev(found.end()));
  for (const auto& [step, file] : found) {
    const fs::path name = *steps.inside != '\0' ? file.parent_path().filename() : file.filename();
    latest.others += (latest.others.empty() ? "" : ", ") + name.string();
  }
  return latest;
}

// Checkpoints beside the result folder of this splat.
std::string CheckpointsIn(const fs::path& folder) {
  std::string names;
  for (const auto& [step, file] : FilesIn(folder, kSteps[std::size(kSteps) - 1])) {
    names += (names.empty() ? "" : ", ") + file.filename().string();
  }
  return names;
}

}  // namespace

FoundSplat FindSplat(const fs::path& path) {
  if (!IsFolder(path)) return {path, {}};
  for (const char* name : {"meta.json", "lod-meta.json"}) {
    if (fs::path meta = path / name; Exists(meta)) return {meta, {}};
  }
  for (const Steps& steps : kSteps) {
    const bool has_folder = *steps.folder != '\0';
    if (std::optional<FoundSplat> latest; has_folder && (latest = LatestIn(path / steps.folder, steps))) {
      const std::string beside = CheckpointsIn(path);
      latest->others += (latest->others.empty() || beside.empty() ? "" : ", ") + beside;
      return *latest;
    }
    if (const std::optional<FoundSplat> latest = LatestIn(path, steps)) return *latest;
    const fs::path inside = path / steps.inside;
    const fs::path named = path.has_filename() ? path : path.parent_path();  // "iteration_7000/"
    if (StepOf(steps, named.filename().string()) && IsFile(inside)) return {inside, {}};
  }
  return {path, {}};
}

}  // namespace anchorsplat
