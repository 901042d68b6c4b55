#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/camera.h"
#include "model/shared/torch/render_op.h"
#include "model/shared/torch/trainable_network.h"
#include "render/rasterizer.h"
#include "train/augmentation.h"
#include "train/photometric_objective.h"
#include "train/train_config.h"
#include "train/training_object.h"

namespace anchorsplat {

// One splat with the views that a step looks at.
struct TrainingSample {
  std::string object;
  NetworkInput input;           // prepared, on the network's device
  std::vector<Camera> cameras;  // crops where the configuration says so
  std::vector<TrueView> truth;
  // Of a part: what shows in the views besides, as the filter makes it. Drawn after the network's Gaussians. Undefined
  // tensors when there is nothing.
  GaussianTensors others;
  RenderOptions render;
  double seconds = 0;  // it took to make
};

// Which object and which of its views the sample with number `index` of a training is made of. Follows from seed and
// index alone: a resumed training draws the same. Objects come in random order, all of them before any comes again.
struct SamplePlan {
  size_t object = 0;
  std::vector<size_t> views;  // of TrainingObject::views, all different; of a part all that training may see, shuffled
  uint64_t seed = 0;          // of augmentation and crops
};
size_t PlannedObject(uint64_t seed, int64_t index, size_t objects);
SamplePlan PlanSample(const TrainConfig& config, int64_t index, size_t objects, const TrainingObject& object);

// The network's input for a splat, or for one that was made of its Gaussians. `prepared` is left empty.
NetworkInput MakeInput(const TrainingObject& object, torch::Device device);
NetworkInput MakeInput(const TrainingObject& object, const AugmentedScene& scene, torch::Device device);

// The sample itself.
Result<TrainingSample> MakeSample(const TrainConfig& config, int64_t index, ObjectStore& objects,
                                  TrainableNetwork& network, torch::Device device);

// Makes samples ahead of time in a thread of its own: first, first + 1, … but of each `group` numbers (all processes'
// samples of a step) only [offset, offset + count).
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

  // The next one; waits for it if it must. After an error there are no more.
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
