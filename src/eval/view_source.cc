#include "eval/view_source.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "cameras/camera_checks.h"
#include "core/credit.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "images/image_io.h"
#include "io/input_record.h"
#include "metrics/compare.h"
#include "metrics/image_metrics.h"
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
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud_, camera, options_, output_));
    if (!warned_) {
      const std::string warning = NothingToSee(cloud_, camera, options_, rasterizer_.statistics().visible);
      if (!warning.empty()) LogWarning(warning + " --near and --far say what is in range");
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
  CameraSet cameras_;
  RenderOptions options_;
  bool warned_ = false;  // of a view with nothing in it: one is enough
  Rasterizer rasterizer_;
  RenderOutput output_;
  std::vector<std::string> names_;
};

class ImageViews : public ViewSource {
 public:
  ImageViews(std::vector<fs::path> files, const std::array<float, 3>& background)
      : files_(std::move(files)), background_(background) {
    for (const fs::path& file : files_) names_.push_back(file.string());
  }
  const std::vector<std::string>& names() const override { return names_; }
  bool is_pictures() const override { return true; }
  Result<ImageSize> SizeOf(size_t view) const override { return ReadImageSize(files_[view]); }
  Result<Image> Load(size_t view) override {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, ReadImage(files_[view]));
    return CompositeOver(image, background_);
  }
  void KeepOnly(size_t view) override {
    files_ = {files_[view]};
    names_ = {names_[view]};
  }

 private:
  std::vector<fs::path> files_;
  std::array<float, 3> background_;
  std::vector<std::string> names_;
};

}  // namespace

std::string ViewLabel(const std::string& name) { return fs::path(ViewName(name)).filename().string(); }

Result<size_t> FindView(const std::vector<std::string>& names, const std::string& name) {
  std::vector<size_t> found;
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name || ViewLabel(names[i]) == ViewLabel(name)) found.push_back(i);
  }
  if (found.size() == 1) return found[0];
  return Error{ErrorCode::kBadArgument,
               Cat(found.empty() ? "no view is called '" : "several views are called '", Printable(name),
                   "' (there are ", names.size(), names.empty() ? "" : ", the first is " + names.front(), ")")};
}

std::unique_ptr<ViewSource> MakeSplatViews(GaussianCloud cloud, CameraSet cameras, const RenderOptions& options) {
  return std::make_unique<SplatViewSource>(std::move(cloud), std::move(cameras), options);
}

Result<std::unique_ptr<ViewSource>> OpenImageViews(const fs::path& path, const std::array<float, 3>& background) {
  std::vector<fs::path> files = {path};
  if (IsFolder(path)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(files, ListPictures(path));
  } else if (!Exists(path)) {
    return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file or folder")};
  }
  for (const fs::path& file : files) RecordInput(file);
  return std::unique_ptr<ViewSource>(std::make_unique<ImageViews>(std::move(files), background));
}

bool LooksLikeImages(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".png" || extension == ".jpg" || extension == ".jpeg") return true;
  return IsFolder(path);
}

}  // namespace anchorsplat
