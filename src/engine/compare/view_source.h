#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "images/image_io.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// One side of a comparison: named pictures, rendered or read on demand, so that only one view is in memory.
class ViewSource {
 public:
  virtual ~ViewSource() = default;
  // Names in camera order or sorted by file name: camera names or picture paths.
  virtual const std::vector<std::string>& names() const = 0;
  virtual bool is_pictures() const = 0;                     // files, not renders
  virtual Result<ImageSize> SizeOf(size_t view) const = 0;  // without rendering or decoding
  // Three channels in 0–1: renders are clamped, not quantised; files are byte/255 over the background.
  virtual Result<Image> Load(size_t view) = 0;
  // Mask of the view loaded last: [H,W], 1 where a mask or a lens leaves nothing to compare; empty: nowhere.
  virtual const Buffer<uint8_t>& ignored() const {
    static const Buffer<uint8_t> nowhere;
    return nowhere;
  }
  // Credits stated in the splat's file (core/splat_comments.h).
  virtual std::vector<std::string> credits() const { return {}; }
  // Drops all views but this one.
  virtual void KeepOnly(size_t view) = 0;
};

// Finds the view called `name`: its full path, or enough of its end to be unique. If the file name alone is unique,
// different folders before it do not matter. kBadArgument: none, or several.
Result<size_t> FindView(const std::vector<std::string>& names, const std::string& name);

// Renders `cloud` through `cameras`; warns of the first empty view (render/shown_range.h).
std::unique_ptr<ViewSource> MakeSplatViews(GaussianCloud cloud, CameraSet cameras, const RenderOptions& options);

// Opens a folder of pictures or a single one (ListPictures in metrics/compare.h). Files that are `cameras`' own
// pictures are shown as these cameras see them: undistorted and masked (cameras/photograph.h); others are only rotated
// as their EXIF says. Errors: kNotFound; kBadFile: a folder without pictures; those of MatchPhotograph.
Result<std::unique_ptr<ViewSource>> OpenImageViews(const std::filesystem::path& path,
                                                   const std::array<float, 3>& background,
                                                   const CameraSet& cameras = {});

// Whether OpenImageViews applies: a folder, or a file with a readable picture's extension.
bool LooksLikeImages(const std::filesystem::path& path);

}  // namespace anchorsplat
