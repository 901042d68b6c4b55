#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Options of verbs that render: views, size, background, mode.
struct ViewFlags {
  std::string cameras;             // file or folder; empty: an orbit
  int orbit = 0;                   // views on a sphere around the cloud
  double radius = 0;               // of the orbit, world units; 0: frame the cloud
  std::string target;              // "X,Y,Z", centre of the orbit; empty: that of the cloud
  double fov = 45;                 // horizontal, degrees, of the orbit
  std::string size;                // "WxH"; empty: that of the cameras; orbit: 1024x1024
  std::string background;          // "R,G,B"; empty: from the camera file, else black
  std::string view;                // name of a single view; empty: all views
  std::optional<RenderMode> mode;  // unset: the file's tag, else classic
  std::string profile = "gsplat14";
  std::string up;  // of an orbit, "X,Y,Z" or an axis; empty: from the cameras, the file, else −y
  std::optional<double> near_plane, far_plane;  // world units; unset: as in render/shown_range.h

  void AddTo(CLI::App& verb);
};

// Reads a splat to render, with a warning about Gaussians that are not drawn (CountUnusable).
Result<GaussianCloud> ReadToShow(const std::string& path);
void WarnOfUnusable(const std::string& path, const GaussianCloud& cloud);

// The views to render: all, or that of --view. An orbit is upright around `cloud`. `--size` must keep the aspect ratio
// of the cameras. `given`: the cameras of --cameras, if already read. Errors name the option.
Result<CameraSet> MakeViews(const ViewFlags& flags, const CloudView& cloud, const CameraSet* given = nullptr);

// Mode (flags, else the file's tag, else classic), profile, background (flags, else the cameras', else black), near and
// far planes.
Result<RenderOptions> MakeRenderOptions(const ViewFlags& flags, const CloudView& cloud, const CameraSet& cameras);

// RGBA with colour over black divided by coverage (not premultiplied).
Image WithAlpha(const RenderOutput& render);

}  // namespace anchorsplat
