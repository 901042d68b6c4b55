#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "train/photometric_objective.h"
#include "train/train_config.h"

namespace anchorsplat {

// A splat and the views that it should match.
struct AugmentedScene {
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;  // [N]
  double strength = 0;        // f of the filter
  std::vector<Camera> cameras;
  std::vector<TrueView> truth;  // one per camera
};

// Changes splat and views consistently, so that a perfect splat stays perfect; except for dropped Gaussians and noise
// on opacities, p_LR and f, errors that the network should tolerate. Draws depend on `random` alone.
void Augment(const AugmentationConfig& config, Random& random, AugmentedScene& scene);

// The individual steps.
void RotateWorld(const std::array<double, 4>& quaternion, AugmentedScene& scene);  // wxyz, not zero
void MirrorWorld(AugmentedScene& scene);                                           // x becomes −x
void ScaleWorld(double factor, AugmentedScene& scene);
// New channel c is gain[c] times old channel order[c]; gains in (0, 1].
void ChangeColors(const std::array<size_t, 3>& order, const std::array<double, 3>& gain, AugmentedScene& scene);

}  // namespace anchorsplat
