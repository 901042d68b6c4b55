#include <anchorsplat/compare.h>
#include <anchorsplat/picture.h>

#include <vector>

#include "api/bridge.h"
#include "images/image_io.h"
#include "metrics/image_metrics.h"
#include "metrics/side_by_side.h"

namespace anchorsplat {

namespace {

// A measure of two pictures.
Expected<double> Measure(const Picture& a, const Picture& b, const RunSettings& run,
                         Result<double> (*measure)(const Image&, const Image&)) {
  return InRun<double>(run, [&]() -> Result<double> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image left, ToImage(a));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image right, ToImage(b));
    return measure(left, right);
  });
}

}  // namespace

Expected<Picture> ReadPicture(const std::filesystem::path& path) {
  return InRun<Picture>({}, [&]() -> Result<Picture> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, ReadImage(path));
    return ToPicture(image);
  });
}

Expected<void> WritePicture(const std::filesystem::path& path, const Picture& picture, bool overwrite) {
  return InRun<void>({}, [&]() -> Status {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, ToImage(picture));
    return WritePng(path, image, {.overwrite = overwrite});
  });
}

Expected<double> Psnr(const Picture& a, const Picture& b, const RunSettings& run) { return Measure(a, b, run, &Psnr); }
Expected<double> Ssim(const Picture& a, const Picture& b, const RunSettings& run) { return Measure(a, b, run, &Ssim); }

Expected<Picture> ComparisonSheet(std::span<const CaptionedPicture> pictures, const RunSettings& run) {
  return InRun<Picture>(run, [&]() -> Result<Picture> {
    std::vector<Image> images;
    for (const CaptionedPicture& captioned : pictures) {
      if (captioned.picture == nullptr) return Error{ErrorCode::kBadArgument, "a caption without its picture"};
      ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ToImage(*captioned.picture));
      images.push_back(std::move(image));
    }
    std::vector<LabelledImage> labelled;
    for (size_t i = 0; i < images.size(); ++i) labelled.push_back({pictures[i].caption, "", &images[i]});
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image sheet, SideBySide(labelled));
    return ToPicture(sheet);
  });
}

}  // namespace anchorsplat
