#pragma once

#include <array>
#include <cstddef>
#include <filesystem>

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

  // Pixels over the object's background. Errors: those of Scene::HighPicture, ReadImage and WritePng.
  Result<TrueView> Load(size_t view) const;

 private:
  Result<TrueView> Unpack(const Image& part, int x0, int y0) const;

  SceneEntry entry_;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> stored_;  // pictures of the data set by view; empty where it has none
  std::vector<std::string> names_;
  int width_ = 0, height_ = 0;
  std::array<float, 3> background_{};
};

// The smallest box of the pixels of a picture with 3 or 4 channels that are not the background: alpha above 0, or for
// pictures without alpha a colour that differs.
PixelBox ObjectBox(const Image& picture, const std::array<float, 3>& background);

}  // namespace anchorsplat
