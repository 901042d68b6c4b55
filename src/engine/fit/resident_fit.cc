#include "fit/resident_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "fit/gpu_adam.h"
#include "fit/wgsl.h"

namespace anchorsplat {

namespace {

const GpuKernel kTakeRows = {"take_rows", {wgsl::kRowsWgsl}};
const GpuKernel kPlaceNewcomers = {"place_newcomers", {wgsl::kRowsWgsl}};
const GpuKernel kGatherGradients = {"gather_gradients", {wgsl::kRowsWgsl}};
const GpuKernel kMarkUsable = {"mark_usable", {wgsl::kRowsWgsl}};
const GpuKernel kCapOpacities = {"cap_opacities", {wgsl::kRowsWgsl}};

constexpr uint64_t kGatheredBytes = 4 * sizeof(float);
constexpr size_t kNewcomerNumbers = 8;

// Struct `Rows` of rows.wgsl.
struct RowsParameters {
  uint32_t count, width, first, limit, from_first, from_count;
  std::array<float, 2> numbers;
};

// A column of a block in GPU and host memory.
struct Column {
  GpuMemory GpuCloudBlock::*memory;
  Buffer<float> GaussianCloud::*values;
  int64_t width;
};
std::array<Column, 5> ColumnsOf(const GpuCloud& cloud) {
  return {{{&GpuCloudBlock::means, &GaussianCloud::means, 3},
           {&GpuCloudBlock::log_scales, &GaussianCloud::log_scales, 3},
           {&GpuCloudBlock::quats, &GaussianCloud::quats, 4},
           {&GpuCloudBlock::opacity_logits, &GaussianCloud::opacity_logits, 1},
           {&GpuCloudBlock::sh, &GaussianCloud::sh, cloud.sh_stride()}}};
}

GpuRead ReadOf(const GpuCloudBlock& block, const Column& column, GaussianCloud& to) {
  const std::span<float> rows((to.*column.values).data() + block.first * column.width,
                              static_cast<size_t>(block.count * column.width));
  return {(block.*column.memory).get(), 0, std::as_writable_bytes(rows)};
}

Result<GaussianCloud> ReadCloud(GpuDevice& device, const GpuCloud& cloud) {
  GaussianCloud out;
  out.Resize(cloud.size(), cloud.sh_degree());
  for (const GpuCloudBlock& block : cloud.blocks()) {
    std::vector<GpuRead> reads;
    for (const Column& column : ColumnsOf(cloud)) reads.push_back(ReadOf(block, column, out));
    ANCHORSPLAT_RETURN_IF_ERROR(device.Read(reads));
  }
  return out;
}

// Moments in the layout of a cloud's columns.
CloudView ViewOf(std::span<const CloudOptimizer::Moments> moments, Buffer<float> CloudOptimizer::Moments::*order,
                 int sh_degree) {
  CloudView view;
  view.sh_degree = sh_degree;
  view.means = moments[0].*order;
  view.log_scales = moments[1].*order;
  view.quats = moments[2].*order;
  view.opacity_logits = moments[3].*order;
  view.sh = moments[4].*order;
  return view;
}
void MoveTo(GaussianCloud&& from, Buffer<float> CloudOptimizer::Moments::*order,
            std::span<CloudOptimizer::Moments> moments) {
  moments[0].*order = std::move(from.means);
  moments[1].*order = std::move(from.log_scales);
  moments[2].*order = std::move(from.quats);
  moments[3].*order = std::move(from.opacity_logits);
  moments[4].*order = std::move(from.sh);
}

Status Upload(GpuDevice& device, const CloudView& view, GpuCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, GpuCloud::Create(device, view.size(), view.sh_degree));
  cloud.Write(device, view);
  return {};
}

}  // namespace

Result<std::unique_ptr<ResidentFit>> ResidentFit::Begin(const std::shared_ptr<GpuDevice>& device,
                                                        const GaussianCloud& cloud, const CloudOptimizer& optimizer,
                                                        const Densification& densification) {
  std::unique_ptr<ResidentFit> fit(new ResidentFit(device));
  fit->origin_ = cloud.origin;
  const auto moments = optimizer.moments();
  const CloudView first = ViewOf(moments, &CloudOptimizer::Moments::first, cloud.sh_degree);
  const CloudView second = ViewOf(moments, &CloudOptimizer::Moments::second, cloud.sh_degree);
  ANCHORSPLAT_RETURN_IF_ERROR(Upload(*device, cloud, fit->cloud_));
  ANCHORSPLAT_RETURN_IF_ERROR(Upload(*device, first, fit->first_));
  ANCHORSPLAT_RETURN_IF_ERROR(Upload(*device, second, fit->second_));
  const Densification::Gathered& gathered = densification.gathered();
  if (gathered.count.empty()) return fit;
  std::vector<float> values(4 * gathered.count.size());
  for (size_t i = 0; i < gathered.count.size(); ++i) {
    values[4 * i] = gathered.grad2d[i];
    values[4 * i + 1] = gathered.count[i];
    values[4 * i + 2] = gathered.radii[i];
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(fit->gathered_,
                               device->Allocate(values.size() * sizeof(float), "what densification gathers"));
  device->Write(*fit->gathered_, 0, std::as_bytes(std::span(values)));
  return fit;
}

Status ResidentFit::Learn(const ObjectiveOptions& options, int64_t view, const ResidentStep& step) {
  return objective_.Compare(options, cloud_, view, [&](const GpuGradient& gradient) -> Status {
    LearnRows(step, gradient);
    if (step.gathers && gathered_ != nullptr) Gather(step, gradient);
    return {};
  });
}

void ResidentFit::LearnRows(const ResidentStep& step, const GpuGradient& gradient) {
  const LearningRates& rates = step.rates;
  const GpuCloudBlock& values = cloud_.blocks()[gradient.block];
  const GpuCloudBlock& first = first_.blocks()[gradient.block];
  const GpuCloudBlock& second = second_.blocks()[gradient.block];
  GpuAdamParams p{};
  p.rows = std::clamp<int64_t>(step.learning - gradient.first, 0, gradient.count);
  p.first_row = gradient.offset;
  p.beta1 = rates.beta1;
  p.beta2 = rates.beta2;
  p.epsilon = rates.epsilon;
  p.step = step.number;
  const auto adam = [&](const GpuMemory& of, GpuMemory GpuCloudBlock::*column, int64_t width, double rate) {
    p.gradient = of.get();
    p.first_moment = (first.*column).get();
    p.second_moment = (second.*column).get();
    p.values = (values.*column).get();
    p.stride = width;
    if (p.first_columns == 0) p.columns = width;
    p.rate = rate;
    RecordAdamStep(p, *device_);
  };
  adam(gradient.means, &GpuCloudBlock::means, 3, step.means_rate);
  adam(gradient.log_scales, &GpuCloudBlock::log_scales, 3, rates.scales);
  adam(gradient.quats, &GpuCloudBlock::quats, 4, rates.quats);
  adam(gradient.opacity_logits, &GpuCloudBlock::opacity_logits, 1, rates.opacities);
  p.first_columns = 3;
  p.first_rate = rates.sh0;
  p.columns = 3 * ShCoefficients(std::min(step.sh_degree, cloud_.sh_degree()));
  adam(gradient.sh, &GpuCloudBlock::sh, cloud_.sh_stride(), rates.sh_rest);
}

void ResidentFit::Gather(const ResidentStep& step, const GpuGradient& gradient) {
  RowsParameters p{};
  p.count = static_cast<uint32_t>(gradient.count);
  p.numbers = {0.5f * static_cast<float>(step.width), 0.5f * static_cast<float>(step.height)};
  const auto first = static_cast<uint64_t>(gradient.first), count = static_cast<uint64_t>(gradient.count);
  constexpr uint64_t kRadiiBytes = 2 * sizeof(int32_t);
  device_->Run(kGatherGradients, AsParameters(p),
               {{1, step.absgrad ? gradient.means2d_abs.get() : gradient.means2d.get()},
                {2, &objective_.radii(), first * kRadiiBytes, count * kRadiiBytes},
                {3, gathered_.get(), first * kGatheredBytes, count * kGatheredBytes}},
               GpuWorkgroups(gradient.count));
}

Status ResidentFit::ReadGathered(Densification::Gathered& gathered) const {
  const auto n = static_cast<size_t>(size());
  std::vector<float> values(4 * n);
  const GpuRead read = {gathered_.get(), 0, std::as_writable_bytes(std::span(values))};
  ANCHORSPLAT_RETURN_IF_ERROR(device_->Read({&read, 1}));
  for (Buffer<float>* array : {&gathered.grad2d, &gathered.count, &gathered.radii}) array->resize(n);
  for (size_t i = 0; i < n; ++i) {
    gathered.grad2d[i] = values[4 * i];
    gathered.count[i] = values[4 * i + 1];
    gathered.radii[i] = values[4 * i + 2];
  }
  return {};
}

Result<RefinementPlan> ResidentFit::Plan(const DensificationOptions& options, int64_t step, double scene_scale,
                                         uint64_t seed) {
  const auto n = static_cast<size_t>(size());
  Densification densification;
  ANCHORSPLAT_RETURN_IF_ERROR(ReadGathered(densification.gathered()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GpuMemory marks, device_->Allocate(n * sizeof(uint32_t), "marks of Gaussians"));
  shapes_.Resize(size(), 0);
  std::vector<GpuRead> reads;
  for (const GpuCloudBlock& block : cloud_.blocks()) {
    RowsParameters p{};
    p.count = static_cast<uint32_t>(block.count);
    p.width = static_cast<uint32_t>(cloud_.sh_stride());
    device_->Run(kMarkUsable, AsParameters(p),
                 {{1, block.means.get()},
                  {2, block.log_scales.get()},
                  {3, block.quats.get()},
                  {4, block.opacity_logits.get()},
                  {5, block.sh.get()},
                  {6, marks.get(), static_cast<uint64_t>(block.first) * sizeof(uint32_t),
                   static_cast<uint64_t>(block.count) * sizeof(uint32_t)}},
                 GpuWorkgroups(block.count));
    for (const Column& column : ColumnsOf(cloud_)) {
      if (column.values != &GaussianCloud::sh) reads.push_back(ReadOf(block, column, shapes_));
    }
  }
  std::vector<uint32_t> marked(n);
  reads.push_back({marks.get(), 0, std::as_writable_bytes(std::span(marked))});
  ANCHORSPLAT_RETURN_IF_ERROR(device_->Read(reads));
  const std::vector<uint8_t> usable(marked.begin(), marked.end());
  return densification.Plan(options, step, scene_scale, seed, {}, shapes_, usable);
}

void ResidentFit::TakeRows(const GpuBuffer& source, int64_t limit, const GpuCloud& from, const GpuCloud& to) {
  for (const GpuCloudBlock& fresh : to.blocks()) {
    for (const GpuCloudBlock& old : from.blocks()) {
      for (const Column& column : ColumnsOf(to)) {
        RowsParameters p{};
        p.count = static_cast<uint32_t>(fresh.count * column.width);
        p.width = static_cast<uint32_t>(column.width);
        p.first = static_cast<uint32_t>(fresh.first);
        p.limit = static_cast<uint32_t>(limit);
        p.from_first = static_cast<uint32_t>(old.first);
        p.from_count = static_cast<uint32_t>(old.count);
        device_->Run(kTakeRows, AsParameters(p),
                     {{1, &source}, {2, (old.*column.memory).get()}, {3, (fresh.*column.memory).get()}},
                     GpuWorkgroups(fresh.count * column.width));
      }
    }
  }
}

Status ResidentFit::Apply(const DensificationOptions& options, const RefinementPlan& plan) {
  const RowChange& rows = plan.change.rows;
  if (!rows.any) {
    device_->Clear(*gathered_, 0, gathered_->bytes());
    return {};
  }
  const int64_t kept = std::ssize(rows.kept), count = kept + rows.fresh;
  std::vector<uint32_t> from(rows.kept.begin(), rows.kept.end());
  std::vector<float> shapes(kNewcomerNumbers * plan.newcomers.size());
  for (size_t k = 0; k < plan.newcomers.size(); ++k) {
    const Newcomer& newcomer = plan.newcomers[k];
    const NewcomerShape shape = ShapeOf(options, newcomer, shapes_);
    float* to = shapes.data() + kNewcomerNumbers * k;
    std::copy_n(newcomer.offset, 3, to);
    std::copy_n(shape.log_scales.begin(), 3, to + 3);
    to[6] = shape.opacity_logit;
    from.push_back(static_cast<uint32_t>(newcomer.source));
  }
  // Allocates everything first, so that a failure leaves nothing half done.
  GpuCloud cloud, first, second;
  GpuMemory gathered, source, newcomers;
  const int degree = cloud_.sh_degree();
  ANCHORSPLAT_ASSIGN_OR_RETURN(source, device_->Allocate(from.size() * sizeof(uint32_t), "rows to keep"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(newcomers,
                               device_->Allocate(std::max<size_t>(1, shapes.size()) * sizeof(float), "new Gaussians"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      gathered, device_->Allocate(static_cast<uint64_t>(count) * kGatheredBytes, "what densification gathers"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, GpuCloud::Create(*device_, count, degree));
  ANCHORSPLAT_ASSIGN_OR_RETURN(first, GpuCloud::Create(*device_, count, degree));
  ANCHORSPLAT_ASSIGN_OR_RETURN(second, GpuCloud::Create(*device_, count, degree));

  device_->Write(*source, 0, std::as_bytes(std::span(from)));
  TakeRows(*source, count, cloud_, cloud);
  TakeRows(*source, kept, first_, first);  // newcomers' moments are zero, like all new memory
  TakeRows(*source, kept, second_, second);
  if (!shapes.empty()) {
    device_->Write(*newcomers, 0, std::as_bytes(std::span(shapes)));
    for (const GpuCloudBlock& block : cloud.blocks()) {
      RowsParameters p{};
      p.count = static_cast<uint32_t>(block.count);
      p.first = static_cast<uint32_t>(block.first);
      p.limit = static_cast<uint32_t>(kept);
      device_->Run(
          kPlaceNewcomers, AsParameters(p),
          {{1, newcomers.get()}, {2, block.means.get()}, {3, block.log_scales.get()}, {4, block.opacity_logits.get()}},
          GpuWorkgroups(block.count));
    }
  }
  cloud_ = std::move(cloud);
  first_ = std::move(first);
  second_ = std::move(second);
  gathered_ = std::move(gathered);
  return {};
}

void ResidentFit::ResetOpacities(double cap) {
  RowsParameters p{};
  p.numbers[0] = static_cast<float>(std::log(cap / (1 - cap)));
  for (const GpuCloudBlock& block : cloud_.blocks()) {
    p.count = static_cast<uint32_t>(block.count);
    device_->Run(kCapOpacities, AsParameters(p), {{1, block.opacity_logits.get()}}, GpuWorkgroups(block.count));
  }
  for (const GpuCloud* moments : {&first_, &second_}) {
    for (const GpuCloudBlock& block : moments->blocks()) {
      device_->Clear(*block.opacity_logits, 0, block.opacity_logits->bytes());
    }
  }
}

Status ResidentFit::Read(GaussianCloud& cloud, CloudOptimizer& optimizer, Densification& densification) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud values, ReadCloud(*device_, cloud_));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud first, ReadCloud(*device_, first_));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud second, ReadCloud(*device_, second_));
  Densification::Gathered gathered;
  if (gathered_ != nullptr) ANCHORSPLAT_RETURN_IF_ERROR(ReadGathered(gathered));
  cloud.means = std::move(values.means);
  cloud.log_scales = std::move(values.log_scales);
  cloud.quats = std::move(values.quats);
  cloud.opacity_logits = std::move(values.opacity_logits);
  cloud.sh = std::move(values.sh);
  MoveTo(std::move(first), &CloudOptimizer::Moments::first, optimizer.moments());
  MoveTo(std::move(second), &CloudOptimizer::Moments::second, optimizer.moments());
  if (gathered_ != nullptr) densification.gathered() = std::move(gathered);
  return {};
}

}  // namespace anchorsplat
