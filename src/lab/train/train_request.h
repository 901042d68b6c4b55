#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace anchorsplat {

// A training request from the command line. Free of LibTorch, which the program that forwards it lacks.
struct TrainRequest {
  std::vector<std::filesystem::path> datasets;    // folders of dataset/scene_reader.h
  std::string split;                              // of each data set: "train", …; empty: all objects
  std::vector<std::filesystem::path> validation;  // folders; empty: the data sets' split "validation", if any
  std::filesystem::path captures;  // folder of captures to train on as well (dataset/capture.h); may be empty
  std::filesystem::path config;
  std::filesystem::path out;    // folder for all output
  std::filesystem::path cache;  // for true pictures, shared by trainings; empty: out / "cache"
  std::filesystem::path start;  // checkpoint of another training, whose averaged weights are the start
  bool resume = false;
  bool overwrite = false;                   // starts anew in a folder with a training
  std::optional<double> minutes;            // limit over all runs of a resumed training
  std::optional<int64_t> steps;             // overrides the file
  std::optional<uint64_t> seed;             // overrides the file
  const std::atomic<bool>* stop = nullptr;  // becomes true to stop the training
};

struct TrainQuality {
  double psnr = 0, ssim = 0;  // means over an object's views, then over objects
  std::optional<double> lpips;
};

struct TrainReport {
  int64_t steps = 0;  // in total
  int64_t resumed_at = 0;
  int64_t skipped = 0;  // steps with a non-finite gradient
  bool interrupted = false;
  int64_t objects = 0, validation_objects = 0, parameters = 0;
  double seconds = 0;                              // of this run
  double loss = 0;                                 // mean over the last steps
  std::optional<TrainQuality> raw, filter, model;  // on the validation objects
  std::filesystem::path file;                      // the network
};

}  // namespace anchorsplat
