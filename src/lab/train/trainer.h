#pragma once

#include "core/result.h"
#include "train/train_request.h"

namespace anchorsplat {

// Runs a whole training: reads the configuration, finds objects, and repeats
//   splat → network → rasterizer → loss → gradient → Adam
// until steps or minutes are over or the user stops it. Writes to `request.out`:
//   model.safetensors       the network with averaged weights, for `enhance --model`
//   best.safetensors        the same at the best validation
//   checkpoint.safetensors  everything to resume
//   log.jsonl, curve.html   (docs/training.md)
// An interrupted and resumed training gives the same numbers as an uninterrupted one, on the same machine with the same
// number of threads, if it ends by steps rather than minutes.
//
// Started as several processes (process_group.h), each takes a share of a step's scenes, gradients are averaged, and
// the first process writes.
//
// Errors: of the configuration, the data sets and the network's options, with file and line; kExists: the folder has a
// training, without `resume` or `overwrite`; kBadArgument: the loss is repeatedly not a number; those of reading and
// writing.
Result<TrainReport> Train(const TrainRequest& request);

}  // namespace anchorsplat
