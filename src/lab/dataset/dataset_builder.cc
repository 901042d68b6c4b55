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
#include "dataset/process_log.h"
#include "dataset/process_pool.h"
#include "dataset/unfinished_objects.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/file_lock.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

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
  }
  return failure;
}

constexpr const char* kBaseStage = "base";  // of derived objects (object_builder.cc)

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

// One build: existing and wanted objects, and the lists that are updated after every object.
class DatasetBuild {
 public:
  DatasetBuild(const fs::path& dataset, const DatasetBuildOptions& options) : dataset_(dataset), options_(options) {}

  // Reads lists of earlier builds and determines the wanted objects.
  Status Plan(const std::vector<std::string>& meshes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(manifest_, CollectRecords(dataset_));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto earlier, ReadFailures(dataset_));
    JobList todo = ListJobs(meshes, options_.recipe, manifest_, earlier);
    if (todo.jobs.empty() && todo.failures.empty()) {
      return Error{ErrorCode::kBadArgument, "the libraries contain no objects to build a data set from"};
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

  // Builds the wanted objects, one process each; derived ones after all others.
  Status Run() {
    progress_.emplace("objects", std::ssize(wanted_));
    Status status = RunAll(Wanted(false));
    if (status.ok() && !StopRequested()) status = RunAll(WithBase(Wanted(true)));
    progress_.reset();
    return status;
  }

  // Writes the wanted jobs as files, for processes started elsewhere.
  Result<std::vector<PlannedObject>> WriteJobs() const {
    std::vector<PlannedObject> planned;
    for (const bool derived : {false, true}) {
      for (const ObjectJob* job : Wanted(derived)) {
        std::error_code ignored;
        if (options_.overwrite) fs::remove_all(BuildingFolder(dataset_, job->name), ignored);
        const fs::path file = BuildingFolder(dataset_, job->name).string() + ".job";
        ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(file, ToJsonText(*job), true));
        planned.push_back({job->name, job->source, job->base, file});
      }
    }
    return planned;
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
  std::vector<const ObjectJob*> Wanted(bool derived) const {
    std::vector<const ObjectJob*> jobs;
    for (const ObjectJob* job : wanted_) {
      if (job->settings.IsDerived() == derived) jobs.push_back(job);
    }
    return jobs;
  }

  // Jobs whose base exists; records the others as failed.
  std::vector<const ObjectJob*> WithBase(std::vector<const ObjectJob*> jobs) {
    std::erase_if(jobs, [&](const ObjectJob* job) {
      const bool remade = !options_.overwrite || unfinished_.count(job->base) == 0;
      if (manifest_.count(job->base) > 0 && failures_.count(job->base) == 0 && remade) return false;
      Fail({job->name, job->source, kBaseStage,
            Cat("is made from ", job->base, ", which is missing",
                failures_.count(job->base) > 0 ? " because it failed; --retry retries both" : "")});
      unfinished_.erase(job->name);
      progress_->Advance(1, job->name);
      return true;
    });
    return jobs;
  }

  Status RunAll(const std::vector<const ObjectJob*>& jobs) {
    Status lists;
    ANCHORSPLAT_RETURN_IF_ERROR(RunProcesses(
        std::ssize(jobs), [&](int64_t i) { return Task(*jobs[static_cast<size_t>(i)]); },
        [&](int64_t i, const ProcessEnd& end) {
          const std::string note = TakeResult(*jobs[static_cast<size_t>(i)], end);
          lists = WriteLists();
          progress_->Advance(1, note);
          return lists.ok();
        },
        {.jobs = options_.jobs, .timeout_seconds = options_.timeout_seconds}));
    if (lists.ok() && jobs.empty()) lists = WriteLists();
    return lists;
  }

  // Keeps earlier failures, except those to be retried.
  void CarryFailures(const std::vector<std::string>& meshes, const std::vector<ObjectFailure>& earlier) {
    for (const ObjectFailure& failure : earlier) {
      // Libraries are read again in every build.
      const bool asked_for = std::find(meshes.begin(), meshes.end(), failure.source) != meshes.end();
      if (failure.stage == kReadStage && asked_for) continue;
      if (failure.stage == kBaseStage && manifest_.count(BaseOf(failure.name)) > 0) continue;  // its base now exists
      if (!options_.retry && manifest_.count(failure.name) == 0) failures_.emplace(failure.name, failure);
    }
  }

  // Base of a job of this build; empty if none.
  std::string BaseOf(const std::string& name) const {
    const auto job = std::find_if(jobs_.begin(), jobs_.end(), [&](const ObjectJob& j) { return j.name == name; });
    return job == jobs_.end() ? std::string() : job->base;
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
    // If this fails, the process will report it.
    (void)WriteWholeFile(file, ToJsonText(job), true);
    return ProcessTask{{options_.program.string(), "dataset", "object", file.string(), "-o", dataset_.string(),
                        "--threads", std::to_string(options_.threads), "--quiet"},
                       folder.string() + ".log"};
  }

  // Records the outcome in the manifest or among the failures. Returns a short description.
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
  std::set<std::string> unfinished_;  // wanted and not built yet
  std::optional<Progress> progress_;
  DatasetBuildReport report_;
};

Result<FileLock> TakeDataset(const std::vector<std::string>& meshes, const fs::path& dataset) {
  if (meshes.empty()) return Error{ErrorCode::kBadArgument, "no meshes to build a data set from"};
  const fs::path building = dataset / kBuildingName;
  std::error_code code;
  fs::create_directories(building, code);
  if (code) return Error{ErrorCode::kIo, Cat(building.string(), ": cannot create this folder: ", code.message())};
  auto lock = FileLock::Take(building / "lock", false);
  if (!lock.ok() && lock.error().code == ErrorCode::kExists) {
    return Error{ErrorCode::kExists, Cat(dataset.string(), ": another build is running here")};
  }
  return lock;
}

}  // namespace

Result<DatasetPlan> PlanDataset(const std::vector<std::string>& meshes, const fs::path& dataset,
                                const DatasetBuildOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FileLock lock, TakeDataset(meshes, dataset));
  DatasetBuild build(dataset, options);
  ANCHORSPLAT_RETURN_IF_ERROR(build.Plan(meshes));
  DatasetPlan plan;
  ANCHORSPLAT_ASSIGN_OR_RETURN(plan.wanted, build.WriteJobs());
  plan.report = build.Report();
  return plan;
}

Result<DatasetBuildReport> BuildDataset(const std::vector<std::string>& meshes, const fs::path& dataset,
                                        const DatasetBuildOptions& options) {
  const auto begin = Clock::now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FileLock lock, TakeDataset(meshes, dataset));
  DatasetBuild build(dataset, options);
  ANCHORSPLAT_RETURN_IF_ERROR(build.Plan(meshes));
  ANCHORSPLAT_RETURN_IF_ERROR(build.Run());
  DatasetBuildReport report = build.Report();
  report.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return report;
}

}  // namespace anchorsplat
