#include "fit/pixel_model.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int kRowsPerTask = 16;

void Shape(int width, int height, int channels, Image& image) {
  if (image.width == width && image.height == height && image.channels == channels) return;
  image = Image(width, height, channels);
}

// Sums `samples` neighbours in a row. Unrolled for four, the usual number.
void SumAcross(const float* in, int samples, float scale, float* out, int count) {
  if (samples == 4) {
    for (int x = 0; x < count; ++x) {
      out[x] = scale * ((in[4 * x] + in[4 * x + 1]) + (in[4 * x + 2] + in[4 * x + 3]));
    }
    return;
  }
  for (int x = 0; x < count; ++x) {
    float sum = 0;
    for (int k = 0; k < samples; ++k) sum += in[x * samples + k];
    out[x] = scale * sum;
  }
}

}  // namespace

Status Validate(const PixelModel& model) {
  if (!(model.upscale >= 1 && model.upscale <= kMostSamples)) {
    return Error{ErrorCode::kBadArgument, Cat("upscale ", model.upscale, " must be 1 to ", kMostSamples)};
  }
  if (model.samples < 1 || model.samples > std::ceil(model.upscale)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(model.samples, " rays per pixel side; must be 1 to ", std::ceil(model.upscale))};
  }
  return {};
}

PixelModel AreaModel(double upscale) { return {static_cast<int>(std::ceil(upscale)), upscale}; }

Status Validate(const PixelSchedule& schedule) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(PixelModel{1, schedule.upscale}));
  if (!(schedule.half_from >= 0 && schedule.half_from <= schedule.all_from && schedule.all_from <= 1)) {
    return Error{ErrorCode::kBadArgument, Cat("half_from ", schedule.half_from, " and all_from ", schedule.all_from,
                                              " must ascend from 0 to 1")};
  }
  return {};
}

PixelModel PixelModelAt(const PixelSchedule& schedule, double done) {
  const int all = AreaModel(schedule.upscale).samples;
  if (done >= schedule.all_from) return {all, schedule.upscale};
  return {done >= schedule.half_from ? (all + 1) / 2 : 1, schedule.upscale};
}

RenderOptions RaysOf(const PixelModel& model, const RenderOptions& options) {
  if (model.IsPoint()) return options;
  RenderOptions rays = options;
  // Closer-view pixels per ray side.
  const double share = std::min(1.0, model.samples / model.upscale);
  const double closer = DilationOf(options) * share * share, box = (1 - share * share) / 12;
  rays.dilation = static_cast<float>(closer + box);
  if (box <= 0) return rays;
  // With compensated opacity a splat keeps its undilated integral at every size.
  if (!IsCompensated(options.mode)) {
    rays.compensated_from = static_cast<float>(closer);
    rays.mode = RenderMode::kAntialiased;
  }
  return rays;
}

Camera RaysOf(const PixelModel& model, const Camera& camera) {
  Camera rays = camera;
  rays.intrinsics = Scaled(camera.intrinsics, model.samples);
  return rays;
}

void AverageRays(const Image& rays, int samples, Image& averages) {
  const int width = rays.width / samples, height = rays.height / samples;
  Shape(width, height, rays.channels, averages);
  const float scale = 1.0f / static_cast<float>(samples * samples);
  const int64_t rows = int64_t{rays.channels} * height;
  ParallelFor(0, rows, kRowsPerTask, [&](int64_t first, int64_t last) {
    Buffer<float> sums(static_cast<size_t>(rays.width));
    for (int64_t row = first; row < last; ++row) {
      const float* in = rays.pixels.data() + row * samples * rays.width;
      std::copy_n(in, rays.width, sums.data());
      for (int k = 1; k < samples; ++k) {
        const float* next = in + int64_t{k} * rays.width;
        for (int x = 0; x < rays.width; ++x) sums[static_cast<size_t>(x)] += next[x];
      }
      SumAcross(sums.data(), samples, scale, averages.pixels.data() + row * width, width);
    }
  });
}

PixelBox SpreadToRays(const Image& averages, const PixelBox& box, int samples, Image& rays) {
  Shape(averages.width * samples, averages.height * samples, averages.channels, rays);
  if (box.empty()) return {};
  const float scale = 1.0f / static_cast<float>(samples * samples);
  const int64_t height = box.y1 - box.y0;
  ParallelFor(0, averages.channels * height, kRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t k = first; k < last; ++k) {
      const int channel = static_cast<int>(k / height), y = box.y0 + static_cast<int>(k % height);
      const float* in = averages.channel(channel) + int64_t{y} * averages.width;
      float* out = rays.channel(channel) + int64_t{y} * samples * rays.width;
      for (int x = box.x0; x < box.x1; ++x) std::fill_n(out + x * samples, samples, scale * in[x]);
      const int64_t from = int64_t{box.x0} * samples, count = int64_t{box.x1 - box.x0} * samples;
      for (int copy = 1; copy < samples; ++copy) std::copy_n(out + from, count, out + copy * rays.width + from);
    }
  });
  return {box.x0 * samples, box.y0 * samples, box.x1 * samples, box.y1 * samples};
}

}  // namespace anchorsplat
