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

// One side of a comparison: named pictures, rendered or read when asked for, so that a hundred views need the memory
// of one.
class ViewSource {
 public:
  virtual ~ViewSource() = default;
  // Of the views, in the order of the cameras or sorted by file name: camera names or paths of pictures.
  virtual const std::vector<std::string>& names() const = 0;
  virtual bool is_pictures() const = 0;                     // files, not renders
  virtual Result<ImageSize> SizeOf(size_t view) const = 0;  // without rendering or decoding
  // Three channels in 0–1: renders are clamped and not quantised, files are byte/255 over the background.
  virtual Result<Image> Load(size_t view) = 0;
  // Of the view that was loaded last: [H,W], 1 where a mask or a lens leaves nothing to compare; empty for nowhere.
  virtual const Buffer<uint8_t>& ignored() const {
    static const Buffer<uint8_t> nowhere;
    return nowhere;
  }
  // Whose what is shown is, as far as its file says so (core/splat_comments.h).
  virtual std::vector<std::string> credits() const { return {}; }
  // Forgets all views but this one.
  virtual void KeepOnly(size_t view) = 0;
};

// The view called `name`: with its folders and extension or as much of their end as tells it from the others. Where the
// last part alone does that, other folders before it do not matter. kBadArgument when there is none, or several.
Result<size_t> FindView(const std::vector<std::string>& names, const std::string& name);

// Renders `cloud` through `cameras`; warns of the first view with nothing in it (render/shown_range.h).
std::unique_ptr<ViewSource> MakeSplatViews(GaussianCloud cloud, CameraSet cameras, const RenderOptions& options);

// A folder of pictures, or a single one (ListPictures in metrics/compare.h says which). Those that are the files of
// `cameras`' own pictures come as these cameras see them: without the lens, with their masks (cameras/photograph.h);
// others upright as their EXIF says. Errors: kNotFound, kBadFile (no pictures in the folder); those of MatchPhotograph.
Result<std::unique_ptr<ViewSource>> OpenImageViews(const std::filesystem::path& path,
                                                   const std::array<float, 3>& background,
                                                   const CameraSet& cameras = {});

// True for a folder and for a file with the extension of a picture that can be read: what OpenImageViews takes.
bool LooksLikeImages(const std::filesystem::path& path);

}  // namespace anchorsplat
