#include "fit/gpu_adam.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "fit/adam.h"
#include "gpu/gpu_for_test.h"

namespace anchorsplat {
namespace {

class GpuAdam : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    ASSERT_NE(device_, nullptr);
  }
  // Behind `skipped` numbers that are none of the test's business.
  GpuMemory Put(const std::vector<float>& values, size_t skipped = 0) {
    GpuMemory memory = device_->Allocate((skipped + values.size()) * sizeof(float), "numbers").value();
    device_->Write(*memory, skipped * sizeof(float), std::as_bytes(std::span(values)));
    return memory;
  }
  std::vector<float> Get(const GpuMemory& memory, size_t count, size_t skipped = 0) {
    std::vector<float> values(count);
    const GpuRead read = {memory.get(), skipped * sizeof(float), std::as_writable_bytes(std::span(values))};
    EXPECT_TRUE(device_->Read({&read, 1}).ok());
    return values;
  }

  std::shared_ptr<GpuDevice> device_;
};

double RelativeDifference(const std::vector<float>& a, const std::vector<float>& b) {
  double off = 0, size = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    off += std::pow(double{a[i]} - b[i], 2);
    size += std::pow(double{b[i]}, 2);
  }
  return std::sqrt(off / size);
}

TEST_F(GpuAdam, IsThatOfTheCpu) {
  const struct {
    int64_t rows, stride, columns, first_columns;
  } cases[] = {{500, 3, 3, 0}, {301, 48, 27, 3}, {64, 48, 48, 3}, {1, 1, 1, 0}, {100, 48, 3, 3}};
  for (const auto& c : cases) {
    SCOPED_TRACE(testing::Message() << c.rows << " rows of " << c.columns << " in " << c.stride);
    const auto count = static_cast<size_t>(c.rows * c.stride);
    Random random(3);
    std::vector<float> values(count), first(count, 0.0f), second(count, 0.0f), gradient(count);
    for (float& x : values) x = static_cast<float>(random.Normal());
    constexpr int64_t kFirstRow = 64;
    const auto skipped = static_cast<size_t>(kFirstRow * c.stride);
    const GpuMemory on_values = Put(values, skipped), on_first = Put(first, skipped), on_second = Put(second, skipped);
    for (int64_t step = 1; step <= 20; ++step) {
      for (size_t i = 0; i < count; ++i) {
        // Of all sizes, and nothing at all: as Gaussians have it that a view does not see.
        gradient[i] =
            random.Uniform() < 0.3 ? 0.0f : static_cast<float>(random.Normal() * std::pow(10, -12 * random.Uniform()));
      }
      const AdamParams p = {c.rows, c.stride, c.columns, c.first_columns, 0.02f,        0.001f,        0.9,
                            0.999,  1e-15f,   step,      gradient.data(), first.data(), second.data(), values.data()};
      AdamStep(p);
      const GpuMemory on_gradient = Put(gradient);
      RecordAdamStep({c.rows, c.stride, c.columns, c.first_columns, 0.02, 0.001, 0.9, 0.999, 1e-15, step,
                      on_gradient.get(), kFirstRow, on_first.get(), on_second.get(), on_values.get()},
                     *device_);
      ASSERT_TRUE(device_->Wait().ok());
    }
    const std::vector<float> got = Get(on_values, count, skipped);
    for (size_t i = 0; i < count; ++i) {
      ASSERT_NEAR(got[i], values[i], 1e-6 * std::max(1.0f, std::abs(values[i]))) << i;
    }
    EXPECT_LT(RelativeDifference(Get(on_first, count, skipped), first), 1e-6);
    EXPECT_LT(RelativeDifference(Get(on_second, count, skipped), second), 1e-6);
  }
}

TEST_F(GpuAdam, HasTheSameBitsAgain) {
  Random random(3);
  std::vector<float> values(999), gradient(999);
  for (float& x : values) x = static_cast<float>(random.Normal());
  for (float& x : gradient) x = static_cast<float>(random.Normal());
  std::vector<float> before;
  for (int run = 0; run < 2; ++run) {
    const GpuMemory on_values = Put(values), on_gradient = Put(gradient);
    const GpuMemory first = Put(std::vector<float>(999, 0.0f)), second = Put(std::vector<float>(999, 0.0f));
    for (int64_t step = 1; step <= 5; ++step) {
      RecordAdamStep({333, 3, 3, 0, 0, 0.001, 0.9, 0.999, 1e-15, step, on_gradient.get(), 0, first.get(), second.get(),
                      on_values.get()},
                     *device_);
    }
    const std::vector<float> after = Get(on_values, 999);
    if (run == 0) before = after;
    EXPECT_EQ(after, before);
  }
}

}  // namespace
}  // namespace anchorsplat
