#include "dataset/derived_object.h"

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <system_error>

#include "core/file_system.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/text.h"
#include "dataset/picture_defects.h"
#include "dataset/process_log.h"
#include "dataset/process_pool.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// The settings that a base and its derived objects must share.
std::string Shared(ObjectSettings settings) {
  settings.from.clear();
  settings.after.clear();
  return ToJson(settings).dump();
}

// Creates a hard link, or a copy if the file system has none.
Status Link(const fs::path& from, const fs::path& to) {
  std::error_code code;
  fs::create_hard_link(from, to, code);
  if (code) fs::copy_file(from, to, fs::copy_options::overwrite_existing, code);
  if (code) return Error{ErrorCode::kIo, Cat(to.string(), ": cannot copy ", from.string(), ": ", code.message())};
  return {};
}

Status LinkFolder(const fs::path& from, const fs::path& to, const std::set<std::string>& without) {
  std::error_code code;
  fs::create_directories(to, code);
  if (code) return Error{ErrorCode::kIo, Cat(to.string(), ": cannot create this folder: ", code.message())};
  for (fs::directory_iterator it(from, code), end; !code && it != end; it.increment(code)) {
    const fs::path name = it->path().filename();
    if (without.contains(name.string())) continue;
    std::error_code ignored;
    ANCHORSPLAT_RETURN_IF_ERROR(it->is_directory(ignored) ? LinkFolder(it->path(), to / name, without)
                                                          : Link(it->path(), to / name));
  }
  if (code) return Error{ErrorCode::kIo, Cat(from.string(), ": ", code.message())};
  return {};
}

Status RunEnhance(const fs::path& program, const fs::path& splat, const fs::path& low, double upscale,
                  const fs::path& output) {
  if (program.empty()) return Error{ErrorCode::kBadArgument, "nothing to enhance with: no program was given"};
  const fs::path log = output.string() + ".log";
  ProcessEnd how;
  ANCHORSPLAT_RETURN_IF_ERROR(RunProcesses(
      1,
      [&](int64_t) {
        return ProcessTask{{program.string(), "enhance", splat.string(), "-o", output.string(), "--cameras",
                            low.string(), "--upscale", Cat(upscale), "--threads", Cat(ThreadCount()), "--quiet", "-w"},
                           log};
      },
      [&](int64_t, const ProcessEnd& end) {
        how = end;
        return true;
      },
      {}));
  if (StopRequested()) return Error{ErrorCode::kInterrupted, Cat(splat.string(), ": stopped while enhancing")};
  if (!how.ok()) return Error{ErrorCode::kIo, Cat(splat.string(), ": enhance: ", LastWords(log))};
  return {};
}

}  // namespace

Result<ObjectRecord> TakeViewsOfBase(const ObjectJob& job, const fs::path& dataset, const fs::path& folder) {
  const fs::path base = dataset / job.base;
  if (!IsFile(base / kRecordName)) {
    return Error{ErrorCode::kNotFound, Cat(job.name, ": is made from ", base.string(), ", which is missing")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(base / kRecordName));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ObjectRecord record, ObjectRecordFrom(json.root()));
  if (Shared(record.settings) != Shared(job.settings)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(job.name, ": is made from ", base.string(),
                     ", which was made with other settings than the recipe's; -w makes both again")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(LinkFolder(base, folder, {kRecordName, kSplatName, "gaussian_splatting", "job.json"}));
  return record;
}

Result<GaussianCloud> PassSplat(const ObjectJob& job, const ObjectRecord& base, const fs::path& dataset,
                                const fs::path& folder, const fs::path& program) {
  const fs::path splat = dataset / job.base / kSplatName;
  const bool enhanced = job.settings.after == "enhanced";
  const fs::path passed = folder / Cat("passed.", enhanced ? "ply" : job.settings.after);
  if (enhanced) {
    const double upscale = static_cast<double>(base.high_size) / base.low_size;
    ANCHORSPLAT_RETURN_IF_ERROR(RunEnhance(program, splat, folder / std::to_string(base.low_size), upscale, passed));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(splat));
    ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(passed, cloud, {.overwrite = true}));
  }
  auto result = ReadCloud(passed);
  std::error_code ignored;
  fs::remove(passed, ignored);
  fs::remove(passed.string() + ".log", ignored);
  return result;
}

}  // namespace anchorsplat
