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

// The high-resolution pictures of one object as training wants them: quickly, again and again. Views that the data set
// stores are read from there; those that it renders on demand, which takes a few tenths of a second each, are rendered
// once and kept in a folder as PNG, cut to the pixels that show something. May be used by several threads and by
// several programs at once.
class TrueViews {
 public:
  // `cache`: folder for all objects of all trainings. Nothing is made before the first view is asked for.
  TrueViews(SceneEntry entry, const Scene& scene, const std::filesystem::path& cache);

  // Photographs that `picture` opens, of the sizes of `views`, without an object on a background: all of them counts,
  // but for pixels that are masked.
  TrueViews(const std::vector<Camera>& views, std::function<Result<ViewPicture>(size_t view)> picture);

  // Pixels over the object's background. Errors: those of Scene::HighPicture, ReadImage and WritePng.
  Result<TrueView> Load(size_t view) const;

  // Renders those of the views that are neither stored nor in the folder. Faster than one after the other as they are
  // asked for: the mesh is opened once.
  Status Make(std::span<const size_t> views) const;

  // The pixels inside of a window of the view, which must not reach out of it. Views of which windows were asked for
  // stay in memory, cut to the object, at 8 bits: opening a file takes longer than the window.
  Result<TrueView> LoadWindow(size_t view, const PixelBox& window) const;
  // What Load has as the view's `object`.
  Result<PixelBox> Box(size_t view) const;

 private:
  // The pixels that show something, 3 or 4 channels.
  struct Part {
    Image picture;
    PixelBox box;             // where in the view; as large as the picture
    Buffer<uint8_t> ignored;  // [H,W] of the picture, not 0: it says nothing there; empty: nowhere
  };
  struct Kept;
  struct File {
    std::filesystem::path path;
    int x = 0, y = 0;  // of its left upper corner in the view
  };

  std::optional<File> Find(size_t view) const;
  Result<Part> Read(size_t view) const;
  Result<std::shared_ptr<const Kept>> Keep(size_t view) const;

  SceneEntry entry_;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> stored_;  // pictures of the data set by view; empty where it has none
  std::vector<std::string> names_;
  std::vector<std::array<int, 2>> sizes_;                       // width and height
  std::function<Result<ViewPicture>(size_t view)> photograph_;  // of a capture; else empty
  std::array<float, 3> background_{};
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const Kept>> kept_;  // by view
};

// The smallest box of the pixels of a picture with 3 or 4 channels that are not the background: alpha above 0, or for
// pictures without alpha a colour that differs.
PixelBox ObjectBox(const Image& picture, const std::array<float, 3>& background);

}  // namespace anchorsplat
