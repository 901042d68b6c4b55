#include "fit/picture_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cameras/photograph.h"
#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int kMostCells = 16, kFewestCells = 4;  // along the longer side
constexpr double kPointsPerCell = 4;              // then 2 % of cells are empty by chance
constexpr float kSameColor = 6.0f / 255;          // tolerates noise, compression, a little dirt
constexpr double kFlatWithin = 0.05;  // fraction of a cell's pixels that may be brighter, and as many darker

bool IsSameColor(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  for (size_t c = 0; c < 3; ++c) {
    if (!(std::abs(a[c] - b[c]) <= kSameColor)) return false;
  }
  return true;
}

}  // namespace

PictureCells::PictureCells(const Camera& camera, std::span<const float> positions)
    : width_(camera.intrinsics.width), height_(camera.intrinsics.height) {
  const Pinhole& k = camera.intrinsics;
  std::vector<std::array<float, 2>> seen;
  for (size_t i = 0; i + 2 < positions.size(); i += 3) {
    const auto c = camera.ToCamera({positions[i], positions[i + 1], positions[i + 2]});
    if (!(c[2] > 0)) continue;
    const double x = k.fx * c[0] / c[2] + k.cx, y = k.fy * c[1] / c[2] + k.cy;
    if (x >= 0 && x < k.width && y >= 0 && y < k.height) {
      seen.push_back({static_cast<float>(x), static_cast<float>(y)});
    }
  }
  const auto fitting = static_cast<int>(std::sqrt(static_cast<double>(seen.size()) / kPointsPerCell));
  const int along = std::clamp(fitting, kFewestCells, kMostCells);
  side_ = std::max(1.0, static_cast<double>(std::max(width_, height_)) / along);
  columns_ = std::max(1, static_cast<int>(std::ceil(width_ / side_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(height_ / side_)));
  open_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 1);
  for (const auto& [x, y] : seen) Close(CellAt(x, y));
}

size_t PictureCells::CellAt(double x, double y) const {
  const int column = std::clamp(static_cast<int>(x / side_), 0, columns_ - 1);
  const int row = std::clamp(static_cast<int>(y / side_), 0, rows_ - 1);
  return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
}

PixelBox PictureCells::BoxOf(size_t cell) const {
  const int column = static_cast<int>(cell) % columns_, row = static_cast<int>(cell) / columns_;
  return {static_cast<int>(column * side_), static_cast<int>(row * side_),
          column + 1 == columns_ ? width_ : static_cast<int>((column + 1) * side_),
          row + 1 == rows_ ? height_ : static_cast<int>((row + 1) * side_)};
}

Status ReadCellPicture(const Camera& camera, const std::array<float, 3>& background, CellPicture& picture) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture read, ReadPhotograph(camera));
  const Pinhole& size = camera.intrinsics;
  if (read.image.width != size.width || read.image.height != size.height) {
    return Error{ErrorCode::kBadFile, Cat(camera.image.string(), ": ", read.image.width, "x", read.image.height,
                                          " pixels, expected ", size.width, "x", size.height)};
  }
  picture.image = std::move(read.image);
  picture.hidden = std::move(read.ignored);
  Image& image = picture.image;
  if (image.channels == 4) {
    if (picture.hidden.empty()) picture.hidden.assign(static_cast<size_t>(image.plane()), 0);
    for (int64_t i = 0; i < image.plane(); ++i) {
      const float alpha = image.channel(3)[i];
      if (!(alpha >= 0.5f)) picture.hidden[static_cast<size_t>(i)] = 1;
      for (int c = 0; c < 3; ++c) {
        float& value = image.channel(c)[i];
        value = value * alpha + background[static_cast<size_t>(c)] * (1 - alpha);
      }
    }
  }
  std::array<std::vector<float>, 3> values;
  for (size_t cell = 0; cell < picture.cells.size(); ++cell) {
    if (!picture.cells.IsOpen(cell)) continue;
    const PixelBox box = picture.cells.BoxOf(cell);
    for (auto& channel : values) channel.clear();
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        const auto at = static_cast<size_t>(int64_t{y} * image.width + x);
        if (!picture.hidden.empty() && picture.hidden[at] != 0) continue;
        for (int c = 0; c < 3; ++c) values[static_cast<size_t>(c)].push_back(image.channel(c)[at]);
      }
    }
    const int64_t pixels = int64_t{box.x1 - box.x0} * (box.y1 - box.y0);
    if (2 * std::ssize(values[0]) < pixels || values[0].empty()) {
      picture.cells.Close(cell);
      continue;
    }
    bool flat = true;
    std::array<float, 3> middle{};
    for (size_t c = 0; c < 3; ++c) {
      middle[c] = Quantile(values[c], 0.5);
      flat &= Quantile(values[c], 1 - kFlatWithin) - Quantile(values[c], kFlatWithin) <= kSameColor;
    }
    picture.open_colors.push_back(middle);
    if (flat) picture.flat.push_back({cell, middle});
  }
  return {};
}

void ClosePlainCells(const std::array<float, 3>& background, std::span<CellPicture> pictures) {
  std::array<float, 3> most{};
  for (size_t c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (const CellPicture& picture : pictures) {
      for (const auto& color : picture.open_colors) values.push_back(color[c]);
    }
    if (values.empty()) return;
    most[c] = Quantile(values, 0.5);
  }
  for (CellPicture& picture : pictures) {
    for (const auto& [cell, color] : picture.flat) {
      if (IsSameColor(color, background) || IsSameColor(color, most)) picture.cells.Close(cell);
    }
  }
}

double ShareOfOpenCells(std::span<const CellPicture> pictures) {
  // Pictures count equally, however fine their cells.
  double sum = 0;
  for (const CellPicture& picture : pictures) {
    int64_t open = 0;
    for (size_t cell = 0; cell < picture.cells.size(); ++cell) open += picture.cells.IsOpen(cell) ? 1 : 0;
    if (open > 0) sum += static_cast<double>(open) / static_cast<double>(picture.cells.size());
  }
  return pictures.empty() ? 0 : sum / static_cast<double>(pictures.size());
}

bool MeanColor(const CellPicture& picture, int x, int y, int half, std::array<float, 3>& color) {
  const Image& image = picture.image;
  std::array<double, 3> sum{};
  int64_t count = 0;
  for (int v = std::max(0, y - half); v <= std::min(image.height - 1, y + half); ++v) {
    for (int u = std::max(0, x - half); u <= std::min(image.width - 1, x + half); ++u) {
      if (!picture.hidden.empty() && picture.hidden[static_cast<size_t>(int64_t{v} * image.width + u)] != 0) continue;
      std::array<double, 3> pixel{};
      for (int c = 0; c < 3; ++c) pixel[static_cast<size_t>(c)] = image.at(c, v, u);
      if (!std::isfinite(pixel[0] + pixel[1] + pixel[2])) continue;
      for (size_t c = 0; c < 3; ++c) sum[c] += pixel[c];
      ++count;
    }
  }
  if (count == 0) return false;
  for (size_t c = 0; c < 3; ++c) color[c] = static_cast<float>(sum[c] / static_cast<double>(count));
  return true;
}

}  // namespace anchorsplat
