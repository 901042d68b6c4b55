#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/camera.h"
#include "network/torch/render_op.h"
#include "network/torch/trainable_network.h"
#include "render/rasterizer.h"
#include "train/augmentation.h"
#include "train/photometric_objective.h"
#include "train/train_config.h"
#include "train/training_object.h"

namespace anchorsplat {

// A splat with the views of one step.
struct TrainingSample {
  std::string object;
  NetworkInput input;           // prepared, on the network's device
  std::vector<Camera> cameras;  // cropped if configured
  std::vector<TrueView> truth;
  // For parts: other Gaussians visible in the views, filtered, to be drawn after the network's. Undefined tensors if
  // there are none.
  GaussianTensors others;
  RenderOptions render;
  double seconds = 0;  // to make it
};

// Object and views of training sample number `index`. Depends on seed and index alone, so a resumed training draws the
// same. Objects come in random order, each once per epoch.
struct SamplePlan {
  size_t object = 0;
  std::vector<size_t> views;  // distinct indices of TrainingObject::views; for parts, all training views, shuffled
  uint64_t seed = 0;          // for augmentation and crops
};
size_t PlannedObject(uint64_t seed, int64_t index, size_t objects);
SamplePlan PlanSample(const TrainConfig& config, int64_t index, size_t objects, const TrainingObject& object);

// The network's input for a splat or an augmented scene. Leaves `prepared` empty.
NetworkInput MakeInput(const TrainingObject& object, torch::Device device);
NetworkInput MakeInput(const TrainingObject& object, const AugmentedScene& scene, torch::Device device);

// Makes the sample.
Result<TrainingSample> MakeSample(const TrainConfig& config, int64_t index, ObjectStore& objects,
                                  TrainableNetwork& network, torch::Device device);

// Makes samples ahead of time in a thread: first, first + 1, …, but of each `group` indices (the samples of all
// processes in a step) only [offset, offset + count).
class SampleLoader {
 public:
  struct Order {
    int64_t first = 0;
    int64_t group = 1, offset = 0, count = 1;
  };
  SampleLoader(const TrainConfig& config, Order order, ObjectStore& objects, TrainableNetwork& network,
               torch::Device device);
  ~SampleLoader();
  SampleLoader(const SampleLoader&) = delete;
  SampleLoader& operator=(const SampleLoader&) = delete;

  // Returns the next sample, waiting if necessary. After an error there are no more.
  Result<TrainingSample> Next();

 private:
  void Run();

  const TrainConfig& config_;
  Order order_;
  ObjectStore& objects_;
  TrainableNetwork& network_;
  torch::Device device_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Result<TrainingSample>> ready_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace anchorsplat
