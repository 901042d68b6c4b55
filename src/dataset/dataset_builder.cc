#include "dataset/dataset_builder.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <set>
#include <system_error>

#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "dataset/file_lock.h"
#include "dataset/job_list.h"
#include "dataset/object_builder.h"
#include "dataset/process_pool.h"
#include "dataset/unfinished_objects.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// The last line of the process's log that says something: its error message.
std::string LastWords(const fs::path& log) {
  const auto text = ReadFileBytes(log, uint64_t{64} << 20);
  if (!text.ok()) return {};
  std::string_view rest = *text;
  while (!rest.empty() && (rest.back() == '\n' || rest.back() == '\r')) rest.remove_suffix(1);
  const size_t line = rest.rfind('\n');
  return Printable(std::string(line == std::string_view::npos ? rest : rest.substr(line + 1)), 1000);
}

ObjectFailure DescribeFailure(const ObjectJob& job, const fs::path& folder, const ProcessEnd& end,
                              double timeout_seconds) {
  ObjectFailure failure{job.name, job.source, "mesh", {}};
  if (auto stage = ReadFileBytes(folder / kStageName, 100); stage.ok()) failure.stage = Printable(*stage);
  const fs::path log = folder.string() + ".log";
  if (end.timed_out) {
    failure.message = Cat("took longer than ", HumanSeconds(timeout_seconds));
  } else if (end.signal != 0) {
    failure.message = Cat("ended by signal ", end.signal, " (", strsignal(end.signal), "): see ", log.string());
  } else {
    failure.message = LastWords(log);
    for (const std::string_view prefix : {"anchorsplat: ", "error: "}) {
      if (failure.message.starts_with(prefix)) failure.message.erase(0, prefix.size());
    }
  }
  return failure;
}

bool SameSettings(const ObjectRecord& record, const ObjectJob& job) {
  ObjectJob there = job;
  there.recipe = record.recipe;
  there.settings = record.settings;
  return ToJsonText(there) == ToJsonText(job);
}

Result<ObjectRecord> ReadRecord(const fs::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(folder / kRecordName));
  return ObjectRecordFrom(json.root());
}

}  // namespace

Result<DatasetBuildReport> BuildDataset(const std::vector<std::string>& meshes, const fs::path& dataset,
                                        const DatasetBuildOptions& options) {
  const auto begin = Clock::now();
  if (meshes.empty()) return Error{ErrorCode::kBadArgument, "no meshes to build a data set of"};
  const fs::path building = dataset / kBuildingName;
  std::error_code code;
  fs::create_directories(building, code);
  if (code) return Error{ErrorCode::kIo, Cat(building.string(), ": cannot make this folder: ", code.message())};
  const auto lock = FileLock::Take(building / "lock", false);
  if (!lock.ok() && lock.error().code == ErrorCode::kExists) {
    return Error{ErrorCode::kExists, Cat(dataset.string(), ": another build is at work here")};
  }
  if (!lock.ok()) return lock.error();

  ANCHORSPLAT_ASSIGN_OR_RETURN(Manifest manifest, CollectRecords(dataset));
  std::map<std::string, ObjectFailure> failures;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto earlier, ReadFailures(dataset));
  JobList todo = ListJobs(meshes, options.recipe, manifest, earlier);
  std::vector<ObjectJob>& jobs = todo.jobs;
  if (jobs.empty() && todo.failures.empty()) {
    return Error{ErrorCode::kBadArgument, "the libraries have no object to build a data set of"};
  }
  for (ObjectJob& job : jobs) {
    job.licence = options.licence;
    job.creator = options.creator;
  }
  const auto asked_for = [&](const std::string& library) {
    return std::find(meshes.begin(), meshes.end(), library) != meshes.end();
  };
  for (const ObjectFailure& failure : earlier) {
    // Libraries are looked into on every build.
    if (failure.stage == kReadStage && asked_for(failure.source)) continue;
    if (!options.retry && manifest.count(failure.name) == 0) failures.emplace(failure.name, failure);
  }
  for (const ObjectFailure& failure : todo.failures) {
    LogWarning(Cat(failure.name, " failed (", failure.stage, "): ", failure.message));
    failures.insert_or_assign(failure.name, failure);
  }
  std::set<std::string> unfinished;
  const auto write_lists = [&]() -> Status {
    std::vector<ObjectFailure> list;
    for (const auto& [name, failure] : failures) list.push_back(failure);
    ANCHORSPLAT_RETURN_IF_ERROR(WriteFailures(dataset, list));
    ANCHORSPLAT_RETURN_IF_ERROR(WriteManifest(dataset, manifest));
    return WriteUnfinished(dataset, {unfinished.begin(), unfinished.end()});
  };

  DatasetBuildReport report;
  report.objects = std::ssize(jobs) + std::ssize(todo.failures);
  report.failed = std::ssize(todo.failures);
  std::vector<const ObjectJob*> wanted;
  for (const ObjectJob& job : jobs) {
    const auto there = manifest.find(job.name);
    if (there != manifest.end() && !options.overwrite) {
      ++report.there_already;
      report.other_settings += SameSettings(there->second, job) ? 0 : 1;
    } else if (failures.count(job.name) == 0 || options.overwrite) {
      wanted.push_back(&job);
      unfinished.insert(job.name);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(write_lists());

  Progress progress("objects", std::ssize(wanted));
  const auto start = [&](int64_t i) {
    const ObjectJob& job = *wanted[static_cast<size_t>(i)];
    const fs::path folder = BuildingFolder(dataset, job.name);
    if (options.overwrite) fs::remove_all(folder, code);
    const fs::path file = folder.string() + ".job";
    // A job that cannot be written fails in the process, which says why.
    (void)WriteWholeFile(file, ToJsonText(job), true);
    return ProcessTask{{options.program.string(), "dataset", "object", file.string(), "-o", dataset.string(),
                        "--threads", std::to_string(options.threads), "--quiet"},
                       folder.string() + ".log"};
  };
  Status lists;
  const auto ended = [&](int64_t i, const ProcessEnd& end) {
    const ObjectJob& job = *wanted[static_cast<size_t>(i)];
    const fs::path folder = BuildingFolder(dataset, job.name);
    const bool stopping = StopRequested();
    failures.erase(job.name);
    std::string note = job.name;
    auto record = end.ok() ? ReadRecord(dataset / job.name) : Error{ErrorCode::kIo, ""};
    if (record.ok()) {
      ++report.built;
      unfinished.erase(job.name);
      note += Cat(": ", Fixed(record->train_psnr, 2), " dB, ", WithThousands(record->gaussians), " Gaussians in ",
                  HumanSeconds(end.seconds));
      manifest.insert_or_assign(job.name, *std::move(record));
      for (const char* ending : {".job", ".log", ".lock"}) fs::remove(folder.string() + ending, code);
    } else if (!stopping || end.timed_out) {
      ObjectFailure failure = DescribeFailure(job, folder, end, options.timeout_seconds);
      if (end.ok()) failure.message = record.error().message;
      LogWarning(Cat(job.name, " failed (", failure.stage, "): ", failure.message));
      failures.insert_or_assign(job.name, std::move(failure));
      unfinished.erase(job.name);
    }
    lists = write_lists();
    progress.Advance(1, note);
    return lists.ok();
  };
  ANCHORSPLAT_RETURN_IF_ERROR(RunProcesses(std::ssize(wanted), start, ended,
                                           {.jobs = options.jobs, .timeout_seconds = options.timeout_seconds}));
  ANCHORSPLAT_RETURN_IF_ERROR(lists);

  for (const ObjectJob& job : jobs) {
    report.failed += static_cast<int64_t>(failures.count(job.name));
    const auto there = manifest.find(job.name);
    report.rejected += there != manifest.end() && there->second.rejected ? 1 : 0;
  }
  report.interrupted = StopRequested();
  report.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return report;
}

}  // namespace anchorsplat
