#pragma once

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "io/input_file.h"

namespace anchorsplat {

// A PLY point cloud, as from structure from motion or scanners.
struct PlyPoints {
  Buffer<double> positions;  // [M,3] world
  Buffer<float> colors;      // [M,3] rgb 0–1; grey if absent
};

// Reads x y z and, if all are present, red green blue of element "vertex": integers up to the largest of their type, or
// floats up to 1 or, judging by the values, 255 (color_range.h). Rows with a non-finite position are dropped. Errors
// (kBadFile): those of ReadPly; no x, y or z.
Result<PlyPoints> ReadPlyPoints(const InputFile& file, const ReadLimits& limits = {});

}  // namespace anchorsplat
