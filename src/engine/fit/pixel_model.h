#pragma once

#include <string>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How a pixel gets its value from a splat. Rasterizers sample: a pixel is the value of the ray through its centre, with
// Gaussians dilated by d = 0.3 px² of that pixel (DilationOf the render mode). Cameras average over the pixel's area. A
// splat to be seen `upscale` times closer should match its training pictures when rendered at that resolution and
// averaged down: the area model, with upscale² rays per pixel.
//
// Fewer rays, `samples`² of them, approximate it with wider Gaussians. Each ray then covers upscale/samples closer
// pixels per side, a box of variance (1 − (samples/upscale)²)/12 of its side². This is added to d·(samples/upscale)²,
// the closer pixels' dilation at this size, and opacity is lowered to keep each Gaussian's integral. For a single
// Gaussian this is right up to the box's shape. With occlusion it is an approximation, but much cheaper. It is exact
// for samples = upscale.
struct PixelModel {
  int samples = 1;     // rays per pixel side; 1 to upscale, rounded up
  double upscale = 1;  // ≥ 1; 1 with one sample is the point model of 3DGS

  bool IsPoint() const { return samples == 1 && upscale == 1; }
  friend bool operator==(const PixelModel&, const PixelModel&) = default;
};

inline constexpr int kMostSamples = 16;

// kBadArgument: upscale not in 1 … kMostSamples, samples not in 1 … upscale, rounded up.
Status Validate(const PixelModel& model);

// The model with all rays: samples = upscale, rounded up.
PixelModel AreaModel(double upscale);

// Schedule of the rays: one per pixel, then half as many per side as in the end, then all. The cheap model suffices
// early, and the last part removes its bias.
struct PixelSchedule {
  double upscale = 1;      // 1: the point model throughout
  double half_from = 0.6;  // fraction of the run after which half the rays per side are used …
  double all_from = 0.85;  // … and all of them
};

Status Validate(const PixelSchedule& schedule);  // kBadArgument

// The model after the fraction `done` of the run, 0–1.
PixelModel PixelModelAt(const PixelSchedule& schedule, double done);

// Rasterizer inputs for a model: options with its dilation and mode, and a camera with one pixel per ray.
RenderOptions RaysOf(const PixelModel& model, const RenderOptions& options);
Camera RaysOf(const PixelModel& model, const Camera& camera);

// Averages blocks of samples × samples values of `rays`, whose sides are multiples of it, into `averages`.
void AverageRays(const Image& rays, int samples, Image& averages);

// Transpose of AverageRays: each ray of a block gets 1/samples² of `averages`. Reads only `box` and writes only its
// rays. Returns the box of rays.
PixelBox SpreadToRays(const Image& averages, const PixelBox& box, int samples, Image& rays);

}  // namespace anchorsplat
