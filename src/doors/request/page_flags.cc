#include "request/page_flags.h"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/picture_folder.h"
#include "cameras/view_labels.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "io/input_record.h"
#include "reading/reading.h"
#include "render/shown_range.h"
#include "request/choice.h"
#include "request/mode_option.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// The picture of a camera in the folder, by the view's name ("cam0/0000"); empty: none.
Result<fs::path> FindPictureOf(const fs::path& folder, const Camera& camera, const std::string& label) {
  const fs::path place = (folder / label).parent_path();
  const PictureFolder pictures(place);
  for (const std::string& name : {camera.image.filename().string(), fs::path(label).filename().string()}) {
    if (name.empty()) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string file, pictures.Find(name));
    if (file.empty()) continue;
    RecordInput(place / file);
    return place / file;
  }
  return fs::path();
}

// At most `--views` cameras, evenly chosen; with --truth only those with a picture there.
Result<std::vector<ViewerView>> ChooseViews(const PageFlags& flags, const CameraSet& cameras) {
  std::vector<ViewerView> all;
  std::vector<std::string> names;
  for (const Camera& camera : cameras.cameras) names.push_back(camera.name);
  const std::vector<std::string> labels = ViewLabels(names);
  for (size_t i = 0; i < labels.size(); ++i) {
    const Camera& camera = cameras.cameras[i];
    ViewerView view{camera, {}};
    if (!flags.truth.empty()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const fs::path picture, FindPictureOf(flags.truth, camera, labels[i]));
      if (picture.empty()) continue;
      if (!camera.photograph.lens.IsIdentity()) {
        return Error{
            ErrorCode::kBadArgument,
            Cat("--truth: the pictures of ", flags.cameras,
                " have lens distortion, which the page cannot show; pass undistorted pictures and their cameras")};
      }
      view.picture = picture;
    }
    all.push_back(std::move(view));
  }
  if (all.empty() && !flags.truth.empty()) {
    return Error{ErrorCode::kNotFound, Cat(flags.truth, ": no picture is named as a camera in ", flags.cameras)};
  }
  const size_t count = std::min(all.size(), static_cast<size_t>(flags.views));
  std::vector<ViewerView> chosen;
  for (size_t k = 0; k < count; ++k) chosen.push_back(all[k * all.size() / count]);
  return chosen;
}

}  // namespace

void PageFlags::AddTo(CLI::App& verb) {
  auto* cameras_option =
      verb.add_option("--cameras", cameras, "Views to jump to; the page opens at the first")->type_name("PATH");
  verb.add_option("--truth", truth, "Folder of ground-truth pictures, named as the cameras")
      ->type_name("FOLDER")
      ->needs(cameras_option);
  verb.add_option("--views", views, "Most cameras to use, evenly chosen")
      ->check(AtLeastOne())
      ->capture_default_str()
      ->needs(cameras_option);
  verb.add_option("--pixel-size", pixel_size,
                  "World size of a training pixel, for the scale bar; auto: estimate it from --before")
      ->type_name("LENGTH")
      ->capture_default_str();
  verb.add_option("--sh-degree", sh_degree, "Highest degree of spherical harmonics to keep; 0 makes small pages")
      ->check(CLI::Range(0, kMaxShDegree))
      ->capture_default_str();
  AddModeOption(verb, mode, "Rasterization of both splats (default: each file's tag, else classic)");
  verb.add_option("--background", background, "R,G,B from 0 to 1 (default: from the camera file, else black)")
      ->type_name("R,G,B");
  verb.add_option("--open-your-own", open_your_own,
                  "Add a button to open another splat, in the hosted page at this address (make web)")
      ->type_name("URL");
  verb.add_option("--title", title, "Heading of the page (default: the file name)")->type_name("TITLE");
}

Result<ViewerPage> MakePage(const PageFlags& flags, const CameraSet* given) {
  if (!flags.truth.empty() && !IsFolder(flags.truth)) {
    return Error{ErrorCode::kNotFound, Cat("--truth: ", flags.truth, ": no such folder")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto pixel_size, ParsePixelSize("--pixel-size", flags.pixel_size));
  CameraSet cameras;
  if (given != nullptr) {
    cameras = *given;
  } else if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, ReadCameras(flags.cameras));
  }
  ViewerPage page;
  if (pixel_size) page.pixel_size = static_cast<float>(*pixel_size);
  page.title = flags.title;
  page.own_page = flags.open_your_own;
  page.max_sh_degree = flags.sh_degree;
  page.smaller = "drop view-dependent colour (--sh-degree 0), --before or --truth, or show part of the scene";
  ANCHORSPLAT_ASSIGN_OR_RETURN(page.views, ChooseViews(flags, cameras));
  if (cameras.background) page.background = *cameras.background;
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(page.background, ParseColor("--background", flags.background));
  }
  return page;
}

void LookAtSplats(ViewerPage& page) {
  if (!page.views.empty()) {  // the page opens at the first
    const GaussianCloud& after = *page.after.cloud;
    const std::string warning =
        EmptyPictureReason(after, page.views.front().camera, DisplayOptions(after), std::nullopt);
    if (!warning.empty()) LogWarning(warning);
  }
  if (page.pixel_size || !page.before) return;
  // From the trained splat, which gives a better estimate than the result. Without an estimate there is no scale bar.
  if (const auto reading = Read(*page.before->cloud); reading.ok()) {
    page.pixel_size = static_cast<float>(reading->pixel);
  }
}

}  // namespace anchorsplat
