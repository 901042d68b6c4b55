#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/run_context.h"
#include "gpu/device.h"
#include "gpu/gpu_for_test.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {
namespace {

struct AddParameters {
  uint32_t count = 0;
  uint32_t addend = 0;
};

constexpr std::string_view kAddText = R"(
struct Parameters { count: u32, addend: u32 }
@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@compute @workgroup_size(64) fn Add(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
  let i = GroupNumber(group) * 64u + local;
  if (i < parameters.count) { values[i] += parameters.addend; }
}
)";
const GpuKernel kAdd{"Add", {kAddText}};

// values[group] = group, one thread of each workgroup.
const GpuKernel kNumber{"Number", {R"(
@group(0) @binding(0) var<uniform> count: u32;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@compute @workgroup_size(1) fn Number(@builtin(workgroup_id) group: vec3u) {
  let i = GroupNumber(group);
  if (i < count) { values[i] = i; }
}
)"}};

std::span<const std::byte> BytesOf(const std::vector<uint32_t>& values) { return std::as_bytes(std::span(values)); }

std::vector<uint32_t> Values(GpuDevice& gpu, const GpuBuffer& buffer, size_t count, uint64_t offset = 0) {
  std::vector<uint32_t> values(count);
  const GpuRead read{&buffer, offset, std::as_writable_bytes(std::span(values))};
  const Status status = gpu.Read({&read, 1});
  EXPECT_TRUE(status.ok()) << status.error().message;
  return values;
}

void Add(GpuDevice& gpu, const GpuBuffer& buffer, uint32_t count, uint32_t addend) {
  gpu.Run(kAdd, AsParameters(AddParameters{count, addend}), {{1, &buffer}}, (count + 63) / 64);
}

class Gpu : public ::testing::Test {
 protected:
  void SetUp() override {
    gpu_ = GpuForTest();
    ASSERT_NE(gpu_, nullptr);
  }
  GpuMemory Make(uint64_t bytes) {
    Result<GpuMemory> made = gpu_->Allocate(bytes, "a test");
    EXPECT_TRUE(made.ok()) << made.error().message;
    return made.ok() ? *std::move(made) : nullptr;
  }
  std::shared_ptr<GpuDevice> gpu_;
};

TEST_F(Gpu, AddsToWhatWasWritten) {
  const GpuMemory buffer = Make(400);
  ASSERT_EQ(buffer->bytes(), 512u);
  std::vector<uint32_t> values(100);
  std::iota(values.begin(), values.end(), 0u);
  gpu_->Write(*buffer, 0, BytesOf(values));
  Add(*gpu_, *buffer, 99, 1000);
  const std::vector<uint32_t> sums = Values(*gpu_, *buffer, 100);
  for (uint32_t i = 0; i < 99; ++i) EXPECT_EQ(sums[i], i + 1000);
  EXPECT_EQ(sums[99], 99u);
}

TEST_F(Gpu, MemoryBeginsAtZero) {
  const GpuMemory buffer = Make(4096);
  EXPECT_EQ(Values(*gpu_, *buffer, 1024), std::vector<uint32_t>(1024, 0));
}

TEST_F(Gpu, ItsOwnClockTimesAKernel) {
  const GpuMemory buffer = Make(1 << 20);
  Add(*gpu_, *buffer, 1 << 18, 1);
  const int64_t waits = gpu_->waits();
  for (int k = 0; k < 2; ++k) {
    const std::optional<double> seconds =
        gpu_->RunTimed(kAdd, AsParameters(AddParameters{1 << 18, 2}), {{1, buffer.get()}}, (1 << 18) / 64);
    EXPECT_TRUE(gpu_->adapter().timestamps || !seconds.has_value());
    if (seconds) {  // SwiftShader's clock gives none
      EXPECT_GE(*seconds, 0);
      EXPECT_LT(*seconds, 60);
    }
  }
  EXPECT_EQ(gpu_->waits(), waits + 2);
  EXPECT_EQ(Values(*gpu_, *buffer, 1 << 18), std::vector<uint32_t>(1 << 18, 5));
}

TEST_F(Gpu, WithoutChecksItCalculatesTheSame) {
  const Result<std::shared_ptr<GpuDevice>> opened = OpenUncheckedGpu({DeviceChoice::Kind::kGpu});
  if (!opened.ok()) {  // Dawn
    EXPECT_NE(opened.error().message.find("without checks"), std::string::npos) << opened.error().message;
    return;
  }
  Result<GpuMemory> buffer = (*opened)->Allocate(4096, "a test");
  ASSERT_TRUE(buffer.ok());
  Add(**opened, **buffer, 1024, 7);
  EXPECT_EQ(Values(**opened, **buffer, 1024), std::vector<uint32_t>(1024, 7));
}

TEST_F(Gpu, MoreThan65535GroupsAreRows) {
  constexpr uint32_t kCount = 150'001;
  const GpuMemory buffer = Make(kCount * 4);
  gpu_->Run(kNumber, AsParameters(kCount), {{1, buffer.get()}}, kCount);
  std::vector<uint32_t> expected(kCount);
  std::iota(expected.begin(), expected.end(), 0u);
  EXPECT_EQ(Values(*gpu_, *buffer, kCount), expected);
}

TEST_F(Gpu, ParametersOfManyKernelsDoNotMix) {
  const GpuMemory buffer = Make(256);
  uint32_t sum = 0;
  for (uint32_t addend = 1; addend <= 1000; ++addend) {
    Add(*gpu_, *buffer, 64, addend);
    sum += addend;
  }
  EXPECT_EQ(Values(*gpu_, *buffer, 64), std::vector<uint32_t>(64, sum));
}

TEST_F(Gpu, WritesCopiesAndClearsKeepTheirOrder) {
  const GpuMemory from = Make(1024), to = Make(1024);
  gpu_->Write(*from, 0, BytesOf(std::vector<uint32_t>(256, 7)));
  Add(*gpu_, *from, 256, 1);
  gpu_->Write(*from, 512, BytesOf(std::vector<uint32_t>(64, 20)));
  Add(*gpu_, *from, 256, 1);
  gpu_->Copy(*from, 256, *to, 0, 512);
  gpu_->Clear(*from, 4, 8);
  gpu_->Write(*from, 0, BytesOf({5}));
  std::vector<uint32_t> copied(128, 9);
  std::fill(copied.begin() + 64, copied.end(), 21u);
  copied.resize(256);
  EXPECT_EQ(Values(*gpu_, *to, 256), copied);
  EXPECT_EQ(Values(*gpu_, *from, 4), (std::vector<uint32_t>{5, 0, 0, 9}));
}

TEST_F(Gpu, ReadsWhatIsLargerThanOneTransferInPieces) {
  constexpr uint32_t kCount = (65 << 20) / 4;  // 64 MiB at once
  const GpuMemory large = Make(uint64_t{kCount} * 4), small = Make(256);
  std::vector<uint32_t> values(kCount);
  std::iota(values.begin(), values.end(), 0u);
  gpu_->Write(*large, 0, BytesOf(values));
  gpu_->Write(*small, 0, BytesOf({1, 2, 3, 4}));
  std::vector<uint32_t> first(2), all(kCount), last(1);
  const GpuRead reads[] = {{small.get(), 4, std::as_writable_bytes(std::span(first))},
                           {large.get(), 0, std::as_writable_bytes(std::span(all))},
                           {small.get(), 12, std::as_writable_bytes(std::span(last))}};
  ASSERT_TRUE(gpu_->Read(reads).ok());
  EXPECT_EQ(first, (std::vector<uint32_t>{2, 3}));
  EXPECT_TRUE(all == values);
  EXPECT_EQ(last, std::vector<uint32_t>{4});
}

TEST_F(Gpu, NothingIsNothing) {
  const GpuMemory buffer = Make(1);
  EXPECT_EQ(buffer->bytes(), 256u);
  gpu_->Write(*buffer, 0, {});
  gpu_->Clear(*buffer, 0, 0);
  gpu_->Copy(*buffer, 0, *buffer, 0, 0);
  Add(*gpu_, *buffer, 0, 1);
  EXPECT_TRUE(gpu_->Read({}).ok());
  const GpuRead read{buffer.get(), 0, {}};
  EXPECT_TRUE(gpu_->Read({&read, 1}).ok());
  EXPECT_EQ(Values(*gpu_, *buffer, 64), std::vector<uint32_t>(64, 0));
  const Result<GpuMemory> none = gpu_->Allocate(0, "nothing");
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kBadArgument);
}

TEST_F(Gpu, KernelsSeeAPartOfABuffer) {
  const GpuMemory buffer = Make(1024);
  gpu_->Run(kAdd, AsParameters(AddParameters{256, 3}), {{1, buffer.get(), 256, 256}}, 1);  // 64 of 256
  gpu_->Run(kAdd, AsParameters(AddParameters{32, 1}), {{1, buffer.get(), 512}}, 1);
  std::vector<uint32_t> expected(256, 0);
  std::fill_n(expected.begin() + 64, 64, 3u);
  std::fill_n(expected.begin() + 128, 32, 1u);
  EXPECT_EQ(Values(*gpu_, *buffer, 256), expected);
}

TEST_F(Gpu, BuffersOfRecordedWorkMayBeDestroyed) {
  const GpuMemory kept = Make(256);
  {
    const GpuMemory gone = Make(256);
    gpu_->Write(*gone, 0, BytesOf(std::vector<uint32_t>(64, 3)));
    Add(*gpu_, *gone, 64, 4);
    gpu_->Copy(*gone, 0, *kept, 0, 256);
  }
  gpu_->Write(*Make(256), 0, BytesOf({1, 2, 3}));  // written alone
  const GpuMemory other = Make(256);
  Add(*gpu_, *kept, 64, 1);
  EXPECT_EQ(Values(*gpu_, *kept, 64), std::vector<uint32_t>(64, 8));
}

TEST_F(Gpu, ThreadsRecordSideBySide) {
  constexpr int kThreads = 4;
  std::vector<uint32_t> sums(kThreads);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int round = 0; round < 5; ++round) {
        const GpuMemory buffer = Make(256);
        for (uint32_t addend = 1; addend <= 100; ++addend) Add(*gpu_, *buffer, 64, addend);
        sums[static_cast<size_t>(thread)] += Values(*gpu_, *buffer, 64)[63];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sums, std::vector<uint32_t>(kThreads, 5 * 5050));
}

TEST_F(Gpu, ARunStaysWithinItsMemory) {
  const RunScope run({.max_gpu_memory = 1 << 20});
  const GpuMemory half = Make(1 << 19);
  Result<GpuMemory> more = gpu_->Allocate((1 << 19) + 1, "splats");
  ASSERT_FALSE(more.ok());
  EXPECT_EQ(more.error().message,
            "there is no room for splats (525 kB) within --max-gpu-memory (1.0 MB, of which 524 kB are in "
            "use)");
  GpuMemory rest = Make(1 << 19);
  EXPECT_FALSE(gpu_->Allocate(1, "splats").ok());
  rest.reset();
  EXPECT_TRUE(gpu_->Allocate(1 << 19, "splats").ok());
  EXPECT_TRUE(gpu_->Wait().ok());  // none of it sticks
}

TEST_F(Gpu, ABufferHasALimit) {
  const RunScope run({.max_gpu_memory = ~uint64_t{0}});
  const Result<GpuMemory> huge = gpu_->Allocate(gpu_->adapter().max_buffer + 1, "splats");
  ASSERT_FALSE(huge.ok());
  EXPECT_NE(huge.error().message.find("the GPU memory for splats would be"), std::string::npos);
  EXPECT_TRUE(gpu_->Wait().ok());
}

// Each of these leaves a device that does nothing more; the next one is another.
class FailingGpu : public Gpu {
 protected:
  void ExpectStuck(std::string_view words) {
    for (int again = 0; again < 2; ++again) {
      const Status status = gpu_->Wait();
      ASSERT_FALSE(status.ok());
      EXPECT_NE(status.error().message.find(words), std::string::npos) << status.error().message;
      EXPECT_EQ(status.error().message.find('\n'), std::string::npos) << status.error().message;
      gpu_->Submit();
    }
    uint32_t value = 17;
    const GpuRead read{buffer_.get(), 0, std::as_writable_bytes(std::span(&value, 1))};
    EXPECT_FALSE(gpu_->Read({&read, 1}).ok());
    EXPECT_FALSE(gpu_->Allocate(256, "more").ok());
    Add(*gpu_, *buffer_, 64, 1);
    gpu_->Write(*buffer_, 0, BytesOf({1}));
    gpu_->Clear(*buffer_, 0, 4);
    buffer_.reset();
    const std::shared_ptr<GpuDevice> next = GpuForTest();
    ASSERT_NE(next, nullptr);
    EXPECT_NE(next, gpu_);
    EXPECT_TRUE(next->Wait().ok());
  }

  void SetUp() override {
    Gpu::SetUp();
    if (HasFatalFailure()) return;
    buffer_ = Make(256);
  }

  GpuMemory buffer_;
};

TEST_F(FailingGpu, AKernelThatDoesNotCompileIsNamedWithItsLine) {
  static const GpuKernel kWrong{"Wrong", {R"(
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@compute @workgroup_size(1) fn Wrong() { values[0] = vlaues[1]; }
)"}};
  gpu_->Run(kWrong, {}, {{1, buffer_.get()}}, 1);
  ExpectStuck("the kernel Wrong does not compile: ");
  EXPECT_NE(gpu_->Wait().error().message.find("'@compute @workgroup_size(1) fn Wrong() { values[0] = vlaues[1]; }'"),
            std::string::npos)
      << gpu_->Wait().error().message;
}

TEST_F(FailingGpu, AnEntryPointMustBeThere) {
  static const GpuKernel kAbsent{"Absent", {kAddText}};
  gpu_->Run(kAbsent, {}, {{1, buffer_.get()}}, 1);
  ExpectStuck("the kernel Absent does not compile: ");
}

TEST_F(FailingGpu, ABindingTooManyIsRefused) {
  gpu_->Run(kAdd, AsParameters(AddParameters{1, 1}), {{1, buffer_.get()}, {2, buffer_.get()}}, 1);
  ExpectStuck("it refused a command (");
}

TEST_F(FailingGpu, ACopyBeyondTheEndIsRefused) {
  const GpuMemory other = Make(256);
  Add(*gpu_, *buffer_, 64, 1);
  gpu_->Copy(*buffer_, 128, *other, 0, 256);
  gpu_->Submit();
  ExpectStuck("it refused a command (");
}

TEST_F(FailingGpu, AWriteBeyondTheEndIsRefused) {
  gpu_->Write(*buffer_, 128, BytesOf(std::vector<uint32_t>(64, 1)));
  ExpectStuck("it refused a command (");
}

TEST_F(FailingGpu, ABindingBeyondTheEndIsRefused) {
  gpu_->Run(kAdd, AsParameters(AddParameters{1, 1}), {{1, buffer_.get(), 0, 512}}, 1);
  ExpectStuck("the kernel Add is given 512 B at binding 1, where from 4 bytes to 256 B can be");
}

TEST_F(FailingGpu, ABindingHasALimit) {
  const uint64_t limit = gpu_->adapter().max_binding;
  if (limit >= gpu_->adapter().max_buffer) return;  // then Allocate refuses it
  const GpuMemory large = Make(limit + 256);
  ASSERT_NE(large, nullptr);
  gpu_->Run(kAdd, AsParameters(AddParameters{1, 1}), {{1, large.get()}}, 1);
  ExpectStuck("the kernel Add is given");
}

TEST_F(FailingGpu, MoreParametersThanFitAreRefused) {
  gpu_->Run(kAdd, std::vector<std::byte>(257), {{1, buffer_.get()}}, 1);
  ExpectStuck("the kernel Add is given more than it can see");
}

}  // namespace
}  // namespace anchorsplat
