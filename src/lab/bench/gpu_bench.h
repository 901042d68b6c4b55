#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/kernel_clock.h"
#include "core/device_choice.h"
#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

struct GpuBenchOptions {
  std::vector<int64_t> gaussians = {20'000, 340'000, 3'000'000};
  std::vector<std::array<int, 2>> sizes = {{256, 256}, {512, 512}, {1920, 1080}};  // pixels: width, height
  int repeats = 5;               // after a warm-up; the fastest counts
  double most_seconds = 10;      // stops repeating a measurement after this time
  double most_cpu_seconds = 60;  // skips the CPU where it would take longer
  bool kernels = true;           // also times each kernel
  uint64_t seed = 0;             // of the splats
};
// Options that a software adapter completes in a minute.
GpuBenchOptions SmallGpuBench();

// The same picture and gradient on the CPU, and the GPU's deviation from them.
struct GpuBenchReference {
  double forward = 0, backward = 0;  // seconds
  int64_t visible = 0;               // Gaussians
  int64_t out_of_order = 0;          // positions in the depth order that differ from the CPU's
  int64_t values = 0;                // colours and coverage values
  int64_t beyond = 0;                // of these, differing by more than 1e-4
  // ‖GPU − CPU‖ / ‖CPU‖ for gradients of means, log_scales, quats, opacity_logits, sh and means2d.
  std::array<double, 6> gradient_l2{};
};
inline constexpr std::array<const char*, 6> kGpuBenchGradients = {"means",          "log_scales", "quats",
                                                                  "opacity_logits", "sh",         "means2d"};

// Several views of a splat on the GPU, read back to host memory: one by one, and together without synchronising in
// between (GpuRasterizer::DrawTogether). Values per view.
struct GpuBenchViews {
  int count = 0;
  double seconds = 0, seconds_together = 0;
  double waits = 0, waits_together = 0;  // times the host waits for the GPU
  int64_t differing = 0;                 // values that are not bit-identical
};

// One splat at one size. Seconds per picture, warm. Not measured: 0.
struct GpuBenchRow {
  int64_t gaussians = 0;
  int width = 0, height = 0;  // pixels
  std::string problem;        // what failed, as a sentence; empty: everything was measured
  bool resident = false;      // the splat fits into GPU memory; else it is uploaded in blocks for every picture
  double first = 0;           // first picture and gradient, including kernel compilation and allocation
  double upload = 0;          // of the splat's columns
  double forward = 0;         // from a resident splat to a resident picture, with the state for the gradient
  double backward = 0;        // from there to resident gradients of all columns
  double picture = 0;         // from host arrays to a picture in host memory: upload, forward, read back
  double waiting = 0;         // share of forward and backward during which the host waits
  int64_t visible = 0;        // Gaussians
  int64_t pairs = 0;          // (tile, Gaussian)
  int runs = 0;               // of tiles (RenderOptions::max_pairs)
  std::optional<GpuBenchReference> cpu;
  std::string no_cpu;                  // why there is no `cpu`
  std::optional<GpuBenchViews> views;  // for small sizes
  std::vector<KernelTime> kernels;     // of one picture and its gradient
  bool kernels_by_gpu = false;         // timed by the GPU's clock; else by the host's, including a round trip each
  std::string no_unchecked;            // why there are no times without run-time checks
};

struct GpuBenchReport {
  GpuAdapter adapter;
  double round_trip = 0;  // seconds from submitting a command to its completion
  std::vector<GpuBenchRow> rows;
  bool interrupted = false;  // `rows` is incomplete
};

// Renders made-up splats with gradients on a GPU and on the run's CPU. A failing row records the reason and does not
// stop the others. Passes each finished row to `done`.
// Errors: kBadArgument: the choice is the CPU, or there is nothing to measure; those of OpenGpu.
Result<GpuBenchReport> BenchGpu(const DeviceChoice& choice, const GpuBenchOptions& options,
                                const std::function<void(const GpuBenchRow&)>& done = {});

// A sentence if a row violates what docs/gpu.md promises about GPU and CPU; else empty.
std::string BrokenPromise(const GpuBenchRow& row);

}  // namespace anchorsplat
