#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
#include "fit/fitter.h"
#include "io/input_record.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_checksum.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

constexpr const char* kFormat = "anchorsplat fit 4";
// Format 1 lacked fingerprints of pictures and start and the checksum; 2 lacked strategies and filters; 3 stored modes
// as numbers.
constexpr std::array kFormatsBefore = {"anchorsplat fit 1", "anchorsplat fit 2", "anchorsplat fit 3"};

bool IsFormatBefore(const std::string& format) {
  return std::find(kFormatsBefore.begin(), kFormatsBefore.end(), format) != kFormatsBefore.end();
}

constexpr const char* kMotions = "views.motions";
constexpr const char* kExposures = "views.exposures";

// An array of the state and its name in the file.
template <typename Array>
struct Named {
  std::string name;
  std::vector<int64_t> shape;
  Array* values;
  bool held = true;  // false: this state does not have it
};

// Identifies a version of a file: differs for another file, and after modification. Empty if there is none.
std::string VersionOf(const std::string& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return "";
  return Cat(info.st_ino, " ", info.st_size, " ", info.st_mtim.tv_sec, ".", info.st_mtim.tv_nsec);
}

// Every array of a state, in the order of the file. `State` may be const.
template <typename State, typename Array>
std::vector<Named<Array>> ArraysOf(State& state, int64_t n, int64_t coefficients) {
  std::vector<Named<Array>> arrays = {{"cloud.means", {n, 3}, &state.cloud.means},
                                      {"cloud.log_scales", {n, 3}, &state.cloud.log_scales},
                                      {"cloud.quats", {n, 4}, &state.cloud.quats},
                                      {"cloud.opacity_logits", {n}, &state.cloud.opacity_logits},
                                      {"cloud.sh", {n, coefficients, 3}, &state.cloud.sh}};
  for (auto& moments : state.optimizer.moments()) {
    arrays.push_back({Cat("adam.", moments.attribute, ".first"), {n, moments.width}, &moments.first});
    arrays.push_back({Cat("adam.", moments.attribute, ".second"), {n, moments.width}, &moments.second});
  }
  auto& gathered = state.densification.gathered();
  arrays.push_back({"densification.grad2d", {n}, &gathered.grad2d, !gathered.grad2d.empty()});
  arrays.push_back({"densification.count", {n}, &gathered.count, !gathered.count.empty()});
  arrays.push_back({"densification.radii", {n}, &gathered.radii, !gathered.radii.empty()});
  arrays.push_back({"mip_filter", {n}, &state.mip_filter, !state.mip_filter.empty()});
  return arrays;
}

}  // namespace

Status WriteFitCheckpoint(const std::filesystem::path& path, const FitState& state, const std::string& settings) {
  std::vector<TensorEntry> entries;
  for (const auto& array :
       ArraysOf<const FitState, const Buffer<float>>(state, state.cloud.size(), state.cloud.coefficients())) {
    if (array.held) entries.push_back(MakeEntry(array.name, array.shape, *array.values));
  }
  if (!state.motions.empty()) {
    entries.push_back(MakeEntry(kMotions, {static_cast<int64_t>(state.motions.size()) / 6, 6}, state.motions));
  }
  if (!state.exposures.empty()) {
    entries.push_back(MakeEntry(kExposures, {static_cast<int64_t>(state.exposures.size()) / 6, 6}, state.exposures));
  }
  std::string left;
  for (const std::string& file : state.left) left += file + '\n';
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const auto metadata,
      WithChecksum({{"format", kFormat}, {"step", Cat(state.step)}, {"settings", settings}, {"left", left}}, entries));
  return WriteSafetensors(path, entries, metadata, {.overwrite = true});
}

bool IsFitCheckpoint(const std::filesystem::path& path) {
  RecordOwnFile(path);
  const auto file = TensorFile::Open(path);
  if (!file.ok()) return false;
  const auto format = file->metadata().find("format");
  return format != file->metadata().end() && (format->second == kFormat || IsFormatBefore(format->second));
}

void RemoveFitCheckpoint(const std::filesystem::path& path) {
  std::error_code ignored;
  if (IsFitCheckpoint(path)) std::filesystem::remove(path, ignored);
}

std::vector<std::string> FilesLeftWith(const std::filesystem::path& checkpoint) {
  RecordOwnFile(checkpoint);
  std::vector<std::string> files;
  const auto file = TensorFile::Open(checkpoint);
  if (!file.ok()) return files;
  const auto left = file->metadata().find("left");
  if (left == file->metadata().end()) return files;
  std::istringstream lines(left->second);
  for (std::string line; std::getline(lines, line);) {
    const size_t tab = std::min(line.find('\t'), line.size());
    const std::string name = line.substr(0, tab), version = tab < line.size() ? line.substr(tab + 1) : "";
    if (!version.empty() && version == VersionOf(name)) files.push_back(name);
  }
  return files;
}

Status NoteFilesLeft(const std::filesystem::path& checkpoint) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(checkpoint));
  std::map<std::string, std::string> metadata = file.metadata();
  std::istringstream lines(metadata["left"]);
  std::string left;
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find('\t'));
    left += Cat(name, "\t", VersionOf(name), "\n");
  }
  metadata["left"] = left;
  const std::vector<TensorEntry> entries(file.tensors().begin(), file.tensors().end());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto checked, WithChecksum(std::move(metadata), entries));
  return WriteSafetensors(checkpoint, entries, checked, {.overwrite = true});
}

std::string AbsoluteName(const std::filesystem::path& file) { return Printable(AbsolutePath(file).string(), SIZE_MAX); }

void Leave(FitState& state, std::span<const std::filesystem::path> files) {
  state.left.clear();
  for (const std::filesystem::path& file : files) {
    // An existing file that is not the command's own is not replaced: the result will get another name.
    if (!Exists(file) || IsOwnFile(file)) state.left.push_back(AbsoluteName(file));
  }
}

Result<FitState> ReadFitCheckpoint(const std::filesystem::path& path, const std::string& settings) {
  RecordOwnFile(path);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  const auto bad = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", sentence)};
  };
  const auto text = [&](const char* key) {
    const auto found = file.metadata().find(key);
    return found == file.metadata().end() ? std::string() : found->second;
  };
  if (IsFormatBefore(text("format"))) {
    return bad("is a checkpoint of an earlier version, which cannot be resumed; -w starts over");
  }
  if (text("format") != kFormat) return bad("is not a checkpoint of a fit (metadata \"format\")");
  ANCHORSPLAT_RETURN_IF_ERROR(VerifyChecksum(file));
  ANCHORSPLAT_RETURN_IF_ERROR(CompareSettings(path.string(), text("settings"), settings));

  FitState state;
  state.left = FilesLeftWith(path);
  const std::string step = text("step");
  const auto [end, code] = std::from_chars(step.data(), step.data() + step.size(), state.step);
  if (code != std::errc() || end != step.data() + step.size() || state.step < 0) {
    return bad(Cat("expected a number of steps in its metadata, found \"", Printable(step), "\""));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* sh, file.Require("cloud.sh"));
  int degree = 0;
  while (degree <= kMaxShDegree && (sh->shape.size() != 3 || sh->shape[1] != ShCoefficients(degree))) ++degree;
  if (degree > kMaxShDegree) return bad(Cat("tensor \"cloud.sh\" has shape ", sh->ShapeText()));
  state.cloud.sh_degree = degree;
  state.optimizer = CloudOptimizer(state.cloud);
  state.optimizer.set_steps(state.step);
  // Arrays are allocated only after the file is shown to contain them.
  for (const auto& array : ArraysOf<FitState, Buffer<float>>(state, sh->shape[0], state.cloud.coefficients())) {
    // A strategy's sums are all present or all absent; Fitter::Begin knows which are needed.
    const bool optional = array.name == "mip_filter" ||
                          (array.name.starts_with("densification.") && file.Find("densification.count") == nullptr);
    if (optional && file.Find(array.name) == nullptr) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values values, file.ReadFloat32(array.name, array.shape));
    array.values->assign(values.values().begin(), values.values().end());
  }
  if (const TensorEntry* motions = file.Find(kMotions)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values values, file.ReadFloat32(kMotions, motions->shape));
    state.motions.assign(values.values().begin(), values.values().end());
  }
  if (const TensorEntry* exposures = file.Find(kExposures)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Float32Values values, file.ReadFloat32(kExposures, exposures->shape));
    state.exposures.assign(values.values().begin(), values.values().end());
  }
  return state;
}

}  // namespace anchorsplat
