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

// The options of every verb that renders: from where, how large, on what background, in which mode.
struct ViewFlags {
  std::string cameras;             // file or folder; empty: an orbit
  int orbit = 0;                   // views on a sphere around the cloud
  double radius = 0;               // of the orbit, world units; 0: what frames the cloud
  std::string target;              // "X,Y,Z" the orbit looks at; empty: the cloud's middle
  double fov = 45;                 // horizontal, degrees, of the orbit
  std::string size;                // "WxH"; empty: the cameras' own, 1024x1024 for an orbit
  std::string background;          // "R,G,B"; empty: what the camera file says, else black
  std::string view;                // the only view wanted, by name; empty: all
  std::optional<RenderMode> mode;  // nothing: the file's tag, else classic
  std::string profile = "gsplat14";
  std::string up;  // "X,Y,Z" or an axis, of an orbit; empty: what the cameras or the file say, else −y
  std::optional<double> near_plane, far_plane;  // world units; nothing: what render/shown_range.h says

  void AddTo(CLI::App& verb);
};

// A splat to be looked at. Says how many of its Gaussians nobody draws (CountUnusable).
Result<GaussianCloud> ReadToShow(const std::string& path);
void WarnOfUnusable(const std::string& path, const GaussianCloud& cloud);

// The views to render, all or the one of --view. An orbit is laid around `cloud`, upright. `--size` must keep the
// cameras' aspect ratio. `given`: those of --cameras, where the caller has them. Errors name the option.
Result<CameraSet> MakeViews(const ViewFlags& flags, const CloudView& cloud, const CameraSet* given = nullptr);

// Mode (flags, else the file's tag, else classic), profile, background (flags, else the cameras', else black), and what
// is in range.
Result<RenderOptions> MakeRenderOptions(const ViewFlags& flags, const CloudView& cloud, const CameraSet& cameras);

// Colour over black divided by coverage: what a picture with an alpha channel stores.
Image WithAlpha(const RenderOutput& render);

}  // namespace anchorsplat
