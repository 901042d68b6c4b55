#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "dataset/object_record.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {

// An object of a data set, found but not read.
struct SceneEntry {
  std::string name;  // of the folder
  std::filesystem::path folder;
  std::string kind = {};  // the recipe's entry it was made by, as the manifest says; empty where there is none
  // Pixels a side of its high views instead of the data set's own; 0: those. Only where they are made on demand.
  int high_size = 0;
};

struct SceneListOptions {
  std::string split = {};  // "train", "validation", "test": as splits.json says (dataset_split.h); empty: all
  bool rejected = false;   // also objects that the manifest marks as rejected
};

// The objects of a data set, by name: those of manifest.jsonl where there is one, else every folder that looks like an
// object: one with two folders named after a resolution, as the published data sets have (256/ and 1024/ in 3DGS-SR and
// MVImgNet, 200/ and 800/ in NeRF-Synthetic), `dataset` itself included.
//
// Errors: kNotFound: no folder, no objects, no splits.json though a split is asked for; kBadFile.
Result<std::vector<SceneEntry>> ListScenes(const std::filesystem::path& dataset, const SceneListOptions& options = {});

// A low-quality splat, the low views it was made from, and the high views it should look like. Views are in the order
// of their pictures' names; view i of both resolutions is seen from the same place. May be used by several threads.
class Scene {
 public:
  // Reads cameras, nothing large. The lowest resolution's sparse/0 gives the poses, the highest one's cameras.txt the
  // only intrinsics of its pictures, as upstream's loader has it.
  // Errors: kNotFound, kBadFile, kIo: no resolutions, cameras that cannot be read, more than one high camera;
  // kBadArgument: another high_size for views that are not made on demand.
  static Result<Scene> Open(const SceneEntry& entry);

  const std::string& name() const { return name_; }
  const std::filesystem::path& low_folder() const { return low_folder_; }
  // What the splat was fitted to (fit/training_views.h): the low folder or, of an object with defects, captured/.
  std::filesystem::path fitted_project() const;
  const std::vector<Camera>& low_views() const { return low_views_; }
  const std::vector<Camera>& high_views() const { return high_views_; }
  const std::vector<size_t>& held_out() const { return held_out_; }  // views the splat was not trained on
  const std::array<float, 3>& background() const { return background_; }
  const std::optional<ObjectRecord>& record() const { return record_; }  // of data sets we built

  // The low-quality splat: the checkpoint of gsplat's trainer with the most steps; splat.ply of an object whose splat
  // says of itself what such a checkpoint has no place for, its render mode or comments.
  Result<GaussianCloud> LowSplat() const;
  Result<std::filesystem::path> LowSplatPath() const;  // its file

  // High views of `size` pixels a side from now on. kBadArgument: they are not made on demand.
  Status ResizeHighViews(int size);

  // Pictures as they are stored, rgb or rgba; high views that are not stored are rendered, which gives the same bits.
  // Errors: those of ReadImage; kNotFound: no picture and no mesh to make it from; kBadFile: another size.
  Result<Image> LowPicture(size_t view) const;
  Result<Image> HighPicture(size_t view) const;

 private:
  Scene() = default;
  Result<Image> Rendered(size_t view) const;

  std::string name_;
  std::filesystem::path folder_, low_folder_;
  std::vector<Camera> low_views_, high_views_;
  std::vector<size_t> held_out_;
  std::array<float, 3> background_ = {0, 0, 0};
  std::optional<ObjectRecord> record_;
  // Made when the first picture has to be rendered.
  struct Renderer {
    std::mutex mutex;
    std::optional<RayTracer> tracer;
  };
  std::shared_ptr<Renderer> renderer_ = std::make_shared<Renderer>();
};

inline constexpr const char* kMeshName = "mesh.safetensors";  // of objects whose high views are made on demand

}  // namespace anchorsplat
