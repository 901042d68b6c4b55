#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "train/optimizer.h"

namespace anchorsplat {

// What a training has to remember besides tensors. Random numbers need no state: every draw follows from the seed and
// the number of its step.
struct TrainProgress {
  int64_t step = 0;  // steps begun, skipped ones included
  int64_t optimizer_steps = 0;
  int64_t skipped = 0;
  double seconds = 0;        // of all parts so far
  double loss_scale = 1;     // of half precision
  int64_t since_scaled = 0;  // good steps since it last changed
  double best_psnr = 0;      // of the validations so far; 0: none
  std::string settings;      // JSON: what must not change (Settings)
  std::string objects;       // JSON: names of the training's objects
};

// All of it as a safetensors file with a checksum, whole or not at all; replaces an older one.
Status WriteTrainCheckpoint(const std::filesystem::path& path, const Optimizer& optimizer,
                            const TrainProgress& progress);

// Fills the optimizer's tensors, the network's weights among them. Errors: those of TensorFile; kBadFile: no such
// checkpoint, a damaged one, or a tensor that is missing or of another shape; kBadArgument: settings or objects others
// than those in `expected`, naming the first that differs.
Result<TrainProgress> ReadTrainCheckpoint(const std::filesystem::path& path, const TrainProgress& expected,
                                          Optimizer& optimizer);

// Takes only the averaged weights of a checkpoint, as a start for another training of the same network.
Status StartFromCheckpoint(const std::filesystem::path& path, Optimizer& optimizer);

}  // namespace anchorsplat
