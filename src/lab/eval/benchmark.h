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

// An object of a benchmark, found but not read.
struct BenchmarkEntry {
  std::string name;  // of the folder
  std::filesystem::path folder;
  std::string kind = {};    // its recipe entry in the data set's manifest; empty if there is none
  bool is_capture = false;  // pictures and cameras only, opened by OpenCapturedObject (eval/capture.h)
};

// Lists a benchmark's objects by name. `folder` contains data sets as in dataset/scene_reader.h (without rejected
// objects), or folders in the layout of the repository's examples (a splat, transforms_lr.json and transforms_hr.json
// with their pictures), or is itself one such object. `split`: only objects of that split; empty: all.
//
// Errors: kNotFound: no folder, or no objects in it; kBadFile: of the manifest or the splits.
Result<std::vector<BenchmarkEntry>> ListBenchmark(const std::filesystem::path& folder, const std::string& split = {});

// Whether a folder is an object in the examples' layout.
bool HasExampleLayout(const std::filesystem::path& folder);

// Input of methods for one object, and what their results are compared with.
struct BenchmarkObject {
  std::string name;
  std::filesystem::path splat;  // file of `low`
  GaussianCloud low;            // the low-quality splat
  CameraSet low_cameras;        // of low-resolution views, by name; for captures, of training views only
  // Intrinsics of each view at low resolution; empty: those of low_cameras' first for all.
  std::vector<Pinhole> low_intrinsics;
  std::vector<Camera> views;     // all high-resolution views, by name
  std::vector<size_t> held_out;  // views the low-quality fit was not trained on
  std::array<float, 3> background{};
  // The project the low-quality splat was fitted to, including defects (Scene::fitted_project). fit/training_views.h
  // opens it …
  std::filesystem::path low_project;
  int hold_out = 0;                                        // … with this, holding out the same views
  int downscale = 1;                                       // … and this
  CameraPixelRule camera_rule = CameraPixelRule::kMedian;  // rule for pixel sizes from training cameras
  std::filesystem::path mesh;                              // for rendering high views without a picture; may be empty
  // High-resolution picture of a view, rgb or rgba, of its camera's size.
  std::function<Result<ViewPicture>(size_t view)> picture;

  double upscale() const;               // high pixels per low pixel side
  Camera LowCamera(size_t view) const;  // pose of view `view` with low-resolution intrinsics
  // [3,H,W]: the picture over the background, with its ignored pixels.
  Result<ViewPicture> Truth(size_t view) const;
};

// Opens an object. Errors: kNotFound, kBadFile, kIo, naming the file: no splat, unreadable cameras, high views of
// different sizes or smaller than the low ones.
Result<BenchmarkObject> OpenObject(const BenchmarkEntry& entry);

}  // namespace anchorsplat
