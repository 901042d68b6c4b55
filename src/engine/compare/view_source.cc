#include "compare/view_source.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "cameras/photograph.h"
#include "cameras/view_labels.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "images/image_io.h"
#include "images/orientation.h"
#include "images/picture_names.h"
#include "io/input_record.h"
#include "metrics/compare.h"
#include "metrics/image_metrics.h"
#include "render/constant_cloud.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

class SplatViewSource : public ViewSource {
 public:
  SplatViewSource(GaussianCloud cloud, CameraSet cameras, const RenderOptions& options)
      : cloud_(std::move(cloud)), cameras_(std::move(cameras)), options_(options) {
    for (const Camera& camera : cameras_.cameras) names_.push_back(camera.name);
  }
  const std::vector<std::string>& names() const override { return names_; }
  bool is_pictures() const override { return false; }
  Result<ImageSize> SizeOf(size_t view) const override {
    return ImageSize{cameras_.cameras[view].intrinsics.width, cameras_.cameras[view].intrinsics.height};
  }
  Result<Image> Load(size_t view) override {
    const Camera& camera = cameras_.cameras[view];
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(still_, camera, options_, output_));
    if (!warned_) {
      const std::string warning = EmptyPictureReason(cloud_, camera, options_, rasterizer_.statistics().visible);
      if (!warning.empty()) LogWarning(warning + " Set the range with --near and --far");
      warned_ = !warning.empty();
    }
    Image image = output_.color;
    Clamp01(image);
    return image;
  }
  std::vector<std::string> credits() const override { return CreditsOf(cloud_.comments); }
  void KeepOnly(size_t view) override {
    cameras_.cameras = {cameras_.cameras[view]};
    names_ = {names_[view]};
  }

 private:
  GaussianCloud cloud_;
  ConstantCloud still_{cloud_};
  CameraSet cameras_;
  RenderOptions options_;
  bool warned_ = false;  // of an empty view; once is enough
  Rasterizer rasterizer_;
  RenderOutput output_;
  std::vector<std::string> names_;
};

class ImageViews : public ViewSource {
 public:
  // A file and the camera it belongs to; a camera without pixels if unknown.
  struct View {
    fs::path file;
    Camera camera;
  };
  ImageViews(std::vector<View> views, const std::array<float, 3>& background)
      : views_(std::move(views)), background_(background) {
    for (const View& view : views_) names_.push_back(view.file.string());
  }
  const std::vector<std::string>& names() const override { return names_; }
  bool is_pictures() const override { return true; }
  Result<ImageSize> SizeOf(size_t view) const override {
    const Pinhole& k = views_[view].camera.intrinsics;
    if (k.width > 0) return ImageSize{k.width, k.height};
    ANCHORSPLAT_ASSIGN_OR_RETURN(ImageSize size, ReadImageSize(views_[view].file));
    if (SwapsSides(size.orientation)) std::swap(size.width, size.height);
    return size;
  }
  Result<Image> Load(size_t view) override {
    ignored_.clear();
    const View& wanted = views_[view];
    if (wanted.camera.intrinsics.width > 0) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture picture, ReadPhotograph(wanted.camera));
      ignored_ = std::move(picture.ignored);
      return CompositeOver(picture.image, background_);
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, ReadImageSize(wanted.file));
    ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ReadImage(wanted.file));
    return CompositeOver(Upright(std::move(image), size.orientation), background_);
  }
  const Buffer<uint8_t>& ignored() const override { return ignored_; }
  void KeepOnly(size_t view) override {
    views_ = {views_[view]};
    names_ = {names_[view]};
  }

 private:
  std::vector<View> views_;
  std::array<float, 3> background_;
  std::vector<std::string> names_;
  Buffer<uint8_t> ignored_;
};

// Canonical path of a file, however it was reached.
std::string PlaceOf(const fs::path& file) {
  std::error_code code;
  const fs::path place = fs::weakly_canonical(file, code);
  return code ? file.lexically_normal().string() : place.string();
}

// A folder's pictures, and those of the cameras in subfolders.
Result<std::vector<fs::path>> PicturesIn(const fs::path& folder, const CameraSet& cameras) {
  auto files = ListPictures(folder);
  const std::string inside = PlaceOf(folder) + "/";
  std::set<std::string> known;
  if (files.ok()) {
    for (const fs::path& file : *files) known.insert(PlaceOf(file));
  }
  std::vector<fs::path> deeper;
  for (const Camera& camera : cameras.cameras) {
    const std::string place = camera.image.empty() ? "" : PlaceOf(camera.image);
    if (place.starts_with(inside) && known.insert(place).second) deeper.push_back(camera.image);
  }
  if (deeper.empty()) return files;
  if (files.ok()) deeper.insert(deeper.end(), files->begin(), files->end());
  std::ranges::sort(deeper);
  return deeper;
}

}  // namespace

Result<size_t> FindView(const std::vector<std::string>& names, const std::string& name) {
  const std::vector<std::string> wanted = ViewParts(name);
  std::vector<size_t> same, found, last;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::vector<std::string> parts = ViewParts(names[i]);
    if (parts == wanted) same.push_back(i);
    const size_t shorter = std::min(parts.size(), wanted.size());
    if (shorter == 0) continue;
    if (std::equal(parts.end() - static_cast<ptrdiff_t>(shorter), parts.end(),
                   wanted.end() - static_cast<ptrdiff_t>(shorter))) {
      found.push_back(i);
    }
    if (parts.back() == wanted.back()) last.push_back(i);
  }
  if (same.size() == 1) return same[0];
  if (found.empty() && last.size() == 1 && ViewLabels(names)[last[0]] == wanted.back()) found = last;
  if (found.size() == 1) return found[0];
  std::vector<std::string> several;
  for (const size_t i : found) several.push_back(names[i]);
  return Error{ErrorCode::kBadArgument,
               found.empty() ? Cat("no view is called '", Printable(name), "' (there are ", names.size(),
                                   names.empty() ? "" : ", the first is " + names.front(), ")")
                             : Cat("several views are called '", Printable(name), "': ", FirstFew(several))};
}

std::unique_ptr<ViewSource> MakeSplatViews(GaussianCloud cloud, CameraSet cameras, const RenderOptions& options) {
  return std::make_unique<SplatViewSource>(std::move(cloud), std::move(cameras), options);
}

Result<std::unique_ptr<ViewSource>> OpenImageViews(const fs::path& path, const std::array<float, 3>& background,
                                                   const CameraSet& cameras) {
  std::vector<fs::path> files = {path};
  if (IsFolder(path)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(files, PicturesIn(path, cameras));
  } else if (!Exists(path)) {
    return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file or folder")};
  }
  std::map<std::string, const Camera*> owners;
  for (const Camera& camera : cameras.cameras) {
    if (!camera.image.empty()) owners[PlaceOf(camera.image)] = &camera;
  }
  std::vector<ImageViews::View> views;
  for (const fs::path& file : files) {
    RecordInput(file);
    ImageViews::View& view = views.emplace_back(ImageViews::View{file, {}});
    const auto owner = owners.find(PlaceOf(file));
    if (owner == owners.end()) continue;
    view.camera = *owner->second;
    ANCHORSPLAT_RETURN_IF_ERROR(MatchPhotograph(view.camera));
  }
  // Depth maps and the like beside pictures named by cameras are not views.
  const auto owned = [](const ImageViews::View& view) { return view.camera.intrinsics.width > 0; };
  const auto strangers = static_cast<size_t>(std::ranges::count_if(views, std::not_fn(owned)));
  if (strangers > 0 && strangers < views.size()) {
    // Pictures beside the cameras' own were already reported when these were opened.
    std::set<fs::path> folders;
    for (const auto& [place, camera] : owners) folders.insert(fs::path(place).parent_path());
    const auto elsewhere = std::ranges::count_if(views, [&](const ImageViews::View& view) {
      return !owned(view) && !folders.contains(fs::path(PlaceOf(view.file)).parent_path());
    });
    if (elsewhere > 0) {
      LogInfo(Cat(path.string(), ": ", elsewhere, " of ", views.size(),
                  " pictures are in folders without pictures of the cameras, and are not used"));
    }
    std::erase_if(views, std::not_fn(owned));
  }
  return std::unique_ptr<ViewSource>(std::make_unique<ImageViews>(std::move(views), background));
}

bool LooksLikeImages(const fs::path& path) { return HasPictureExtension(path) || IsFolder(path); }

}  // namespace anchorsplat
