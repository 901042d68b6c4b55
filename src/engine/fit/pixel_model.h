#pragma once

#include <string>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How a camera's pixel gets its value from a splat. Rasterizers sample: a pixel is what the ray through its centre
// meets, of Gaussians widened by d = 0.3 px² of that very pixel (DilationOf the render mode). Cameras average over the
// pixel's area. A splat that will be seen `upscale` times closer has to look right when its pictures at that resolution
// are averaged down to the pixels of its training views: that is the area model, upscale² rays for each pixel.
//
// Fewer rays, `samples`² of them, stand for that with wider Gaussians: each ray's share of the pixel holds upscale/
// samples of the closer view's pixels per side, which as a box has the variance (1 − (samples/upscale)²)/12 of its
// side. It is added to the dilation d·(samples/upscale)² that the closer view's pixels have at this size, and opacity
// is lowered so that every Gaussian keeps its integral. For one Gaussian that is right up to the shape of the box; for
// Gaussians that hide each other it is an approximation, much cheaper, and exact where samples = upscale.
struct PixelModel {
  int samples = 1;     // rays per pixel and side; 1 to upscale, rounded up
  double upscale = 1;  // ≥ 1; 1 with one sample is the point model of 3DGS

  bool IsPoint() const { return samples == 1 && upscale == 1; }
  friend bool operator==(const PixelModel&, const PixelModel&) = default;
};

inline constexpr int kMostSamples = 16;

// kBadArgument: an upscale below 1 or above kMostSamples, samples below 1 or above the upscale, rounded up.
Status Validate(const PixelModel& model);

// The model that renders all rays: samples = upscale, rounded up.
PixelModel AreaModel(double upscale);

// From few rays to all of them while an optimisation runs: one, then half as many per side as there will be, then all.
// Early on the cheap model is good enough, and the last part undoes its bias.
struct PixelSchedule {
  double upscale = 1;      // 1: the point model from beginning to end
  double half_from = 0.6;  // part of the run, 0 to 1, from which on half of the rays per side are rendered …
  double all_from = 0.85;  // … and all of them
};

Status Validate(const PixelSchedule& schedule);  // kBadArgument

// The model when the part `done` of the run, 0 to 1, is over.
PixelModel PixelModelAt(const PixelSchedule& schedule, double done);

// What a rasterizer has to do for the model: the options with another dilation and mode, and the camera with a pixel
// for every ray.
RenderOptions RaysOf(const PixelModel& model, const RenderOptions& options);
Camera RaysOf(const PixelModel& model, const Camera& camera);

// `averages` becomes the mean of each block of samples × samples values of `rays`, whose sides are multiples of it.
void AverageRays(const Image& rays, int samples, Image& averages);

// The transpose of it: every ray of a block gets 1/samples² of `averages`. Only `box` is read, and what belongs to it
// is written; the rest of `rays` stays as it is. Returns the box of rays.
PixelBox SpreadToRays(const Image& averages, const PixelBox& box, int samples, Image& rays);

}  // namespace anchorsplat
