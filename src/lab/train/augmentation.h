#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "train/photometric_objective.h"
#include "train/train_config.h"

namespace anchorsplat {

// A splat with the views it should look like from.
struct AugmentedScene {
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;  // [N]
  double strength = 0;        // f of the filter
  std::vector<Camera> cameras;
  std::vector<TrueView> truth;  // one per camera
};

// Changes splat and views together, so that a perfect splat stays perfect, except for Gaussians that are dropped and
// noise on opacities, on p_LR and on f: those are errors that the network should be able to live with. What is drawn
// depends on `random` alone.
void Augment(const AugmentationConfig& config, Random& random, AugmentedScene& scene);

// The parts of it.
void RotateWorld(const std::array<double, 4>& quaternion, AugmentedScene& scene);  // wxyz, not zero
void MirrorWorld(AugmentedScene& scene);                                           // x becomes −x
void ScaleWorld(double factor, AugmentedScene& scene);
// Channel c becomes gain[c] times what channel order[c] was; gains in (0, 1].
void ChangeColors(const std::array<size_t, 3>& order, const std::array<double, 3>& gain, AugmentedScene& scene);

}  // namespace anchorsplat
