#include "bench/gpu_bench.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "bench/gpu_bench_scene.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "gpu/open_gpu.h"
#include "render/gpu_cloud.h"
#include "render/gpu_rasterizer.h"
#include "render/gpu_rasterizer_backward.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

constexpr int kViews = 8;
constexpr uint64_t kViewBytes = uint64_t{48} << 20;  // of all their pictures together
constexpr double kNever = std::numeric_limits<double>::infinity();

Error Stopped() { return {ErrorCode::kInterrupted, "stopped"}; }

RenderOptions WithGradient() {
  RenderOptions options;
  options.gradient = true;
  return options;
}

// The fastest of several repeats; `what` returns the seconds to compare.
template <typename T>
Result<T> Fastest(const GpuBenchOptions& options, const std::function<Result<T>()>& what,
                  const std::function<double(const T&)>& seconds) {
  const Stopwatch all;
  std::optional<T> best;
  for (int repeat = 0; repeat < options.repeats && (repeat == 0 || all.Total() < options.most_seconds); ++repeat) {
    if (StopRequested()) return Stopped();
    ANCHORSPLAT_ASSIGN_OR_RETURN(T one, what());
    if (!best || seconds(one) < seconds(*best)) best = std::move(one);
  }
  return *std::move(best);
}

// A splat, its picture and gradient.
struct Load {
  const GaussianCloud& cloud;
  const Camera& camera;
  const RenderGradient& weights;
  RenderOptions options = WithGradient();
};

// A load resident on a GPU.
class OnGpu {
 public:
  OnGpu(std::shared_ptr<GpuDevice> device, const Load& load)
      : device_(std::move(device)), load_(load), rasterizer_(device_), backward_(rasterizer_) {}

  Status Upload() {
    ANCHORSPLAT_RETURN_IF_ERROR(cloud_.Assign(*device_, load_.cloud));
    return device_->Wait();
  }

  Status UploadWeights() {
    const Image& color = load_.weights.color;
    const auto plane = static_cast<size_t>(color.plane());
    std::vector<float> pixels(4 * plane);
    for (size_t i = 0; i < plane; ++i) {
      for (size_t c = 0; c < 3; ++c) pixels[4 * i + c] = color.pixels[c * plane + i];
      pixels[4 * i + 3] = load_.weights.alpha.pixels[i];
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(weights_, device_->Allocate(4 * pixels.size(), "the gradient of a picture"));
    device_->Write(*weights_, 0, std::as_bytes(std::span(pixels)));
    return device_->Wait();
  }

  Status Forward(const RenderOptions& options, RenderOutput* output) {
    if (cloud_.empty()) ANCHORSPLAT_RETURN_IF_ERROR(cloud_.Assign(*device_, load_.cloud));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const bool drawn,
                                 rasterizer_.Draw(cloud_, load_.camera, options.near_plane, options, output));
    if (!drawn) return Error{ErrorCode::kIo, "the picture needs the CPU's doubles"};
    return device_->Wait();
  }
  Status Forward() { return Forward(load_.options, nullptr); }

  Status Backward(const std::function<Status(const GpuGradient&)>& use) {
    const Pinhole& k = load_.camera.intrinsics;
    ANCHORSPLAT_RETURN_IF_ERROR(
        backward_.Blend(load_.options, GpuPictureGradient{weights_.get(), {0, 0, k.width, k.height}}));
    // As in Rasterizer::Backward: such rows are uploaded again or read on the host.
    if (cloud_.empty() || !cloud_.resident() || !rasterizer_.unusual_rows.empty()) {
      ANCHORSPLAT_RETURN_IF_ERROR(cloud_.Assign(*device_, load_.cloud));
    }
    ANCHORSPLAT_RETURN_IF_ERROR(backward_.Project(cloud_, load_.options, use));
    return device_->Wait();
  }
  Status Backward() {
    return Backward([](const GpuGradient&) { return Status(); });
  }

  // Gradients in the order of kGpuBenchGradients.
  Result<std::array<Buffer<float>, 6>> ReadGradient() {
    std::array<Buffer<float>, 6> columns;
    const auto n = static_cast<size_t>(load_.cloud.size());
    const std::array<size_t, 6> widths = {3, 3, 4, 1, static_cast<size_t>(load_.cloud.sh_stride()), 2};
    for (size_t c = 0; c < 6; ++c) columns[c].resize(n * widths[c]);
    ANCHORSPLAT_RETURN_IF_ERROR(Backward([&](const GpuGradient& part) {
      const std::array<const GpuMemory*, 6> parts = {&part.means,          &part.log_scales, &part.quats,
                                                     &part.opacity_logits, &part.sh,         &part.means2d};
      const auto first = static_cast<size_t>(part.first), count = static_cast<size_t>(part.count);
      std::vector<GpuRead> reads;
      for (size_t c = 0; c < 6; ++c) {
        const std::span<float> to(columns[c].data() + first * widths[c], count * widths[c]);
        reads.push_back({parts[c]->get(), 0, std::as_writable_bytes(to)});
      }
      return device_->Read(reads);
    }));
    return columns;
  }

  // Rows of visible Gaussians by depth.
  Result<std::vector<uint32_t>> ReadOrder() {
    std::vector<uint32_t> order(static_cast<size_t>(rasterizer_.visible));
    if (order.empty()) return order;
    const GpuRead read = {rasterizer_.rows[0].get(), 0, std::as_writable_bytes(std::span(order))};
    ANCHORSPLAT_RETURN_IF_ERROR(device_->Read({&read, 1}));
    return order;
  }

  // Renders views of the same camera both ways.
  Result<GpuBenchViews> Views(const RenderOptions& options, int count) {
    GpuBenchViews views;
    views.count = count;
    const Pinhole& k = load_.camera.intrinsics;
    std::vector<RenderOutput> alone(static_cast<size_t>(count)), together(static_cast<size_t>(count));
    std::vector<GpuRasterizer::Picture> pictures;
    for (size_t v = 0; v < alone.size(); ++v) {
      for (RenderOutput* output : {&alone[v], &together[v]}) {
        output->color = Image(k.width, k.height, 3);
        output->alpha = Image(k.width, k.height, 1);
      }
      pictures.push_back({.camera = load_.camera, .near = options.near_plane, .output = together[v]});
    }
    for (int pass = 0; pass < 2; ++pass) {  // the first pass allocates
      int64_t waits = device_->waits();
      Stopwatch watch;
      for (RenderOutput& output : alone) {
        ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Draw(cloud_, load_.camera, options.near_plane, options, &output));
      }
      views.seconds = watch.Lap() / count;
      views.waits = static_cast<double>(device_->waits() - waits) / count;
      waits = device_->waits();
      const int64_t pairs = std::max<int64_t>(1, rasterizer_.total_pairs);
      watch.Lap();
      ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.DrawTogether(cloud_, pictures, options, pairs));
      views.seconds_together = watch.Lap() / count;
      views.waits_together = static_cast<double>(device_->waits() - waits) / count;
    }
    rasterizer_.ForgetTogether();
    const auto count_differing = [&](const Image& expected, const Image& drawn) {
      for (size_t i = 0; i < expected.pixels.size(); ++i) {
        views.differing += expected.pixels[i] != drawn.pixels[i] ? 1 : 0;
      }
    };
    for (size_t v = 0; v < alone.size(); ++v) {
      count_differing(alone[v].color, together[v].color);
      count_differing(alone[v].alpha, together[v].alpha);
    }
    return views;
  }

  const GpuCloud& cloud() const { return cloud_; }
  const GpuRasterizer& rasterizer() const { return rasterizer_; }

 private:
  std::shared_ptr<GpuDevice> device_;
  const Load& load_;
  GpuRasterizer rasterizer_;
  GpuRasterizerBackward backward_;
  GpuCloud cloud_;
  GpuMemory weights_;
};

struct BothWays {
  double forward = 0, backward = 0, waited = 0;  // seconds
  double InAll() const { return forward + backward; }
};

// The fastest of either way.
Result<BothWays> FastestBothWays(const GpuBenchOptions& options, const std::function<Result<BothWays>()>& what) {
  return Fastest<BothWays>(options, what, [](const BothWays& both) { return both.InAll(); });
}

Status MeasureGpu(const std::shared_ptr<GpuDevice>& device, const Load& load, const GpuBenchOptions& options,
                  OnGpu& gpu, RenderOutput& output, GpuBenchRow& row) {
  Stopwatch watch;
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.Upload());
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.UploadWeights());
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.Forward());
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.Backward());
  row.first = watch.Lap();
  row.visible = gpu.rasterizer().visible;
  row.pairs = gpu.rasterizer().total_pairs;
  row.runs = gpu.rasterizer().runs;

  const auto both = [&]() -> Result<BothWays> {
    BothWays times;
    const double waited = device->seconds();
    Stopwatch lap;
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Forward());
    times.forward = lap.Lap();
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Backward());
    times.backward = lap.Lap();
    times.waited = device->seconds() - waited;
    return times;
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(const BothWays best, FastestBothWays(options, both));
  row.forward = best.forward;
  row.backward = best.backward;
  row.waiting = best.waited / best.InAll();
  row.resident = gpu.cloud().resident() && !gpu.cloud().empty();

  const auto seconds = [](const double& one) { return one; };
  const auto upload = [&]() -> Result<double> {
    const Stopwatch lap;
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Upload());
    return lap.Total();
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(row.upload, Fastest<double>(options, upload, seconds));
  RenderOptions shown = load.options;
  shown.gradient = false;
  const auto picture = [&]() -> Result<double> {
    const Stopwatch lap;
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Upload());
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Forward(shown, &output));
    return lap.Total();
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(row.picture, Fastest<double>(options, picture, seconds));
  const bool small = kViews * GpuRasterizer::BytesTogether(load.camera.intrinsics, shown) <= kViewBytes;
  if (!small || !row.resident || row.runs > 1) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(row.views, gpu.Views(shown, kViews));
  return {};
}

Result<std::vector<KernelTime>> TimeKernels(const std::shared_ptr<KernelClock>& clock, const Load& load) {
  OnGpu gpu(clock, load);
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.Upload());
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.UploadWeights());
  for (int pass = 0; pass < 2; ++pass) {  // the first pass allocates
    if (StopRequested()) return Stopped();
    clock->Reset();
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Forward());
    ANCHORSPLAT_RETURN_IF_ERROR(gpu.Backward());
  }
  return clock->times();
}

Status MeasureKernels(const DeviceChoice& choice, const std::shared_ptr<GpuDevice>& device, const Load& load,
                      GpuBenchRow& row) {
  const auto clock = std::make_shared<KernelClock>(device);
  ANCHORSPLAT_ASSIGN_OR_RETURN(row.kernels, TimeKernels(clock, load));
  row.kernels_by_gpu = clock->by_gpu();
  // Failing here is no failure of the row.
  const Result<std::shared_ptr<GpuDevice>> unchecked = OpenUncheckedGpu(choice);
  const Result<std::vector<KernelTime>> times =
      unchecked.ok() ? TimeKernels(std::make_shared<KernelClock>(*unchecked), load) : unchecked.error();
  if (!times.ok()) {
    if (times.error().code == ErrorCode::kInterrupted) return times.error();
    row.no_unchecked = times.error().message;
    return {};
  }
  for (const KernelTime& time : *times) {
    const auto same = std::ranges::find(row.kernels, time.entry, &KernelTime::entry);
    if (same != row.kernels.end()) same->unchecked = time.seconds;
  }
  return {};
}

double RelativeL2(const Buffer<float>& a, const Buffer<float>& b) {
  double difference = 0, size = 0;
  for (size_t i = 0; i < b.size(); ++i) {
    const double d = double{a[i]} - double{b[i]};
    difference += d * d;
    size += double{b[i]} * double{b[i]};
  }
  if (difference == 0) return 0;
  return std::sqrt(difference / size);
}

// Number of positions in the GPU's depth order that differ by the CPU's depths (formula: render/project.cc).
int64_t OutOfOrder(const Load& load, const std::vector<uint32_t>& order) {
  const Pose& pose = load.camera.world_to_camera;
  Buffer<float> depths(static_cast<size_t>(load.cloud.size()));
  for (size_t i = 0; i < depths.size(); ++i) {
    double z = pose.translation[2];
    for (size_t k = 0; k < 3; ++k) z += pose.rotation[6 + k] * load.cloud.means[3 * i + k];
    depths[i] = static_cast<float>(z);
  }
  std::vector<uint32_t> expected = order;
  std::ranges::sort(expected);
  std::ranges::stable_sort(expected, {}, [&](uint32_t row) { return depths[row]; });
  int64_t differing = 0;
  for (size_t i = 0; i < order.size(); ++i) differing += order[i] != expected[i] ? 1 : 0;
  return differing;
}

void CountBeyond(const Image& gpu, const Image& cpu, GpuBenchReference& reference) {
  for (size_t i = 0; i < cpu.pixels.size(); ++i) {
    const double difference = std::abs(double{gpu.pixels[i]} - double{cpu.pixels[i]});
    ++reference.values;
    if (!(difference <= 1e-4 * std::max(1.0, std::abs(double{cpu.pixels[i]})))) ++reference.beyond;  // also for NaN
  }
}

Status MeasureCpu(const Load& load, const GpuBenchOptions& options, OnGpu& gpu, const RenderOutput& drawn,
                  GpuBenchRow& row) {
  ANCHORSPLAT_RETURN_IF_ERROR(gpu.Forward());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<uint32_t> order, gpu.ReadOrder());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto columns, gpu.ReadGradient());
  Rasterizer rasterizer;
  RenderOutput output;
  CloudGradient gradient;
  const auto both = [&]() -> Result<BothWays> {
    BothWays times;
    Stopwatch lap;
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(load.cloud, load.camera, load.options, output));
    times.forward = lap.Lap();
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(load.cloud, load.weights, gradient));
    times.backward = lap.Lap();
    return times;
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(const BothWays best, FastestBothWays(options, both));
  GpuBenchReference reference;
  reference.forward = best.forward;
  reference.backward = best.backward;
  reference.visible = rasterizer.statistics().visible;
  reference.out_of_order = OutOfOrder(load, order);
  CountBeyond(drawn.color, output.color, reference);
  CountBeyond(drawn.alpha, output.alpha, reference);
  const std::array<const Buffer<float>*, 6> of_cpu = {&gradient.means, &gradient.log_scales,
                                                      &gradient.quats, &gradient.opacity_logits,
                                                      &gradient.sh,    &gradient.means2d};
  for (size_t c = 0; c < 6; ++c) reference.gradient_l2[c] = RelativeL2(columns[c], *of_cpu[c]);
  row.cpu = reference;
  return {};
}

// Upper estimate of the CPU's time for a picture and gradient, in proportion to Gaussians and pixels of earlier rows. 0
// for the first row.
double ExpectedOnCpu(const std::vector<GpuBenchRow>& rows, const GpuBenchRow& next) {
  double least = kNever;
  for (const GpuBenchRow& row : rows) {
    if (!row.cpu) continue;
    const double gaussians = static_cast<double>(next.gaussians) / static_cast<double>(row.gaussians);
    const double pixels = double{1} * next.width * next.height / (double{1} * row.width * row.height);
    least = std::min(least, (row.cpu->forward + row.cpu->backward) * std::max(1.0, gaussians) * std::max(1.0, pixels));
  }
  return std::isfinite(least) ? least : 0;
}

Status MeasureRow(const DeviceChoice& choice, const GaussianCloud& cloud, const GpuBenchOptions& options,
                  double expected_on_cpu, GpuBenchRow& row) {
  // Reopens a lost device.
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::shared_ptr<GpuDevice> device, OpenGpu(choice));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Camera camera, GpuBenchCamera(row.width, row.height));
  RenderGradient weights = GpuBenchWeights(row.width, row.height, options.seed + 1);
  weights.box = {0, 0, row.width, row.height};
  const Load load = {cloud, camera, weights};
  {
    OnGpu gpu(device, load);
    RenderOutput output;
    output.color = Image(row.width, row.height, 3);
    output.alpha = Image(row.width, row.height, 1);
    ANCHORSPLAT_RETURN_IF_ERROR(MeasureGpu(device, load, options, gpu, output, row));
    if (expected_on_cpu > options.most_cpu_seconds) {
      row.no_cpu = Cat("it would take the CPU about ", HumanSeconds(expected_on_cpu));
    } else {
      ANCHORSPLAT_RETURN_IF_ERROR(MeasureCpu(load, options, gpu, output, row));
    }
  }
  if (options.kernels) ANCHORSPLAT_RETURN_IF_ERROR(MeasureKernels(choice, device, load, row));
  return {};
}

Result<double> RoundTrip(GpuDevice& device) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GpuMemory memory, device.Allocate(256, "a round trip"));
  double best = kNever;
  for (int repeat = 0; repeat < 10; ++repeat) {
    const Stopwatch watch;
    device.Clear(*memory, 0, 256);
    ANCHORSPLAT_RETURN_IF_ERROR(device.Wait());
    best = std::min(best, watch.Total());
  }
  return best;
}

}  // namespace

GpuBenchOptions SmallGpuBench() {
  GpuBenchOptions options;
  options.gaussians = {1'000, 20'000};
  options.sizes = {{64, 64}, {256, 256}};
  options.repeats = 2;
  options.most_seconds = 2;
  options.most_cpu_seconds = 5;
  options.kernels = false;
  return options;
}

Result<GpuBenchReport> BenchGpu(const DeviceChoice& choice, const GpuBenchOptions& options,
                                const std::function<void(const GpuBenchRow&)>& done) {
  if (choice.kind == DeviceChoice::Kind::kCpu) {
    return Error{ErrorCode::kBadArgument, "this measures a GPU against the CPU, and the CPU is none (--device gpu)"};
  }
  const auto positive = [](const auto& sizes) { return std::ranges::all_of(sizes, [](auto v) { return v > 0; }); };
  if (options.repeats < 1 || !positive(options.gaussians) || !std::ranges::all_of(options.sizes, positive)) {
    return Error{ErrorCode::kBadArgument, "repeats, Gaussians and pixels must be at least 1"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::shared_ptr<GpuDevice> device, OpenGpu(choice));
  GpuBenchReport report;
  report.adapter = device->adapter();
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.round_trip, RoundTrip(*device));
  Progress progress("Measuring", static_cast<int64_t>(options.gaussians.size() * options.sizes.size()));
  for (const int64_t gaussians : options.gaussians) {
    GaussianCloud cloud;
    for (const auto& [width, height] : options.sizes) {
      if (StopRequested()) report.interrupted = true;
      if (report.interrupted) return report;
      GpuBenchRow row;
      row.gaussians = gaussians, row.width = width, row.height = height;
      try {
        if (cloud.empty()) cloud = GpuBenchCloud(gaussians, options.seed);
        const Status status = MeasureRow(choice, cloud, options, ExpectedOnCpu(report.rows, row), row);
        if (!status.ok() && status.error().code == ErrorCode::kInterrupted) {
          report.interrupted = true;
          return report;
        }
        if (!status.ok()) row.problem = status.error().message;
        if (row.problem.find("--max-gpu-memory") != std::string::npos) {
          row.problem += Cat("; try --max-gpu-memory ", MaxGpuMemoryOfRun() / 500'000, "M");  // twice as much
        }
      } catch (const std::bad_alloc&) {
        row.problem = "the memory of this machine does not suffice";
      }
      report.rows.push_back(row);
      if (done) done(row);
      progress.Advance(1, Cat(WithThousands(gaussians), " Gaussians at ", width, " x ", height));
    }
  }
  return report;
}

std::string BrokenPromise(const GpuBenchRow& row) {
  if (row.views && row.views->differing > 0) {
    return Cat(WithThousands(row.views->differing),
               " numbers of pictures drawn together have other bits than one by one");
  }
  if (!row.cpu) return "";
  const GpuBenchReference& cpu = *row.cpu;
  if (cpu.out_of_order > 0) {
    return Cat(WithThousands(cpu.out_of_order), " of ", WithThousands(row.visible),
               " Gaussians stand elsewhere in the order by depth than on the CPU");
  }
  if (static_cast<double>(cpu.beyond) > 5e-5 * static_cast<double>(cpu.values)) {
    return Cat(WithThousands(cpu.beyond), " of ", WithThousands(cpu.values),
               " values are further than 1e-4 from the CPU's; 5 in 100,000 may be");
  }
  for (size_t c = 0; c < cpu.gradient_l2.size(); ++c) {
    if (cpu.gradient_l2[c] <= 1e-3) continue;
    return Cat("the gradient of ", kGpuBenchGradients[c], " is ", cpu.gradient_l2[c],
               " of its length from the CPU's; 0.001 may be");
  }
  return "";
}

}  // namespace anchorsplat
