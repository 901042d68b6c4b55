#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "core/messages_for_test.h"
#include "enhance/refine.h"
#include "enhance/refinement_for_test.h"
#include "fit/run_on_gpu_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "gpu/faulty_device_for_test.h"
#include "gpu/gpu_for_test.h"
#include "images/image_io.h"

namespace anchorsplat {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kAlike = 0.1;  // dB

class ResidentRefinement : public Refinement {
 protected:
  void SetUp() override {
    Refinement::SetUp();
    device_ = GpuForTest();
    ASSERT_NE(device_, nullptr);
    options_.steps = 40;
  }
  Refined OnGpu(std::shared_ptr<GpuDevice> device, const RefineControl& control = {}) const {
    const RunOnGpu run(std::move(device));
    return Refine(input_, options_, control).value();
  }
  void ExpectAlike() const {
    const Messages messages;
    const Refined here = Refine(input_, options_, {}).value();
    const Refined there = OnGpu(device_), again = OnGpu(device_);
    EXPECT_THAT(messages.warnings(), IsEmpty());
    EXPECT_FALSE(there.report.kept_start);
    EXPECT_NEAR(there.report.after, here.report.after, kAlike);
    EXPECT_NEAR(PsnrCloser(there.cloud), PsnrCloser(here.cloud), kAlike);
    ExpectSameCloud(again.cloud, there.cloud);
  }

  std::shared_ptr<GpuDevice> device_;
};

TEST_F(ResidentRefinement, ComesToWhatTheCpuComesTo) { ExpectAlike(); }

TEST_F(ResidentRefinement, LeavesOutWhatDiffers) {
  options_.robust = true;
  options_.exposure = true;
  ExpectAlike();
}

TEST_F(ResidentRefinement, WithoutPicturesLooksAtTheSplat) {
  options_.images.clear();
  options_.steps = 20;
  input_.cameras = cameras_;
  ExpectAlike();
}

TEST_F(ResidentRefinement, WhatIsFixedStays) {
  constexpr int64_t kFixed = 40;
  input_.fixed = kFixed;
  options_.steps = 10;
  const Refined here = Refine(input_, options_, {}).value(), there = OnGpu(device_);
  EXPECT_EQ(there.cloud.size(), here.cloud.size());
  EXPECT_NEAR(there.report.after, here.report.after, kAlike);
}

TEST_F(ResidentRefinement, GoesOnFromACheckpointOfEitherDevice) {
  options_.steps = 12;
  const Refined whole = OnGpu(device_), here = Refine(input_, options_, {}).value();
  RefineControl control{.checkpoint = folder_ / "state", .checkpoint_every = 5, .outputs = {}};
  ExpectSameCloud(OnGpu(device_, control).cloud, whole.cloud);
  control.resume = true;
  const Refined rest = OnGpu(device_, control);
  EXPECT_EQ(rest.report.resumed_at, 10);
  ExpectSameCloud(rest.cloud, whole.cloud);
  const Refined on_cpu = Refine(input_, options_, control).value();
  EXPECT_EQ(on_cpu.report.resumed_at, 10);
  EXPECT_NEAR(on_cpu.report.after, here.report.after, kAlike);
}

TEST_F(ResidentRefinement, ALostDeviceCostsSteps) {
  options_.steps = 15;
  const auto counting = std::make_shared<FaultyDevice>(device_, GpuFaults{});
  const double expected = OnGpu(counting).report.after;
  for (const double part : {0.2, 0.5, 0.8}) {
    const Messages messages;
    const auto faulty = std::make_shared<FaultyDevice>(
        device_, GpuFaults{.calls = static_cast<int>(part * static_cast<double>(counting->calls()))});
    const Refined refined = OnGpu(faulty);
    EXPECT_EQ(refined.report.steps, 15);
    EXPECT_NEAR(refined.report.after, expected, kAlike) << part;
    EXPECT_THAT(messages.warnings(), Contains(HasSubstr("as the GPU failed: the device was lost (a test says so)")));
  }
}

}  // namespace
}  // namespace anchorsplat
