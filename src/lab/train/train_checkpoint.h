#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "train/optimizer.h"

namespace anchorsplat {

// State of a training besides tensors. Random generators have none: every draw depends on the seed and its step.
struct TrainProgress {
  int64_t step = 0;  // steps begun, including skipped ones
  int64_t optimizer_steps = 0;
  int64_t skipped = 0;
  double seconds = 0;        // of all runs so far
  double loss_scale = 1;     // for half precision
  int64_t since_scaled = 0;  // successful steps since it last changed
  double best_psnr = 0;      // of all validations so far; 0: none
  std::string settings;      // JSON: what must stay the same (Settings)
  std::string objects;       // JSON: names of the training objects
};

// Writes everything as a safetensors file with checksum, atomically; replaces an existing one.
Status WriteTrainCheckpoint(const std::filesystem::path& path, const Optimizer& optimizer,
                            const TrainProgress& progress);

// Reads a checkpoint into the optimizer's tensors, including the network's weights. Errors: those of TensorFile;
// kBadFile:
// no such checkpoint, damaged, or a tensor missing or of the wrong shape; kBadArgument: settings or objects differ from
// `expected` (names the first difference).
Result<TrainProgress> ReadTrainCheckpoint(const std::filesystem::path& path, const TrainProgress& expected,
                                          Optimizer& optimizer);

// Loads only the averaged weights of a checkpoint, to start another training of the same network.
Status StartFromCheckpoint(const std::filesystem::path& path, Optimizer& optimizer);

}  // namespace anchorsplat
