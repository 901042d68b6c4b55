#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "enhance/pixel_size.h"

namespace anchorsplat {

// An object of a benchmark as its folder is found, before anything in it is read.
struct BenchmarkEntry {
  std::string name;  // of the folder
  std::filesystem::path folder;
  std::string kind = {};    // entry of the recipe that the data set's object was made by; empty where nothing says so
  bool is_capture = false;  // pictures and cameras alone: OpenCapturedObject (eval/capture.h) opens it
};

// The objects of a benchmark, in order of their names. The folder holds data sets as dataset/scene_reader.h reads them
// (without the objects that a manifest rejects), or folders of the layout of the repository's examples: a splat,
// transforms_lr.json and transforms_hr.json with their pictures; or it is one such object itself. `split` takes those
// of one split of the data set; empty: all.
//
// Errors: kNotFound: no folder, no objects in it; kBadFile: of the manifest or the splits.
Result<std::vector<BenchmarkEntry>> ListBenchmark(const std::filesystem::path& folder, const std::string& split = {});

// Whether a folder has an object of that second layout.
bool HasExampleLayout(const std::filesystem::path& folder);

// What an object gives methods to work with and what their results are measured with.
struct BenchmarkObject {
  std::string name;
  std::filesystem::path splat;  // file of `low`
  GaussianCloud low;            // the low-quality splat
  CameraSet low_cameras;        // of low-resolution views, in order of their names; of a capture those of training
  // Of the views at the low resolution, in their order; empty: all are as those of the first of low_cameras.
  std::vector<Pinhole> low_intrinsics;
  std::vector<Camera> views;     // of all high-resolution views, in order of their names
  std::vector<size_t> held_out;  // views the low-quality fit was not trained on
  std::array<float, 3> background{};
  // What the low-quality splat was fitted to, with its defects where it has some (Scene::fitted_project):
  // fit/training_views.h opens it …
  std::filesystem::path low_project;
  int hold_out = 0;                                        // … with this, and holds out the same views
  int downscale = 1;                                       // … and with this
  CameraPixelRule camera_rule = CameraPixelRule::kMedian;  // how those of training say the pixel size
  std::filesystem::path mesh;  // what high views without a picture are rendered from; may be empty
  // The high-resolution picture of a view, rgb or rgba, of its camera's size.
  std::function<Result<ViewPicture>(size_t view)> picture;

  double upscale() const;               // pixels of a high view per pixel of a low one, along a side
  Camera LowCamera(size_t view) const;  // the place of view `view` with the intrinsics of the low ones
  // [3,H,W]: the picture over the background, and where it says nothing.
  Result<ViewPicture> Truth(size_t view) const;
};

// Errors: kNotFound, kBadFile, kIo, naming the file: no splat, cameras that cannot be read, high views of different
// sizes or smaller than the low ones.
Result<BenchmarkObject> OpenObject(const BenchmarkEntry& entry);

}  // namespace anchorsplat
