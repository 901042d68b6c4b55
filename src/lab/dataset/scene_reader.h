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
  std::string kind = {};  // its recipe entry in the manifest; empty if there is none
  // Side of its high views in pixels, instead of the data set's; 0: unchanged. Only for views rendered on demand.
  int high_size = 0;
};

struct SceneListOptions {
  std::string split = {};  // "train", "validation" or "test" in splits.json (dataset_split.h); empty: all
  bool rejected = false;   // includes objects that the manifest marks as rejected
};

// Lists a data set's objects by name: those of manifest.jsonl or, without it, every folder that looks like an object
// (also `dataset` itself). That is one with two folders named after a resolution, as in published data sets: 256/ and
// 1024/ in 3DGS-SR and MVImgNet, 200/ and 800/ in NeRF-Synthetic.
//
// Errors: kNotFound: no folder, no objects, or no splits.json for a split; kBadFile.
Result<std::vector<SceneEntry>> ListScenes(const std::filesystem::path& dataset, const SceneListOptions& options = {});

// A low-quality splat, the low views it was fitted to, and the high views it should look like. Views are sorted by
// picture name; view i of both resolutions has the same pose. Thread-safe.
class Scene {
 public:
  // Reads cameras only. Poses come from the lowest resolution's sparse/0, the single intrinsics of high pictures from
  // the highest resolution's cameras.txt, as in upstream's loader.
  // Errors: kNotFound, kBadFile, kIo: no resolutions, unreadable cameras, more than one high camera; kBadArgument:
  // high_size for views that are not rendered on demand.
  static Result<Scene> Open(const SceneEntry& entry);

  const std::string& name() const { return name_; }
  const std::filesystem::path& low_folder() const { return low_folder_; }
  // The project the splat was fitted to (fit/training_views.h): the low folder or, with defects, captured/.
  std::filesystem::path fitted_project() const;
  const std::vector<Camera>& low_views() const { return low_views_; }
  const std::vector<Camera>& high_views() const { return high_views_; }
  const std::vector<size_t>& held_out() const { return held_out_; }  // views not used to fit the splat
  const std::array<float, 3>& background() const { return background_; }
  const std::optional<ObjectRecord>& record() const { return record_; }  // for data sets built by this program

  // The low-quality splat: gsplat's checkpoint with the most steps, or splat.ply if the splat has a render mode or
  // comments, which such checkpoints cannot store.
  Result<GaussianCloud> LowSplat() const;
  Result<std::filesystem::path> LowSplatPath() const;  // its file

  // Sets the side of high views, pixels. kBadArgument: they are not rendered on demand.
  Status ResizeHighViews(int size);

  // Pictures as stored, rgb or rgba. High views that are not stored are rendered, to the same bits.
  // Errors: those of ReadImage; kNotFound: neither picture nor mesh; kBadFile: wrong size.
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
  // Created when the first picture is rendered.
  struct Renderer {
    std::mutex mutex;
    std::optional<RayTracer> tracer;
  };
  std::shared_ptr<Renderer> renderer_ = std::make_shared<Renderer>();
};

inline constexpr const char* kMeshName = "mesh.safetensors";  // of objects whose high views are rendered on demand

}  // namespace anchorsplat
