#include "kernels/benchmark/kernel_timings.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "kernels/attention.h"
#include "kernels/benchmark/forward_mix.h"
#include "kernels/benchmark/machine_peak.h"
#include "kernels/level.h"
#include "kernels/linear.h"
#include "kernels/sparse_convolution.h"

namespace anchorsplat {

namespace {

Buffer<float> RandomFloats(int64_t count, double size) {
  Random random(static_cast<uint64_t>(count));
  Buffer<float> values(static_cast<size_t>(count));
  for (float& x : values) x = static_cast<float>(size * random.Uniform(-1, 1));
  return values;
}

// Times one kind of work and measures the machine's peak alongside: other programs may slow both.
class BestOf {
 public:
  explicit BestOf(int repeats) : repeats_(repeats) {}

  template <typename Work>
  double Best(Work&& work) {
    using Clock = std::chrono::steady_clock;
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < repeats_; ++i) {
      const auto start = Clock::now();
      work();
      best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
      peak_ = std::max(peak_, MeasurePeakFlops(2e-3));
    }
    return best;
  }
  double peak() const { return peak_; }

 private:
  int repeats_;
  double peak_ = 0;
};

double LinearSeconds(BestOf& watch, int64_t rows, int64_t inputs, int64_t outputs, Activation activation,
                     WeightPrecision precision) {
  const Buffer<float> x = RandomFloats(rows * inputs, 1);
  const Buffer<float> w = RandomFloats(outputs * inputs, 0.1);
  const PackedWeights weights(w.data(), nullptr, outputs, inputs, 1, precision);
  Buffer<float> out(static_cast<size_t>(rows * outputs));
  return watch.Best([&] {
    LinearCpu({.rows = rows,
               .input = x.data(),
               .input_stride = inputs,
               .weights = &weights,
               .activation = activation,
               .out = out.data(),
               .output_stride = outputs});
  });
}

}  // namespace

KernelTimings TimeKernels(const std::vector<int32_t>& voxels, int repeats) {
  KernelTimings timings;
  auto hierarchy = BuildHierarchy(voxels);
  if (!hierarchy.ok()) return timings;
  const std::vector<Level>& levels = *hierarchy;
  BestOf watch(repeats);
  KernelTiming attention[] = {{.name = "attention fp32"}, {.name = "attention fp16"}, {.name = "attention bf16"}};
  KernelTiming convolution[] = {{.name = "convolution fp32"}, {.name = "convolution bf16"}};
  KernelTiming linear[] = {{.name = "linear fp32"}, {.name = "linear bf16"}};
  std::vector<KernelTiming> rows;
  for (const BlockMix& mix : kForwardMix) {
    const Level& level = levels[static_cast<size_t>(mix.level)];
    const int64_t n = level.count;
    const int64_t c = mix.channels;
    const double blocks = static_cast<double>(mix.blocks);
    const Buffer<float> qkv = RandomFloats(n * 3 * c, 1);
    Buffer<float> out(static_cast<size_t>(n * c));
    const std::string where = " level " + std::to_string(mix.level) + ", " + std::to_string(c) + " channels";
    for (Rounding rounding : {Rounding::kNone, Rounding::kHalf, Rounding::kBFloat16}) {
      KernelTiming& sum = attention[static_cast<size_t>(rounding)];
      const double seconds = watch.Best([&] {
        AttentionCpu({.count = n,
                      .channels = c,
                      .heads = mix.heads,
                      .scale = static_cast<float>(1 / std::sqrt(static_cast<double>(c / mix.heads))),
                      .qkv = qkv.data(),
                      .patch_rows = level.patch_rows[0].data(),
                      .rounding = rounding,
                      .out = out.data()});
      });
      const double operations = 4.0 * static_cast<double>(n * c * std::min(n, kPatchSize));
      rows.push_back({.name = sum.name + where, .seconds = seconds, .operations = operations});
      sum.seconds += blocks * seconds;
      sum.operations += blocks * operations;
    }
    struct Shape {
      int64_t inputs, outputs;
      Activation activation;
    };
    // Linear layers: after the convolution and after attention; q k v; the two of the MLP.
    const Shape shapes[] = {{c, c, Activation::kNone},
                            {c, c, Activation::kNone},
                            {c, 3 * c, Activation::kNone},
                            {c, 4 * c, Activation::kGelu},
                            {4 * c, c, Activation::kNone}};
    const Buffer<float> w = RandomFloats(c * kNeighbours * c, 0.1);
    for (WeightPrecision precision : {WeightPrecision::kFloat, WeightPrecision::kBFloat16}) {
      const PackedWeights weights(w.data(), nullptr, c, c, kNeighbours, precision);
      KernelTiming& sum = convolution[static_cast<size_t>(precision)];
      const double seconds = watch.Best([&] {
        SparseConvolutionCpu({.count = n,
                              .input = qkv.data(),
                              .neighbours = level.neighbours.data(),
                              .weights = &weights,
                              .out = out.data()});
      });
      const double operations = 2.0 * static_cast<double>(level.neighbour_pairs * c * c);
      rows.push_back({.name = sum.name + where, .seconds = seconds, .operations = operations});
      sum.seconds += blocks * seconds;
      sum.operations += blocks * operations;

      KernelTiming& layers = linear[static_cast<size_t>(precision)];
      for (const Shape& shape : shapes) {
        const double took = LinearSeconds(watch, n, shape.inputs, shape.outputs, shape.activation, precision);
        const double work = 2.0 * static_cast<double>(n * shape.inputs * shape.outputs);
        rows.push_back({.name = layers.name + where + " to " + std::to_string(shape.outputs),
                        .seconds = took,
                        .operations = work});
        layers.seconds += blocks * took;
        layers.operations += blocks * work;
      }
    }
  }
  timings.kernels.assign(std::begin(attention), std::end(attention));
  timings.kernels.insert(timings.kernels.end(), std::begin(convolution), std::end(convolution));
  timings.kernels.insert(timings.kernels.end(), std::begin(linear), std::end(linear));
  timings.kernels.insert(timings.kernels.end(), rows.begin(), rows.end());
  timings.peak_flops = watch.peak();
  for (KernelTiming& k : timings.kernels) k.of_peak = k.operations / k.seconds / timings.peak_flops;
  return timings;
}

}  // namespace anchorsplat
