#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Whether a file with these first bytes is a camera XML exported by Agisoft Metashape (formerly PhotoScan).
bool LooksLikeMetashape(std::string_view head);

// Reads cameras of Metashape (File > Export > Export Cameras, Agisoft XML): enabled and aligned cameras in file order;
// a message counts the others. Their world is the target of the transform (rotation, translation, scale) of their
// component, else of their chunk, like that of Metashape's COLMAP export and of point clouds in local chunk
// coordinates. Of several chunks, and of components without a transform, those with the most cameras are taken; a
// message names the others.
//
// A camera's label is its image name, with or without extension. Images are searched in `images` of `folder`, in
// `folder` and in `images` beside it. The adjusted calibration of a sensor takes precedence over the initial one:
//
//   x' = x·(1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸) + p1·(r² + 2x²) + 2·p2·x·y,   y' alike with p1 and p2 exchanged
//   u = w/2 + cx + x'·(f + b1) + y'·b2,   v = h/2 + cy + y'·f          (Metashape's manual, appendix Camera models)
//
// with (x, y) the point at depth 1; for a fisheye, scaled to the radius of its angle.
//
// Errors (kBadFile with the line): not XML; more than 256 MiB, 2^23 elements and attributes, or 64 nested groups; an
// invalid number, size or rotation; a sensor that is neither frame nor fisheye (named); p1 … p4 of an unsupported lens;
// no aligned camera.
Result<CameraSet> CamerasFromMetashape(const std::string& name, std::string_view bytes,
                                       const std::filesystem::path& folder);

}  // namespace anchorsplat
