#include "fit/checkpoint_guard.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/fingerprint.h"
#include "core/text.h"
#include "fit/fitter.h"
#include "io/atomic_file.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

bool SamePlace(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return AbsoluteName(a) == AbsoluteName(b) || fs::equivalent(a, b, code);
}

// Fingerprints mean nothing to users and are not shown.
bool IsFingerprint(const nlohmann::json& value) {
  return value.is_string() && value.get_ref<const std::string&>().size() == Fingerprint().text().size() &&
         value.get_ref<const std::string&>().find_first_not_of("0123456789abcdef") == std::string::npos;
}

// Settings with their option names. Compared in this order: earlier options change the defaults of later ones.
constexpr std::pair<std::string_view, std::string_view> kOptions[] = {
    {"steps", "--steps"},
    {"seed", "--seed"},
    {"strategy", "--strategy"},
    {"mode", "--mode"},
    {"pixel", "--pixel"},
    {"pixel_upscale", "--upscale"},
    {"max_gaussians", "--max-gaussians"},
    {"cap_max", "--max-gaussians"},
    {"mip_filter", "--mip-filter"},
    {"exposure_from", "--exposure"},
    {"sh_degree", "--sh-degree"},
    {"ssim_weight", "--ssim-weight"},
    {"profile", "--profile"},
    {"background", "--background"},
    {"opacity_reset", "--opacity-reset"},
    {"grow_grad2d", "--grow-grad2d"},
    {"revised_opacity", "--revised-opacity"},
    {"min_opacity", "--min-opacity"},
};

// The option's name, or the setting's own if there is no option.
std::string Spoken(const std::string& key) {
  const auto found = std::ranges::find(kOptions, key, &std::pair<std::string_view, std::string_view>::first);
  return std::string(found == std::end(kOptions) ? std::string_view(key) : found->second);
}

// The value as the user would give it: --exposure is stored as its first step, negative if off.
std::string SpokenValue(const std::string& key, const nlohmann::json& value) {
  if (key != "exposure_from" || !value.is_number()) return Printable(value.dump());
  return value.get<double>() < 0 ? "off" : Cat("on from step ", value.dump());
}

// "--strategy absgrad" is the default strategy with absgrad set.
nlohmann::json WithPreset(nlohmann::json settings) {
  if (settings.is_object() && settings.value("strategy", nlohmann::json()) == "default" &&
      settings.value("absgrad", nlohmann::json()) == true) {
    settings["strategy"] = "absgrad";
  }
  return settings;
}

}  // namespace

Status CompareSettings(const std::string& file, const std::string& theirs, const std::string& ours) {
  if (theirs == ours) return {};
  const auto a = WithPreset(nlohmann::json::parse(theirs, nullptr, false)),
             b = WithPreset(nlohmann::json::parse(ours, nullptr, false));
  if (a.is_object() && b.is_object()) {
    std::vector<std::string> keys;
    for (const auto& [key, option] : kOptions) keys.emplace_back(key);
    for (const auto& [key, value] : b.items()) keys.push_back(key);
    for (const std::string& key : keys) {
      const auto found = a.find(key), own = b.find(key);
      if (found == a.end() || own == b.end() || *found == *own) continue;
      const nlohmann::json& value = *own;
      const std::string how =
          IsFingerprint(value) ? "differs" : Cat("is ", SpokenValue(key, *found), ", here ", SpokenValue(key, value));
      return Error{ErrorCode::kBadArgument, Cat(file, ": is a checkpoint of another run: its ", Spoken(key), " ", how)};
    }
    // Only fits with a far shell have these; that difference was already reported through the start.
    for (const auto& [key, value] : b.items()) {
      if (a.contains(key)) continue;
      return Error{ErrorCode::kBadFile, Cat(file, ": is a checkpoint of another version, without ", key)};
    }
  }
  for (const auto& [key, value] : a.items()) {
    if (b.is_object() && b.contains(key)) continue;
    return Error{ErrorCode::kBadArgument,
                 Cat(file, ": is a checkpoint of another run: it has ", Spoken(key), ", which is not given here")};
  }
  return Error{ErrorCode::kBadArgument, Cat(file, ": is a checkpoint of another run")};
}

Status CheckCheckpoint(const fs::path& checkpoint, std::span<const fs::path> outputs, bool resume, bool overwrite,
                       const std::function<bool(const fs::path&)>& is_checkpoint) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(checkpoint));
  for (const fs::path& output : outputs) {
    if (!output.empty() && SamePlace(output, checkpoint)) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--checkpoint ", checkpoint.string(), ": is also the output; pass another file")};
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(checkpoint));
  if (!Exists(checkpoint) || resume) return {};  // reading it will check what it is
  if (!(is_checkpoint ? is_checkpoint : IsFitCheckpoint)(checkpoint)) {
    return Error{ErrorCode::kExists,
                 Cat(checkpoint.string(), " exists and is not a checkpoint; pass another file with --checkpoint")};
  }
  if (overwrite) return {};
  return Error{ErrorCode::kExists,
               Cat(checkpoint.string(), " was left by an interrupted run; --resume continues it, -w starts over")};
}

void RemoveCheckpoint(const fs::path& checkpoint, bool (*is_checkpoint)(const fs::path&)) {
  std::error_code ignored;
  if (is_checkpoint(checkpoint)) fs::remove(checkpoint, ignored);
}

void RecordWhatWasLeft(const fs::path& checkpoint, std::span<const fs::path> outputs) {
  const std::vector<std::string> left = FilesLeftWith(checkpoint);
  for (const fs::path& output : outputs) {
    if (std::find(left.begin(), left.end(), AbsoluteName(output)) != left.end()) RecordOwnFile(output);
  }
}

Result<std::optional<FileLock>> HoldCheckpoint(const fs::path& checkpoint) {
  if (checkpoint.empty()) return std::optional<FileLock>();
  auto lock = FileLock::TakeAndRemove(checkpoint.string() + ".lock");
  if (lock.ok()) return std::optional<FileLock>(*std::move(lock));
  if (lock.error().code != ErrorCode::kExists) return lock.error();
  return Error{ErrorCode::kExists,
               Cat(checkpoint.string(), ": in use by another run; pass another output or another --checkpoint")};
}

}  // namespace anchorsplat
