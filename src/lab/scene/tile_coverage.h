#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Conservative test of which square tiles of a view the mesh may touch: those that meet the bounding box of a projected
// triangle. Rays are only sent there.
class TileCoverage {
 public:
  TileCoverage(const Mesh& mesh, const Camera& camera, int tile_size);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  bool touched(int column, int row) const {
    return marks_[static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column)] != 0;
  }

 private:
  int columns_ = 0;
  int rows_ = 0;
  std::vector<uint8_t> marks_;
};

}  // namespace anchorsplat
