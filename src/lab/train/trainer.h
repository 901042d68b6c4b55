#pragma once

#include "core/result.h"
#include "train/train_request.h"

namespace anchorsplat {

// A whole training: reads the configuration, finds the objects, and repeats
//   splat → network → rasterizer → loss → gradient → Adam
// until its steps, its minutes or the user's patience are over. Into `request.out` it writes
//   model.safetensors     the network with averaged weights, for `enhance --model` (and best.safetensors, as it was at
//                         the best validation)
//   checkpoint.safetensors  everything to go on from
//   log.jsonl, curve.html   (docs/training.md)
// A training that is interrupted and resumed gives the same numbers as one in one go, on the same machine with the same
// number of threads and as long as it ends by steps and not by minutes.
//
// Started as several processes (process_group.h), each takes its share of a step's scenes; gradients are averaged, and
// the first process writes.
//
// Errors: of the configuration, the data sets and the network's options, with file and line; kExists: there is a
// training in the folder and neither `resume` nor `overwrite`; kBadArgument: a loss that is not a number again and
// again; those of reading and writing.
Result<TrainReport> Train(const TrainRequest& request);

}  // namespace anchorsplat
