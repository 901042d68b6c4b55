#include "cameras/photograph.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/text.h"
#include "images/image_io.h"
#include "images/orientation.h"

namespace anchorsplat {

namespace {

// Of the picture in the file, upright, behind the lens.
const Pinhole& Bent(const Camera& camera) {
  return camera.photograph.intrinsics.width > 0 ? camera.photograph.intrinsics : camera.intrinsics;
}

// Whether a picture of that size is a scaled one of the other: one side agrees to a pixel when the other does exactly.
bool SameShape(int width, int height, int other_width, int other_height) {
  const double x = static_cast<double>(width) / other_width, y = static_cast<double>(height) / other_height;
  return std::abs(other_width * y - width) < 1 || std::abs(other_height * x - height) < 1;
}

Error BadPicture(const std::filesystem::path& file, const std::string& sentence) {
  return Error{ErrorCode::kBadFile, Cat(file.string(), ": ", sentence)};
}

// 1 where the mask is black, of a picture of width × height pixels upright, whose file is turned by `orientation`.
Result<Buffer<uint8_t>> ReadIgnored(const std::filesystem::path& file, int width, int height, int orientation) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image mask, ReadImage(file));
  // A mask that was drawn over the stored picture lies as that does.
  const bool stored = SwapsSides(orientation) ? SameShape(mask.height, mask.width, width, height) : orientation > 1;
  if (stored && !(SwapsSides(orientation) && SameShape(mask.width, mask.height, width, height))) {
    mask = Upright(std::move(mask), orientation);
  }
  if (!SameShape(mask.width, mask.height, width, height)) {
    return BadPicture(file, Cat("the mask has ", mask.width, "x", mask.height, " pixels, its picture ", width, "x",
                                height, ", which is another shape"));
  }
  Buffer<uint8_t> ignored(static_cast<size_t>(int64_t{width} * height));
  bool any = false;
  for (int y = 0; y < height; ++y) {
    const int row = static_cast<int>((2 * int64_t{y} + 1) * mask.height / (2 * int64_t{height}));
    for (int x = 0; x < width; ++x) {
      const int column = static_cast<int>((2 * int64_t{x} + 1) * mask.width / (2 * int64_t{width}));
      float shown = 0;
      for (int c = 0; c < 3; ++c) shown += mask.at(c, row, column) / 3;
      if (mask.channels == 4) shown *= mask.at(3, row, column);
      const bool black = shown < 0.5f;
      any |= black;
      ignored[static_cast<size_t>(int64_t{y} * width + x)] = black;
    }
  }
  if (!any) ignored.clear();
  return ignored;
}

}  // namespace

Status MatchPhotograph(Camera& camera, int downscale) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImageSize size, ReadImageSize(camera.image));
  Pinhole bent = Bent(camera);
  Photograph& photograph = camera.photograph;
  if (!SameShape(size.width, size.height, bent.width, bent.height)) {
    if (!SwapsSides(size.orientation) || !SameShape(size.height, size.width, bent.width, bent.height)) {
      return BadPicture(camera.image, Cat("the picture has ", size.width, "x", size.height, " pixels, its camera ",
                                          bent.width, "x", bent.height, ", which is another shape"));
    }
    photograph.orientation = size.orientation;
    std::swap(size.width, size.height);
  }
  if (size.width != bent.width || size.height != bent.height) {
    const double x = static_cast<double>(size.width) / bent.width, y = static_cast<double>(size.height) / bent.height;
    bent = {size.width, size.height, bent.fx * x, bent.fy * y, bent.cx * x, bent.cy * y};
  }
  auto straight = StraightPinhole(photograph.lens, bent);
  if (!straight.ok()) return BadPicture(camera.image, straight.error().message);
  photograph.intrinsics = photograph.lens.IsStraight() && downscale == 1 ? Pinhole{} : bent;
  photograph.downscale = downscale;
  camera.intrinsics = downscale > 1 ? Downscaled(*straight, downscale) : *straight;
  if (camera.intrinsics.width < 1 || camera.intrinsics.height < 1) {
    return BadPicture(camera.image, Cat("nothing is left of ", straight->width, "x", straight->height, " pixels at 1/",
                                        downscale, " of them per side"));
  }
  return {};
}

Result<ViewPicture> ReadPhotograph(const Camera& camera) {
  const Photograph& photograph = camera.photograph;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ReadImage(camera.image));
  ViewPicture picture{Upright(std::move(image), photograph.orientation), {}};
  const Pinhole& bent = Bent(camera);
  const int width = picture.image.width, height = picture.image.height;
  if (width != bent.width || height != bent.height) {
    return BadPicture(camera.image, Cat(width, "x", height, " pixels, expected ", bent.width, "x", bent.height));
  }
  if (!photograph.mask.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(picture.ignored, ReadIgnored(photograph.mask, width, height, photograph.orientation));
  }
  if (!photograph.lens.IsStraight()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Pinhole straight, StraightPinhole(photograph.lens, bent));
    picture = Undistort(picture, photograph.lens, bent, straight);
  }
  if (photograph.downscale > 1) picture = Downscaled(picture, photograph.downscale);
  return picture;
}

}  // namespace anchorsplat
