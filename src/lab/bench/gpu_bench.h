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
  int repeats = 5;               // after one that warms up; the fastest counts
  double most_seconds = 10;      // no more repeats of one thing after that
  double most_cpu_seconds = 60;  // what would take the CPU longer is not made there
  bool kernels = true;           // what each kernel takes, too
  uint64_t seed = 0;             // of the splats
};
// What a software adapter does in a minute.
GpuBenchOptions SmallGpuBench();

// The same picture and gradient by the CPU, and how far the GPU's are from them.
struct GpuBenchReference {
  double forward = 0, backward = 0;  // seconds
  int64_t visible = 0;               // Gaussians
  int64_t out_of_order = 0;          // places in the order by depth where another Gaussian is than by the CPU's depths
  int64_t values = 0;                // of colours and coverage
  int64_t beyond = 0;                // of these, further than 1e-4 from the CPU's
  // ‖GPU − CPU‖ / ‖CPU‖ of the gradients of means, log_scales, quats, opacity_logits, sh and means2d.
  std::array<double, 6> gradient_l2{};
};
inline constexpr std::array<const char*, 6> kGpuBenchGradients = {"means",          "log_scales", "quats",
                                                                  "opacity_logits", "sh",         "means2d"};

// Some views of a splat that is on the GPU, to pictures in host memory: one by one, and without a look of the host in
// between (GpuRasterizer::DrawTogether). Of one view.
struct GpuBenchViews {
  int count = 0;
  double seconds = 0, seconds_together = 0;
  double waits = 0, waits_together = 0;  // of the host, for the GPU
  int64_t differing = 0;                 // numbers of the pictures that are not the same bits
};

// One splat at one size. Seconds are of one picture, warm. What was not reached is 0.
struct GpuBenchRow {
  int64_t gaussians = 0;
  int width = 0, height = 0;  // pixels
  std::string problem;        // a sentence, where something failed; empty: all was measured
  bool resident = false;      // the splat fits the memory; otherwise it is uploaded in blocks, for every picture again
  double first = 0;           // the first picture and gradient: kernels are compiled and memory is allocated
  double upload = 0;          // the splat's columns
  double forward = 0;         // of a splat that is there, to a picture that stays there, with what the gradient needs
  double backward = 0;        // from there to the gradients of all columns, which stay there
  double picture = 0;         // from arrays in host memory to a picture in host memory: upload, forward, reading back
  double waiting = 0;         // share of forward and backward for which the host waits
  int64_t visible = 0;        // Gaussians
  int64_t pairs = 0;          // (tile, Gaussian)
  int runs = 0;               // of tiles (RenderOptions::max_pairs)
  std::optional<GpuBenchReference> cpu;
  std::string no_cpu;                  // why there is no `cpu`
  std::optional<GpuBenchViews> views;  // where they are small
  std::vector<KernelTime> kernels;     // of one picture and its gradient
  bool kernels_by_gpu = false;         // timed by the GPU's clock; otherwise by the host's, with a round trip each
  std::string no_unchecked;            // why there are no times without checks at run time
};

struct GpuBenchReport {
  GpuAdapter adapter;
  double round_trip = 0;  // seconds from a command to its completion
  std::vector<GpuBenchRow> rows;
  bool interrupted = false;  // there are rows of what was done until then
};

// Pictures and gradients of made-up splats on a GPU and on the CPU of the run. A row that fails has the reason and
// does not keep the others from being measured; each is given to `done` when it is.
// Errors: kBadArgument, the choice is the CPU or there is nothing to measure; those of OpenGpu.
Result<GpuBenchReport> BenchGpu(const DeviceChoice& choice, const GpuBenchOptions& options,
                                const std::function<void(const GpuBenchRow&)>& done = {});

// A sentence where a row is not what docs/gpu.md promises of a GPU against the CPU; empty where it is.
std::string BrokenPromise(const GpuBenchRow& row);

}  // namespace anchorsplat
