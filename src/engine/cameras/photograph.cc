#include "cameras/photograph.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/text.h"
#include "images/image_io.h"
#include "images/orientation.h"

namespace anchorsplat {

namespace {

// Intrinsics of the image file, upright, before undistortion.
const Pinhole& IntrinsicsOfFile(const Camera& camera) {
  return camera.photograph.intrinsics.width > 0 ? camera.photograph.intrinsics : camera.intrinsics;
}

// Whether one size is a rescaled other: one side may be off by a pixel if the other matches exactly.
bool SameShape(int width, int height, int other_width, int other_height) {
  const double x = static_cast<double>(width) / other_width, y = static_cast<double>(height) / other_height;
  return std::abs(other_width * y - width) < 1 || std::abs(other_height * x - height) < 1;
}

Error BadPicture(const std::filesystem::path& file, const std::string& sentence) {
  return Error{ErrorCode::kBadFile, Cat(file.string(), ": ", sentence)};
}

// 1 where the mask is black, for an image of width × height pixels upright, stored with `orientation`.
Result<Buffer<uint8_t>> ReadIgnored(const std::filesystem::path& file, int width, int height, int orientation) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image mask, ReadImage(file));
  // A mask of the stored image's size is rotated with it.
  const bool stored = SwapsSides(orientation) ? SameShape(mask.height, mask.width, width, height) : orientation > 1;
  if (stored && !(SwapsSides(orientation) && SameShape(mask.width, mask.height, width, height))) {
    mask = Upright(std::move(mask), orientation);
  }
  if (!SameShape(mask.width, mask.height, width, height)) {
    return BadPicture(file, Cat("the mask has ", mask.width, "x", mask.height, " pixels, its picture ", width, "x",
                                height, ": the aspect ratios differ"));
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
  Pinhole distorted = IntrinsicsOfFile(camera);
  Photograph& photograph = camera.photograph;
  if (!SameShape(size.width, size.height, distorted.width, distorted.height)) {
    if (!SwapsSides(size.orientation) || !SameShape(size.height, size.width, distorted.width, distorted.height)) {
      return BadPicture(camera.image, Cat("the picture has ", size.width, "x", size.height, " pixels, its camera ",
                                          distorted.width, "x", distorted.height, ": the aspect ratios differ"));
    }
    photograph.orientation = size.orientation;
    std::swap(size.width, size.height);
  }
  if (size.width != distorted.width || size.height != distorted.height) {
    const double x = static_cast<double>(size.width) / distorted.width,
                 y = static_cast<double>(size.height) / distorted.height;
    distorted = {size.width, size.height, distorted.fx * x, distorted.fy * y, distorted.cx * x, distorted.cy * y};
  }
  auto undistorted = UndistortedPinhole(photograph.lens, distorted);
  if (!undistorted.ok()) return BadPicture(camera.image, undistorted.error().message);
  photograph.intrinsics = photograph.lens.IsIdentity() && downscale == 1 ? Pinhole{} : distorted;
  photograph.downscale = downscale;
  camera.intrinsics = downscale > 1 ? Downscaled(*undistorted, downscale) : *undistorted;
  if (camera.intrinsics.width < 1 || camera.intrinsics.height < 1) {
    return BadPicture(camera.image, Cat(undistorted->width, "x", undistorted->height,
                                        " pixels are too few to downscale by ", downscale));
  }
  return {};
}

Result<ViewPicture> ReadPhotograph(const Camera& camera) {
  const Photograph& photograph = camera.photograph;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ReadImage(camera.image));
  ViewPicture picture{Upright(std::move(image), photograph.orientation), {}};
  const Pinhole& distorted = IntrinsicsOfFile(camera);
  const int width = picture.image.width, height = picture.image.height;
  if (width != distorted.width || height != distorted.height) {
    return BadPicture(camera.image,
                      Cat(width, "x", height, " pixels, expected ", distorted.width, "x", distorted.height));
  }
  if (!photograph.mask.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(picture.ignored, ReadIgnored(photograph.mask, width, height, photograph.orientation));
  }
  if (!photograph.lens.IsIdentity()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Pinhole undistorted, UndistortedPinhole(photograph.lens, distorted));
    picture = Undistort(picture, photograph.lens, distorted, undistorted);
  }
  if (photograph.downscale > 1) picture = Downscaled(picture, photograph.downscale);
  return picture;
}

}  // namespace anchorsplat
