#include "dataset/object_builder.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/file_system.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "dataset/backdrop.h"
#include "dataset/derived_object.h"
#include "dataset/object_fit.h"
#include "dataset/object_name.h"
#include "dataset/picture_defects.h"
#include "dataset/picture_project.h"
#include "dataset/scene_reader.h"
#include "fit/fit.h"
#include "fit/picture_cache.h"
#include "fit/view_quality.h"
#include "formats/cloud_io.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint_writer.h"
#include "io/atomic_file.h"
#include "io/file_lock.h"
#include "io/input_record.h"
#include "scene/mesh_file.h"
#include "scene/mesh_reader.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kJobName = "job.json";
constexpr const char* kViewsDone = "views.json";
constexpr const char* kFitCheckpoint = "fit.checkpoint";
constexpr int64_t kCheckpointEvery = 1000;  // steps: a few seconds of work

Status Remove(const fs::path& path) {
  std::error_code code;
  fs::remove_all(path, code);
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot remove: ", code.message())};
  return {};
}

Status MakeFolder(const fs::path& path) {
  std::error_code code;
  fs::create_directories(path, code);
  if (code) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot create this folder: ", code.message())};
  return {};
}

// Reuses an earlier attempt's folder if it was the same job, else creates a fresh one.
Status OpenFolder(const ObjectJob& job, const fs::path& folder) {
  const std::string text = ToJsonText(job);
  if (IsFile(folder / kJobName)) {
    RecordOwnFile(folder / kJobName);
    auto earlier = ReadObjectJob(folder / kJobName);
    if (earlier.ok() && ToJsonText(*earlier) == text) return {};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Remove(folder));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(folder));
  return WriteWholeFile(folder / kJobName, text, true);
}

Status EnterStage(const fs::path& folder, const std::string& stage) {
  return WriteWholeFile(folder / kStageName, stage, true);
}

// Loads the mesh as it will be rendered, and fills the record.
Result<RayTracer> PrepareMesh(const ObjectJob& job, ObjectRecord& record) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported, ReadMesh(job.source));
  for (const std::string& warning : imported.warnings) LogWarning(Cat(job.source, ": ", warning));
  record.origin = imported.origin;
  record.transparent_triangles = DropInvisibleTriangles(imported.mesh).transparent;
  record.triangles = std::ssize(imported.mesh.triangles);
  record.textures = std::ssize(imported.mesh.textures);
  auto mesh = NormalizedToUnitCube(std::move(imported.mesh));
  if (!mesh.ok()) return Error{ErrorCode::kBadFile, Cat(job.source, ": ", mesh.error().message)};
  record.fingerprint = MeshFingerprint(*mesh);
  if (job.settings.backdrop) {
    const double half_side = kBackdropShare * job.settings.views.rig.radius;
    ANCHORSPLAT_RETURN_IF_ERROR(AddBackdrop(*mesh, half_side, job.settings.seed));
  }
  return RayTracer::Create(*std::move(mesh));
}

Status MakeViews(const ObjectJob& job, const fs::path& folder, ObjectRecord& record) {
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "mesh"));
  const Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const RayTracer tracer, PrepareMesh(job, record));
  record.read_seconds = watch.Total();
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "views"));
  for (const int size : {job.settings.views.low_size, job.settings.views.high_size}) {
    ANCHORSPLAT_RETURN_IF_ERROR(Remove(folder / std::to_string(size)));  // from an interrupted attempt
  }
  ViewSetOptions options = job.settings.views;
  options.overwrite = true;
  record.views = options.rig.views;
  record.low_size = options.low_size;
  record.high_size = options.high_size;
  record.background = options.background;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewSetCost cost, WriteViewSet(tracer, folder, options));
  record.view_seconds = cost.seconds;
  if (!options.store_high) {
    ANCHORSPLAT_RETURN_IF_ERROR(WriteMeshFile(folder / kMeshName, tracer.mesh(), {.overwrite = true}));
  }
  return {};
}

// Views of an object given as pictures.
Status CopyViews(const ObjectJob& job, const fs::path& folder, ObjectRecord& record) {
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "views"));
  if (job.settings.backdrop) {
    return Error{ErrorCode::kBadArgument, Cat(job.source, ": a backdrop works only with meshes, not with pictures")};
  }
  PictureProjectOptions options;
  options.downscale = job.settings.downscale;
  options.background = job.settings.views.background;
  options.seed = job.settings.seed;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureProjectReport report, WritePictureProject(job.source, folder, options));
  record.origin.name = job.name;
  record.fingerprint = Cat("pictures-", StableHash(job.source));
  record.views = report.views;
  record.low_size = report.low_size;
  record.high_size = report.high_size;
  record.background = report.background;
  record.view_seconds = report.seconds;
  return {};
}

double Upscale(const ObjectRecord& record) { return static_cast<double>(record.high_size) / record.low_size; }

// Writes the low-quality splat where readers of the layout expect it, and as PLY.
Status WriteSplats(const GaussianCloud& cloud, const fs::path& folder, const ObjectRecord& record) {
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "files"));
  const int64_t steps = record.settings.fit_steps;
  const fs::path checkpoint = CheckpointPath(folder / std::to_string(record.low_size), steps);
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(checkpoint.parent_path()));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteGsplatCheckpoint(checkpoint, cloud, steps - 1, {.overwrite = true}));
  return WriteCloud(folder / kSplatName, cloud, {.overwrite = true});
}

// Writes the project with defects for the fit.
Status Capture(const ObjectJob& job, const fs::path& folder, const ObjectRecord& record) {
  const ObjectSettings& s = job.settings;
  return WriteCapturedProject(folder / std::to_string(record.low_size), folder / kCapturedName, s.defects,
                              record.background, s.hold_out, s.seed);
}

// Opens the views for the fit, training and held-out.
Result<TrainingViews> FittedViews(const ObjectJob& job, const fs::path& folder, const ObjectRecord& record) {
  const fs::path low = folder / std::to_string(record.low_size);
  const fs::path project = job.settings.defects.Any() ? folder / kCapturedName : low;
  return OpenProject(project, {.hold_out = job.settings.hold_out});
}

void NoteQuality(const ViewQuality& train, const ViewQuality& held_out, ObjectRecord& record) {
  record.train_psnr = train.psnr;
  record.train_ssim = train.ssim;
  record.held_out_psnr = held_out.psnr;
  record.held_out_ssim = held_out.ssim;
}

Status FitSplat(const ObjectJob& job, const fs::path& folder, ObjectRecord& record) {
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "fit"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views, FittedViews(job, folder, record));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FitOptions options,
                               ToFitOptions(job.settings, Upscale(record), record.background));
  if (views.points.size() == 0) {
    return Error{ErrorCode::kBadFile, Cat(job.source, ": no camera sees any of its surface")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud initial, InitialCloudOf(job.settings, options, views));
  record.initial_points = initial.size();
  FitControl control;
  control.checkpoint = folder / kFitCheckpoint;
  control.checkpoint_every = kCheckpointEvery;
  control.resume = true;
  // An unusable checkpoint, such as another version's, must not make the object fail.
  control.anew_if_unfit = true;
  control.deliver = [&](const Fitted& fitted) -> Status {
    if (fitted.report.interrupted) return {};
    return WriteSplats(fitted.cloud, folder, record);
  };
  const auto fitted = Fit(views, std::move(initial), options, control);
  if (!fitted.ok()) return fitted.error();
  const FitReport& report = fitted->report;
  if (report.interrupted) {
    return Error{ErrorCode::kInterrupted,
                 Cat(job.name, ": stopped after ", report.steps, " of ", options.steps, " steps")};
  }
  record.gaussians = fitted->cloud.size();
  NoteQuality(report.train, report.held_out, record);
  record.fit_seconds = report.seconds;
  return {};
}

// Measures a splat that was not fitted to these views, rendered as its file says.
Status MeasureDerived(const ObjectJob& job, const fs::path& folder, const GaussianCloud& cloud, ObjectRecord& record) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views, FittedViews(job, folder, record));
  ANCHORSPLAT_ASSIGN_OR_RETURN(FitOptions options, ToFitOptions(job.settings, Upscale(record), record.background));
  RenderOptions& render = options.objective.render;
  render.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  const PixelModel pixel = PixelModelAt(options, options.steps);
  PictureCache train(views.train, render.background, 0), held_out(views.held_out, render.background, 0);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewQuality on_train, MeasureQuality(cloud, render, train, pixel));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewQuality on_others, MeasureQuality(cloud, render, held_out, pixel));
  NoteQuality(on_train, on_others, record);
  return {};
}

// Builds a derived object: everything from its base but the splat.
Status DeriveSplat(const ObjectJob& job, const fs::path& dataset, const fs::path& folder, const fs::path& program,
                   ObjectRecord& record) {
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, "base"));
  const Stopwatch watch;
  ANCHORSPLAT_ASSIGN_OR_RETURN(ObjectRecord base, TakeViewsOfBase(job, dataset, folder));
  ANCHORSPLAT_RETURN_IF_ERROR(EnterStage(folder, job.settings.after));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, PassSplat(job, base, dataset, folder, program));
  base.name = record.name;
  base.recipe = record.recipe;
  base.stem = record.stem;
  base.settings = record.settings;
  record = std::move(base);
  record.gaussians = cloud.size();
  ANCHORSPLAT_RETURN_IF_ERROR(MeasureDerived(job, folder, cloud, record));
  record.read_seconds = record.view_seconds = 0;
  record.fit_seconds = watch.Total();
  return WriteSplats(cloud, folder, record);
}

// Saves a stage's results: the record so far.
Status Keep(const fs::path& path, const ObjectRecord& record) {
  return WriteWholeFile(path, ToJson(record).dump(1, ' ', false, Json::error_handler_t::replace) + "\n", true);
}

Status Recall(const fs::path& path, ObjectRecord& record) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(record, ObjectRecordFrom(json.root()));
  return {};
}

// Checks that the object may take its folder: it must not belong to anything else, nor contain the object's source.
Status CheckPlace(const ObjectJob& job, const fs::path& target) {
  std::error_code code;
  const fs::file_status there = fs::symlink_status(target, code);
  if (there.type() == fs::file_type::not_found || there.type() == fs::file_type::none) return {};
  if (there.type() != fs::file_type::directory) {
    return Error{ErrorCode::kExists,
                 Cat(target.string(), ": is a file where the object's folder should be; move it away")};
  }
  if (!IsFile(target / kRecordName)) {
    return Error{ErrorCode::kExists, Cat(target.string(),
                                         ": is a folder where the object's should be, but not an object of a "
                                         "data set (it has no ",
                                         kRecordName, ")")};
  }
  // Covers sources read by an earlier attempt; a mesh may be an address inside a library.
  const fs::path folder = RealPath(target), source = RealPath(job.source);
  if (std::mismatch(folder.begin(), folder.end(), source.begin(), source.end()).first == folder.end()) {
    return Error{ErrorCode::kBadArgument, Cat(target.string(), ": holds the input ", job.source,
                                              ", which would be overwritten; write to another data set")};
  }
  return CheckHoldsNoInput(target);
}

// Renames the finished folder into place, replacing an older object. Removes the job file last, because a folder
// without it is begun anew.
Status Publish(const ObjectJob& job, const fs::path& folder, const fs::path& target) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPlace(job, target));
  for (const char* name : {kViewsDone, kFitCheckpoint, kStageName}) ANCHORSPLAT_RETURN_IF_ERROR(Remove(folder / name));
  fs::path replaced = folder;
  replaced += ".replaced";
  ANCHORSPLAT_RETURN_IF_ERROR(Remove(replaced));
  std::error_code code;
  const fs::file_status there = fs::symlink_status(target, code);
  code.clear();
  if (there.type() != fs::file_type::not_found) fs::rename(target, replaced, code);
  if (!code) fs::rename(folder, target, code);
  if (code) return Error{ErrorCode::kIo, Cat(target.string(), ": cannot rename the finished object: ", code.message())};
  ANCHORSPLAT_RETURN_IF_ERROR(Remove(replaced));
  return Remove(target / kJobName);
}

}  // namespace

fs::path BuildingFolder(const fs::path& dataset, const std::string& name) { return dataset / kBuildingName / name; }

fs::path CheckpointPath(const fs::path& low_folder, int64_t steps) {
  return low_folder / "gaussian_splatting" / "ckpts" / Cat("ckpt_", steps - 1, "_rank0.pt");
}

std::string ToJsonText(const ObjectJob& job) {
  const Json json = {
      {"name", job.name},       {"source", job.source},   {"recipe", job.recipe}, {"settings", ToJson(job.settings)},
      {"licence", job.licence}, {"creator", job.creator}, {"base", job.base}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<ObjectJob> ReadObjectJob(const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(path));
  ObjectJob job;
  for (const auto& [key, text] : std::initializer_list<std::pair<const char*, std::string*>>{
           {"name", &job.name}, {"source", &job.source}, {"recipe", &job.recipe}}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, json.root().Get(key));
    ANCHORSPLAT_ASSIGN_OR_RETURN(*text, value.Text());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue settings, json.root().Get("settings"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(job.settings, ObjectSettingsFrom(settings));
  for (const auto& [key, text] : std::initializer_list<std::pair<const char*, std::string*>>{
           {"licence", &job.licence}, {"creator", &job.creator}, {"base", &job.base}}) {
    if (const auto value = json.root().Find(key)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(*text, value->Text());
    }
  }
  return job;
}

namespace {

// Makes the views and the fit.
Status MakeObject(const ObjectJob& job, const fs::path& folder, ObjectRecord& record) {
  if (IsFile(folder / kViewsDone)) {
    ANCHORSPLAT_RETURN_IF_ERROR(Recall(folder / kViewsDone, record));
  } else {
    // Detects impossible settings before rendering views.
    const auto options = ToFitOptions(job.settings, 1, job.settings.views.background);
    if (!options.ok()) return options.error();
    const bool pictures = IsFolder(job.source);
    ANCHORSPLAT_RETURN_IF_ERROR((pictures ? CopyViews : MakeViews)(job, folder, record));
    if (job.settings.defects.Any()) ANCHORSPLAT_RETURN_IF_ERROR(Capture(job, folder, record));
    if (record.origin.licence.empty() && !job.licence.empty()) {
      record.origin.licence = job.licence;
      record.origin.licence_source = "--licence";
    }
    if (record.origin.creator.empty()) record.origin.creator = job.creator;
    ANCHORSPLAT_RETURN_IF_ERROR(Keep(folder / kViewsDone, record));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(FitSplat(job, folder, record));
  record.rejected = record.train_psnr < job.settings.min_train_psnr;
  if (record.rejected) {
    record.reason = Cat("PSNR of the fit on its training views is ", Fixed(record.train_psnr, 2), " dB, below ",
                        Fixed(job.settings.min_train_psnr, 2));
  }
  return {};
}

}  // namespace

Result<ObjectRecord> BuildObject(const ObjectJob& job, const fs::path& dataset, const fs::path& program) {
  const fs::path folder = BuildingFolder(dataset, job.name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPlace(job, dataset / job.name));  // before hours of work
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(folder.parent_path()));
  // Waits for a process whose parent was killed and that is still ending.
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FileLock lock, FileLock::Take(folder.string() + ".lock", true));
  ANCHORSPLAT_RETURN_IF_ERROR(OpenFolder(job, folder));
  ObjectRecord record;
  record.name = job.name;
  record.source = job.source;
  record.recipe = job.recipe;
  record.stem = VariantStem(job.name);
  record.settings = job.settings;
  if (IsFile(folder / kRecordName)) {  // interrupted while being renamed
    ANCHORSPLAT_RETURN_IF_ERROR(Recall(folder / kRecordName, record));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(job.settings.IsDerived() ? DeriveSplat(job, dataset, folder, program, record)
                                                         : MakeObject(job, folder, record));
    ANCHORSPLAT_RETURN_IF_ERROR(Keep(folder / kRecordName, record));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Publish(job, folder, dataset / job.name));
  return record;
}

}  // namespace anchorsplat
