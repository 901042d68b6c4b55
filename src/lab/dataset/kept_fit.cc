#include "dataset/kept_fit.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "core/stopwatch.h"
#include "core/text.h"
#include "fit/fit.h"
#include "formats/cloud_io.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr int64_t kKeptFitEvery = 500;  // steps: about half a minute at 1024²

// Progress record in the folder: key, state and time.
struct Progressed {
  std::string key;
  double seconds = 0;
  double train_psnr = 0;
  bool done = false;
};

std::optional<Progressed> ReadProgress(const fs::path& path) {
  RecordOwnFile(path);
  const auto file = JsonFile::Read(path);
  if (!file.ok()) return std::nullopt;
  const nlohmann::json& json = file->root().raw();
  try {
    return Progressed{json.at("key"), json.at("seconds"), json.at("train_psnr"), json.at("done")};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // foreign or damaged: starts anew
  }
}

Status WriteProgress(const fs::path& path, const Progressed& progress) {
  const nlohmann::json json = {{"key", progress.key},
                               {"seconds", progress.seconds},
                               {"train_psnr", progress.train_psnr},
                               {"done", progress.done}};
  return WriteWholeFile(path, json.dump(1) + "\n", true);
}

}  // namespace

fs::path KeptSplat(const fs::path& folder) { return folder / "splat.ply"; }

Result<KeptFit> FitAndKeep(const fs::path& folder, const std::string& key,
                           const std::function<Result<FitTask>()>& start) {
  const Stopwatch watch;
  const fs::path splat = KeptSplat(folder), note = folder / "fit.json";
  std::error_code code;
  Progressed progress{key, 0, 0, false};
  if (const auto earlier = ReadProgress(note); earlier && earlier->key == key) {
    progress = *earlier;
    if (progress.done) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloud(splat));
      return KeptFit{std::move(cloud), progress.seconds, progress.train_psnr};
    }
  } else {
    fs::remove_all(folder, code);
  }
  fs::create_directories(folder, code);
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", code.message())};
  ANCHORSPLAT_RETURN_IF_ERROR(WriteProgress(note, progress));

  ANCHORSPLAT_ASSIGN_OR_RETURN(FitTask begin, start());
  FitControl control;
  control.checkpoint = folder / "fit.checkpoint";
  control.checkpoint_every = kKeptFitEvery;
  control.resume = true;
  control.anew_if_unfit = true;  // a mismatch means another version
  control.deliver = [&](const Fitted& fitted) { return WriteCloud(splat, fitted.cloud, {.overwrite = true}); };
  // Saves the time with every checkpoint, so that it adds up over attempts.
  const double before = progress.seconds;
  Status noted;
  control.observe = [&](const Fitter& fitter) {
    if (fitter.step() % kKeptFitEvery != 0) return;
    progress.seconds = before + watch.Total();
    noted = WriteProgress(note, progress);
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitted fitted, Fit(begin.views, std::move(begin.initial), begin.options, control));
  if (!noted.ok()) return noted.error();
  progress = {key, before + watch.Total(), fitted.report.train.psnr, true};
  ANCHORSPLAT_RETURN_IF_ERROR(WriteProgress(note, progress));
  return KeptFit{std::move(fitted.cloud), progress.seconds, progress.train_psnr};
}

}  // namespace anchorsplat
