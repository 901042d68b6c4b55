#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "fit/fit.h"
#include "fit/fitter.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {

// A tiny project with pictures of `side` pixels, and a short schedule that exercises every event.
class SmallFits : public testing::Test {
 protected:
  explicit SmallFits(int side) : side_(side) {}

  void SetUp() override {
    orbit_scene::Write(folder_.path(), orbit_scene::Ball(20, 1), 10, side_);
    views_ = OpenProject(folder_.path(), {.hold_out = 5}).value();
    options_ = FitOptionsFor(60);
    options_.seed = 3;
    options_.densification.refine_start_iter = 5;
    options_.densification.refine_every = 4;
    options_.densification.refine_stop_iter = 40;
    options_.densification.reset_every = 20;
    options_.densification.max_gaussians = 150;
  }

  GaussianCloud Initial() const {
    return InitialCloud(RandomPointsInView(60, views_.train, views_.scene_scale, 3), views_.scene_scale, {.seed = 3})
        .value();
  }
  Fitter Begin(FitState state) const {
    return Fitter::Begin(options_, PictureCache(views_.train, {0, 0, 0}), views_.scene_scale, std::move(state)).value();
  }

  int side_;
  TestFolder folder_;
  TrainingViews views_;
  FitOptions options_;
};

}  // namespace anchorsplat
