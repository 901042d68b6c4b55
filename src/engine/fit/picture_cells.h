#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// A picture in coarse square cells. Open cells have no known geometry (fit/far_shell.h).
class PictureCells {
 public:
  PictureCells() = default;

  // Cells without any of the points [M,3] are open. Cell side: 1/16 of the picture's longer side, or larger, up to 1/4,
  // so that the picture has four points per cell on average.
  PictureCells(const Camera& camera, std::span<const float> positions);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  bool IsOpen(size_t cell) const { return open_[cell] != 0; }
  bool IsOpenAt(double x, double y) const { return IsOpen(CellAt(x, y)); }
  void Close(size_t cell) { open_[cell] = 0; }
  size_t size() const { return open_.size(); }
  // Pixels of a cell, within the picture.
  PixelBox BoxOf(size_t cell) const;

 private:
  size_t CellAt(double x, double y) const;

  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
  double side_ = 1;  // pixels
  std::vector<uint8_t> open_;
};

// A picture of a set that is examined one by one.
struct CellPicture {
  PictureCells cells;
  Image image;             // [3 or 4,H,W]; empty after Forget
  Buffer<uint8_t> hidden;  // [H,W] 1 = masked or transparent; empty: none
  // An open cell of uniform colour (up to a few grey levels).
  struct FlatCell {
    size_t cell;
    std::array<float, 3> color;
  };
  std::vector<FlatCell> flat;
  std::vector<std::array<float, 3>> open_colors;  // means of all open cells

  void Forget() { image = {}, hidden = {}; }
};

// Reads the camera's picture, closes cells with more than half of their pixels hidden, and records flat cells.
// Composites alpha over the background. Errors: those of ReadPhotograph; kBadFile if the picture's size is not its
// camera's.
Status ReadCellPicture(const Camera& camera, const std::array<float, 3>& background, CellPicture& picture);

// Closes flat cells whose colour is the background's or the median of all open cells.
void ClosePlainCells(const std::array<float, 3>& background, std::span<CellPicture> pictures);

// Relative to all cells; 0 without cells.
double ShareOfOpenCells(std::span<const CellPicture> pictures);

// Mean colour of visible pixels within `half` of (x, y) in x and y; false if there are none.
bool MeanColor(const CellPicture& picture, int x, int y, int half, std::array<float, 3>& color);

}  // namespace anchorsplat
