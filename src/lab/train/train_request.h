#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace anchorsplat {

// What the command line asks a training for. No LibTorch here: the program that only passes it on has none.
struct TrainRequest {
  std::vector<std::filesystem::path> datasets;    // folders of dataset/scene_reader.h
  std::string split;                              // of each of them: "train", …; empty: all objects
  std::vector<std::filesystem::path> validation;  // folders; empty: the split "validation" of the datasets, or none
  std::filesystem::path captures;  // folder of captures (dataset/capture.h) to train on, too; may be empty
  std::filesystem::path config;
  std::filesystem::path out;    // folder of everything that comes of it
  std::filesystem::path cache;  // true pictures of views, shared by trainings; empty: out / "cache"
  std::filesystem::path start;  // checkpoint of another training whose averaged weights are the start
  bool resume = false;
  bool overwrite = false;                   // begin anew in a folder with a training
  std::optional<double> minutes;            // at most so long, all parts of a resumed training together
  std::optional<int64_t> steps;             // instead of the file's
  std::optional<uint64_t> seed;             // instead of the file's
  const std::atomic<bool>* stop = nullptr;  // becomes true when the user wants to stop
};

struct TrainQuality {
  double psnr = 0, ssim = 0;  // means over an object's views, then over objects
  std::optional<double> lpips;
};

struct TrainReport {
  int64_t steps = 0;  // done in all
  int64_t resumed_at = 0;
  int64_t skipped = 0;  // steps whose gradient was not finite
  bool interrupted = false;
  int64_t objects = 0, validation_objects = 0, parameters = 0;
  double seconds = 0;                              // of this run
  double loss = 0;                                 // mean over the last steps
  std::optional<TrainQuality> raw, filter, model;  // on the validation's objects
  std::filesystem::path file;                      // the network
};

}  // namespace anchorsplat
