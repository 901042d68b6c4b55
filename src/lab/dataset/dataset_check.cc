#include "dataset/dataset_check.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "core/file_system.h"
#include "core/parallel.h"
#include "core/text.h"
#include "dataset/dataset_split.h"
#include "dataset/object_builder.h"
#include "dataset/picture_defects.h"
#include "dataset/scene_reader.h"
#include "dataset/unfinished_objects.h"
#include "fit/training_views.h"
#include "formats/cloud_io.h"
#include "images/image_io.h"
#include "scene/mesh_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Checks one object; problems in order of discovery.
class ObjectCheck {
 public:
  ObjectCheck(const fs::path& dataset, const ObjectRecord& record, bool decode)
      : folder_(dataset / record.name), record_(record), decode_(decode) {}

  std::vector<DatasetProblem> Run() && {
    if (!IsFolder(folder_)) {
      Complain(Cat(folder_.string(), ": is in the manifest, but the folder is missing"));
      return std::move(problems_);
    }
    CheckRecord();
    const auto scene = Scene::Open({record_.name, folder_});
    if (!scene.ok()) {
      Complain(scene.error().message);
      return std::move(problems_);
    }
    CheckViews(*scene);
    CheckSplats(*scene);
    return std::move(problems_);
  }

 private:
  void Complain(std::string sentence) { problems_.push_back({record_.name, std::move(sentence)}); }

  void CheckRecord() {
    const fs::path path = folder_ / kRecordName;
    const auto json = JsonFile::Read(path);
    if (!json.ok()) return Complain(json.error().message);
    const auto record = ObjectRecordFrom(json->root());
    if (!record.ok()) return Complain(record.error().message);
    if (ToJson(*record) != ToJson(record_)) Complain(Cat(path.string(), ": differs from the manifest"));
  }

  void CheckPicture(const Camera& camera, const fs::path& folder) {
    if (camera.image.empty()) return Complain(Cat(folder.string(), ": picture ", camera.name, " is missing"));
    ImageSize size;
    if (decode_) {
      const auto image = ReadImage(camera.image);
      if (!image.ok()) return Complain(image.error().message);
      size = {image->width, image->height};
    } else {
      const auto read = ReadImageSize(camera.image);
      if (!read.ok()) return Complain(read.error().message);
      size = *read;
    }
    if (size.width != camera.intrinsics.width || size.height != camera.intrinsics.height) {
      Complain(Cat(camera.image.string(), ": has ", size.width, " x ", size.height, " pixels, its camera ",
                   camera.intrinsics.width, " x ", camera.intrinsics.height));
    }
  }

  void CheckViews(const Scene& scene) {
    const ViewSetOptions& views = record_.settings.views;
    if (std::ssize(scene.low_views()) != record_.views) {
      Complain(Cat(folder_.string(), ": has ", scene.low_views().size(),
                   scene.low_views().size() == 1 ? " view, not " : " views, not ", record_.views));
    }
    for (const Camera& camera : scene.low_views()) CheckPicture(camera, scene.low_folder() / "images");
    if (record_.settings.defects.Any()) {
      const fs::path captured = folder_ / kCapturedName;
      const auto project = OpenProject(captured, {.hold_out = 0});
      if (!project.ok()) {
        Complain(project.error().message);
      } else {
        for (const std::string& name : project->without_picture) {
          Complain(Cat((captured / "images").string(), ": picture ", name, " is missing"));
        }
        for (const Camera& camera : project->train) CheckPicture(camera, captured / "images");
      }
    }
    if (views.store_high) {
      for (const Camera& camera : scene.high_views()) {
        CheckPicture(camera, folder_ / std::to_string(record_.high_size) / "images");
      }
    } else if (decode_) {
      for (size_t i = 0; i < scene.high_views().size(); ++i) {
        if (const auto image = scene.HighPicture(i); !image.ok()) return Complain(image.error().message);
      }
    } else if (const auto mesh = ReadMeshFile(folder_ / kMeshName); !mesh.ok()) {
      Complain(mesh.error().message);
    }
  }

  void CheckSplats(const Scene& scene) {
    CheckSplat("the checkpoint", scene.LowSplat());
    CheckSplat(kSplatName, ReadCloud(folder_ / kSplatName));
  }

  void CheckSplat(const char* what, const Result<GaussianCloud>& cloud) {
    if (!cloud.ok()) return Complain(cloud.error().message);
    if (cloud->size() != record_.gaussians) {
      Complain(Cat(folder_.string(), ": ", what, " has ", cloud->size(), " Gaussians, not ", record_.gaussians));
    }
    for (int64_t i = 0; i < cloud->size(); ++i) {
      if (!IsUsable(*cloud, i)) {
        return Complain(Cat(folder_.string(), ": ", what, ": Gaussian ", i, " has values that are not finite"));
      }
    }
  }

  fs::path folder_;
  const ObjectRecord& record_;
  bool decode_;
  std::vector<DatasetProblem> problems_;
};

bool HasSplits(const fs::path& dataset) { return Exists(dataset / kSplitsName); }

void CheckSplits(const fs::path& dataset, const Manifest& manifest, std::vector<DatasetProblem>& problems) {
  if (!HasSplits(dataset)) return;
  const auto splits = ReadSplits(dataset);
  if (!splits.ok()) {
    problems.push_back({"", splits.error().message});
    return;
  }
  for (const auto& [name, split] : *splits) {
    if (manifest.count(name) == 0) {
      problems.push_back({name, Cat((dataset / kSplitsName).string(), ": is in ", split, ", but not in the manifest")});
    }
  }
  for (const auto& group : VariantGroups(manifest, false)) {
    std::set<std::string> parts;
    for (const std::string& name : group) {
      if (const auto split = splits->find(name); split != splits->end()) parts.insert(split->second);
    }
    if (parts.size() > 1) {
      problems.push_back({group[0], Cat((dataset / kSplitsName).string(), ": variants of one model in several splits: ",
                                        group[0], ", ", group[1], group.size() > 2 ? ", …" : "")});
    }
  }
}

Status CheckFinished(const fs::path& dataset, const Manifest& manifest, std::vector<DatasetProblem>& problems) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto failures, ReadFailures(dataset));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto unfinished, FindUnfinished(dataset, failures));
  for (const UnfinishedObject& object : unfinished) {
    std::string sentence;
    if (!object.listed) {
      sentence =
          Cat(object.folder.string(), ": is unfinished. Continue with the same dataset build, or remove the folder");
    } else if (manifest.count(object.name) > 0) {
      sentence = Cat((dataset / object.name).string(),
                     ": is outdated: the build that replaces it was interrupted. Continue with the same dataset build");
    } else {
      sentence = Cat((dataset / object.name).string(),
                     ": is missing: its build was interrupted. Continue with the same dataset build");
    }
    problems.push_back({object.name, std::move(sentence)});
  }
  return {};
}

}  // namespace

Result<std::vector<DatasetProblem>> CheckDataset(const fs::path& dataset, const DatasetCheckOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Manifest manifest, ReadManifest(dataset));
  std::vector<const ObjectRecord*> records;
  for (const auto& [name, record] : manifest) records.push_back(&record);
  std::vector<std::vector<DatasetProblem>> found(records.size());
  ParallelFor(0, std::ssize(records), 1, [&](int64_t i, int64_t) {
    found[static_cast<size_t>(i)] = ObjectCheck(dataset, *records[static_cast<size_t>(i)], options.decode).Run();
  });
  std::vector<DatasetProblem> problems;
  CheckSplits(dataset, manifest, problems);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckFinished(dataset, manifest, problems));
  std::error_code code;
  for (fs::directory_iterator it(dataset, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    if (Exists(it->path() / kRecordName) && manifest.count(name) == 0 && !name.starts_with(".")) {
      problems.push_back({name, Cat(it->path().string(), ": is not in the manifest; dataset build adds it")});
    }
  }
  for (auto& list : found) problems.insert(problems.end(), list.begin(), list.end());
  std::stable_sort(problems.begin(), problems.end(),
                   [](const DatasetProblem& a, const DatasetProblem& b) { return a.object < b.object; });
  return problems;
}

Result<DatasetSummary> SummarizeDataset(const fs::path& dataset) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Manifest manifest, ReadManifest(dataset));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto failures, ReadFailures(dataset));
  DatasetSummary summary;
  const auto add = [](DatasetSummary::Part& part, const ObjectRecord& record) {
    ++part.objects;
    part.train_psnr += record.train_psnr;
    part.held_out_psnr += record.held_out_psnr;
    part.gaussians += static_cast<double>(record.gaussians);
  };
  for (const auto& [name, record] : manifest) {
    summary.read_seconds += record.read_seconds;
    summary.view_seconds += record.view_seconds;
    summary.fit_seconds += record.fit_seconds;
    if (record.rejected) {
      ++summary.rejected;
      continue;
    }
    ++summary.objects;
    add(summary.all, record);
    add(summary.recipes[record.recipe], record);
    ++summary.licences[record.origin.licence.empty() ? "unknown" : record.origin.licence];
  }
  const auto to_means = [](DatasetSummary::Part& part) {
    const double count = std::max<double>(1, static_cast<double>(part.objects));
    part.train_psnr /= count;
    part.held_out_psnr /= count;
    part.gaussians /= count;
  };
  to_means(summary.all);
  for (auto& [name, part] : summary.recipes) to_means(part);
  summary.failed = std::ssize(failures);
  for (const ObjectFailure& failure : failures) ++summary.failures[failure.stage];
  if (HasSplits(dataset)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Splits splits, ReadSplits(dataset));
    for (const auto& [name, split] : splits) {
      const auto record = manifest.find(name);
      summary.splits[split] += record != manifest.end() && !record->second.rejected ? 1 : 0;
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto unfinished, FindUnfinished(dataset, failures));
  summary.unfinished = std::ssize(unfinished);
  std::error_code code;
  for (fs::recursive_directory_iterator it(dataset, code), end; !code && it != end; it.increment(code)) {
    std::error_code ignored;
    if (it->is_regular_file(ignored)) {
      const uintmax_t size = it->file_size(ignored);
      if (!ignored) summary.bytes += size;
    }
  }
  return summary;
}

}  // namespace anchorsplat
