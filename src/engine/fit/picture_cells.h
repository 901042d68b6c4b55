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

// A picture in coarse square cells, some of which are open: nothing known stands there (fit/far_shell.h).
class PictureCells {
 public:
  PictureCells() = default;

  // Open are those in which none of the points [M,3] lies. Cells are a 16th of the picture's longer side, or larger, up
  // to a quarter, so that the points in the picture are four to a cell on average.
  PictureCells(const Camera& camera, std::span<const float> positions);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  bool IsOpen(size_t cell) const { return open_[cell] != 0; }
  bool IsOpenAt(double x, double y) const { return IsOpen(CellAt(x, y)); }
  void Close(size_t cell) { open_[cell] = 0; }
  size_t size() const { return open_.size(); }
  // Its pixels, within the picture.
  PixelBox BoxOf(size_t cell) const;

 private:
  size_t CellAt(double x, double y) const;

  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
  double side_ = 1;  // pixels
  std::vector<uint8_t> open_;
};

// One of a set of pictures that are looked at one after the other.
struct LookedAtPicture {
  PictureCells cells;
  Image image;             // [3 or 4,H,W]; empty once it is forgotten
  Buffer<uint8_t> hidden;  // [H,W] 1 where there is nothing to see: masked or transparent; empty: nowhere
  // Of open cells that have one colour up to a few grey levels: which, and that colour.
  struct FlatCell {
    size_t cell;
    std::array<float, 3> color;
  };
  std::vector<FlatCell> flat;
  std::vector<std::array<float, 3>> open_colors;  // means of all open cells

  void Forget() { image = {}, hidden = {}; }
};

// Reads the camera's picture, closes those of its cells in which more than half of the pixels are hidden, and notes
// what is flat. Transparent pixels are laid over the background. Errors: those of ReadPhotograph; kBadFile when the
// picture has not its camera's size.
Status LookAtPicture(const Camera& camera, const std::array<float, 3>& background, LookedAtPicture& picture);

// Closes flat cells whose colour is the background's or that of the middle one of all open cells.
void ClosePlainCells(const std::array<float, 3>& background, std::span<LookedAtPicture> pictures);

// Of all cells; 0 where there are none.
double ShareOfOpenCells(std::span<const LookedAtPicture> pictures);

// Mean colour of the pixels around (x, y), up to `half` away in x and y, that are not hidden; false: there is none.
bool MeanColor(const LookedAtPicture& picture, int x, int y, int half, std::array<float, 3>& color);

}  // namespace anchorsplat
