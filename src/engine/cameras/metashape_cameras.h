#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Whether these first bytes of a file are those of the XML that Agisoft Metashape (once PhotoScan) exports cameras as.
bool LooksLikeMetashape(std::string_view head);

// Cameras of Metashape: File > Export > Export Cameras, Agisoft XML. Enabled cameras that are aligned, in the order of
// the file; the others are counted in a message. They stand in the world that the transform of their component, else of
// their chunk, leads to (rotation, translation and scale), which is where Metashape's own COLMAP export and the point
// clouds of a chunk in local coordinates are. Of several chunks, and of components that no transform places, those with
// the most cameras are taken; a message names the others.
//
// A camera's label is its picture's name, with or without extension; pictures are looked for in `images` of `folder`,
// in `folder` and in `images` beside it. The adjusted calibration of a sensor wins over the initial one:
//
//   x' = x·(1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸) + p1·(r² + 2x²) + 2·p2·x·y,   y' alike with p1 and p2 exchanged
//   u = w/2 + cx + x'·(f + b1) + y'·b2,   v = h/2 + cy + y'·f          (Metashape's manual, appendix Camera models)
//
// where (x, y) is the point at depth 1, and for a fisheye that point brought to the radius of its angle.
//
// Errors (kBadFile with the line): not XML, more than 256 MiB or 2^23 marks, groups nested deeper than 64, a number,
// size or rotation that is none, a sensor that is neither frame nor fisheye (by its name), p1 … p4 of no lens known
// here, no aligned camera.
Result<CameraSet> CamerasFromMetashape(const std::string& name, std::string_view bytes,
                                       const std::filesystem::path& folder);

}  // namespace anchorsplat
