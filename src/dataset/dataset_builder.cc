#include "dataset/dataset_builder.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "dataset/job_list.h"
#include "dataset/object_builder.h"
#include "dataset/process_pool.h"
#include "dataset/unfinished_objects.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/file_lock.h"

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

// One build: what is there, what is wanted, and the lists that say so after every object.
class DatasetBuild {
 public:
  DatasetBuild(const fs::path& dataset, const DatasetBuildOptions& options) : dataset_(dataset), options_(options) {}

  // Reads the lists of earlier builds and finds out which objects are wanted.
  Status Plan(const std::vector<std::string>& meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(manifest_, CollectRecords(dataset_));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto earlier, ReadFailures(dataset_));
    JobList todo = ListJobs(meshes, options_.recipe, manifest_, earlier);
    if (todo.jobs.empty() && todo.failures.empty()) {
      return Error{ErrorCode::kBadArgument, "the libraries have no object to build a data set of"};
    }
    jobs_ = std::move(todo.jobs);
    for (ObjectJob& job : jobs_) {
      job.licence = options_.licence;
      job.creator = options_.creator;
    }
    CarryFailures(meshes, earlier);
    for (const ObjectFailure& failure : todo.failures) Fail(failure);
    report_.objects = std::ssize(jobs_) + std::ssize(todo.failures);
    report_.failed = std::ssize(todo.failures);
    ChooseWanted();
    return WriteLists();
  }

  // Makes the wanted ones, a process each.
  Status Run() {
    progress_.emplace("objects", std::ssize(wanted_));
    Status lists;
    ANCHORSPLAT_RETURN_IF_ERROR(RunProcesses(
        std::ssize(wanted_), [&](int64_t i) { return Task(*wanted_[static_cast<size_t>(i)]); },
        [&](int64_t i, const ProcessEnd& end) {
          const std::string note = TakeResult(*wanted_[static_cast<size_t>(i)], end);
          lists = WriteLists();
          progress_->Advance(1, note);
          return lists.ok();
        },
        {.jobs = options_.jobs, .timeout_seconds = options_.timeout_seconds}));
    progress_.reset();
    return lists;
  }

  DatasetBuildReport Report() {
    for (const ObjectJob& job : jobs_) {
      report_.failed += static_cast<int64_t>(failures_.count(job.name));
      const auto there = manifest_.find(job.name);
      report_.rejected += there != manifest_.end() && there->second.rejected ? 1 : 0;
    }
    report_.interrupted = StopRequested();
    return report_;
  }

 private:
  // What failed before has failed still, unless it is tried again.
  void CarryFailures(const std::vector<std::string>& meshes, const std::vector<ObjectFailure>& earlier) {
    for (const ObjectFailure& failure : earlier) {
      // Libraries are looked into on every build.
      const bool asked_for = std::find(meshes.begin(), meshes.end(), failure.source) != meshes.end();
      if (failure.stage == kReadStage && asked_for) continue;
      if (!options_.retry && manifest_.count(failure.name) == 0) failures_.emplace(failure.name, failure);
    }
  }

  void Fail(ObjectFailure failure) {
    LogWarning(Cat(failure.name, " failed (", failure.stage, "): ", failure.message));
    const std::string name = failure.name;
    failures_.insert_or_assign(name, std::move(failure));
  }

  void ChooseWanted() {
    for (const ObjectJob& job : jobs_) {
      const auto there = manifest_.find(job.name);
      if (there != manifest_.end() && !options_.overwrite) {
        ++report_.there_already;
        report_.other_settings += SameSettings(there->second, job) ? 0 : 1;
      } else if (failures_.count(job.name) == 0 || options_.overwrite) {
        wanted_.push_back(&job);
        unfinished_.insert(job.name);
      }
    }
  }

  Status WriteLists() const {
    std::vector<ObjectFailure> list;
    for (const auto& [name, failure] : failures_) list.push_back(failure);
    ANCHORSPLAT_RETURN_IF_ERROR(WriteFailures(dataset_, list));
    ANCHORSPLAT_RETURN_IF_ERROR(WriteManifest(dataset_, manifest_));
    return WriteUnfinished(dataset_, {unfinished_.begin(), unfinished_.end()});
  }

  ProcessTask Task(const ObjectJob& job) const {
    const fs::path folder = BuildingFolder(dataset_, job.name);
    std::error_code ignored;
    if (options_.overwrite) fs::remove_all(folder, ignored);
    const fs::path file = folder.string() + ".job";
    // A job that cannot be written fails in the process, which says why.
    (void)WriteWholeFile(file, ToJsonText(job), true);
    return ProcessTask{{options_.program.string(), "dataset", "object", file.string(), "-o", dataset_.string(),
                        "--threads", std::to_string(options_.threads), "--quiet"},
                       folder.string() + ".log"};
  }

  // Puts the object into the manifest or among the failures; a word about it.
  std::string TakeResult(const ObjectJob& job, const ProcessEnd& end) {
    const fs::path folder = BuildingFolder(dataset_, job.name);
    failures_.erase(job.name);
    auto record = end.ok() ? ReadRecord(dataset_ / job.name) : Error{ErrorCode::kIo, ""};
    if (record.ok()) {
      ++report_.built;
      unfinished_.erase(job.name);
      const std::string note = Cat(job.name, ": ", Fixed(record->train_psnr, 2), " dB, ",
                                   WithThousands(record->gaussians), " Gaussians in ", HumanSeconds(end.seconds));
      manifest_.insert_or_assign(job.name, *std::move(record));
      std::error_code ignored;
      for (const char* ending : {".job", ".log", ".lock"}) fs::remove(folder.string() + ending, ignored);
      return note;
    }
    if (!StopRequested() || end.timed_out) {
      ObjectFailure failure = DescribeFailure(job, folder, end, options_.timeout_seconds);
      if (end.ok()) failure.message = record.error().message;
      Fail(std::move(failure));
      unfinished_.erase(job.name);
    }
    return job.name;
  }

  const fs::path dataset_;
  const DatasetBuildOptions& options_;
  Manifest manifest_;
  std::map<std::string, ObjectFailure> failures_;
  std::vector<ObjectJob> jobs_;
  std::vector<const ObjectJob*> wanted_;
  std::set<std::string> unfinished_;  // wanted, and not yet made
  std::optional<Progress> progress_;
  DatasetBuildReport report_;
};

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

  DatasetBuild build(dataset, options);
  ANCHORSPLAT_RETURN_IF_ERROR(build.Plan(meshes));
  ANCHORSPLAT_RETURN_IF_ERROR(build.Run());
  DatasetBuildReport report = build.Report();
  report.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return report;
}

}  // namespace anchorsplat
