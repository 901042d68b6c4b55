#pragma once

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// A PLY of points, as structure from motion and scanners write them.
struct PlyPoints {
  Buffer<double> positions;  // [M,3] world
  Buffer<float> colors;      // [M,3] rgb 0–1; grey where the file has none
};

// Properties x y z and, where there are all three, red green blue of element "vertex": whole numbers from 0 to the
// largest of their type, or floats from 0 to 1 or, as their values show, 255 (color_range.h). Rows whose position is
// not finite are left out. Errors (kBadFile): as of ReadPly; no x, y or z.
Result<PlyPoints> ReadPlyPoints(const InputFile& file, const ReadLimits& limits = {});

}  // namespace anchorsplat
