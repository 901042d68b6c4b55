#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "core/result.h"
#include "dataset/scene_reader.h"
#include "train/photometric_objective.h"

namespace anchorsplat {

// Fast repeated access to an object's high-resolution pictures. Stored views are read from the data set. Views rendered
// on demand, which takes tenths of a second each, are rendered once and cached in a folder as PNG, cropped to what they
// show. Safe for several threads and several programs at once.
class TrueViews {
 public:
  // `cache`: folder for all objects of all trainings. Created with the first view.
  TrueViews(SceneEntry entry, const Scene& scene, const std::filesystem::path& cache);

  // Photographs opened by `picture`, of the sizes of `views`. They have no object on a background, so all unmasked
  // pixels count.
  TrueViews(const std::vector<Camera>& views, std::function<Result<ViewPicture>(size_t view)> picture);

  // Picture over the object's background. Errors: those of Scene::HighPicture, ReadImage and WritePng.
  Result<TrueView> Load(size_t view) const;

  // Renders those of `views` that are neither stored nor cached. Faster than on demand, as the mesh is opened once.
  Status Make(std::span<const size_t> views) const;

  // Picture in a window, which must be inside the view. The view stays in memory, cropped to the object, at 8 bits:
  // opening its file takes longer than the window.
  Result<TrueView> LoadWindow(size_t view, const PixelBox& window) const;
  // The `object` box that Load returns.
  Result<PixelBox> Box(size_t view) const;

 private:
  // A picture cropped to what it shows, 3 or 4 channels.
  struct Part {
    Image picture;
    PixelBox box;             // position in the view; same size as the picture
    Buffer<uint8_t> ignored;  // [H,W] of the picture, not 0: no target there; empty: none ignored
  };
  struct Kept;
  struct File {
    std::filesystem::path path;
    int x = 0, y = 0;  // position of its upper left corner in the view
  };

  std::optional<File> Find(size_t view) const;
  Result<Part> Read(size_t view) const;
  Result<std::shared_ptr<const Kept>> Keep(size_t view) const;

  SceneEntry entry_;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> stored_;  // pictures in the data set by view; empty paths for the others
  std::vector<std::string> names_;
  std::vector<std::array<int, 2>> sizes_;                       // width and height
  std::function<Result<ViewPicture>(size_t view)> photograph_;  // of a capture; else empty
  std::array<float, 3> background_{};
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const Kept>> kept_;  // by view
};

// Bounding box of non-background pixels of a picture with 3 or 4 channels: alpha above 0 or, without alpha, another
// colour than the background.
PixelBox ObjectBox(const Image& picture, const std::array<float, 3>& background);

}  // namespace anchorsplat
