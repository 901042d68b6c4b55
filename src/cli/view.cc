#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cameras/camera_io.h"
#include "cli/clean_output.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/pixel_size_guard.h"
#include "formats/opened_splat.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "render/shown_range.h"
#include "request/choice.h"
#include "request/mode_option.h"
#include "request/parse.h"
#include "request/views.h"
#include "viewer/page_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct PageFlags {
  std::string after;
  std::string before;
  std::string truth;
  std::string cameras;
  std::string output;
  std::string title;
  std::string background;
  std::string pixel_size = "auto";
  int views = 10;
  int sh_degree = kMaxShDegree;
  std::optional<RenderMode> mode;  // in place of the files' tags
};

// The picture of a camera in the folder: by name, whatever the folder the camera file has it in.
std::optional<fs::path> FindPicture(const fs::path& folder, const Camera& camera) {
  for (const fs::path& name : {camera.image, fs::path(camera.name)}) {
    const std::string stem = name.stem().string();
    if (stem.empty()) continue;
    for (const char* extension : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"}) {
      fs::path path = folder / (stem + extension);
      if (!IsFile(path)) continue;
      RecordInput(path);
      return path;
    }
  }
  return std::nullopt;
}

// At most `--views` of the cameras, evenly over their order; with --truth only those that have a picture there.
Result<std::vector<ViewerView>> ChooseViews(const PageFlags& flags, const CameraSet& cameras) {
  std::vector<ViewerView> all;
  for (const Camera& camera : cameras.cameras) {
    ViewerView view{camera, {}};
    if (!flags.truth.empty()) {
      const auto picture = FindPicture(flags.truth, camera);
      if (!picture) continue;
      view.picture = *picture;
    }
    all.push_back(std::move(view));
  }
  if (all.empty() && !flags.truth.empty()) {
    return Error{ErrorCode::kNotFound,
                 Cat(flags.truth, ": no PNG or JPEG has the name of a camera in ", flags.cameras)};
  }
  const size_t count = std::min(all.size(), static_cast<size_t>(flags.views));
  std::vector<ViewerView> chosen;
  for (size_t k = 0; k < count; ++k) chosen.push_back(all[k * all.size() / count]);
  return chosen;
}

std::optional<uint64_t> FileBytes(const std::string& path) {
  std::error_code failed;
  const uint64_t bytes = fs::file_size(path, failed);
  if (failed) return std::nullopt;
  return bytes;
}

struct Shown {
  GaussianCloud cloud;
  std::string name;
  uint64_t bytes = 0;
};

// A splat to show: a file with nothing to see in it is a bad one.
Result<Shown> ReadShown(const fs::path& path, const std::optional<RenderMode>& mode) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(path));
  // "scan/" is called scan.
  const fs::path named = path.has_filename() ? path : path.parent_path();
  Shown shown{{}, named.filename().string(), file.bytes()};
  ANCHORSPLAT_ASSIGN_OR_RETURN(shown.cloud, file.Read());
  if (mode) shown.cloud.render_mode = mode;
  if (CountUnusable(shown.cloud) < shown.cloud.size()) {
    WarnOfUnusable(path.string(), shown.cloud);
    return shown;
  }
  return Error{ErrorCode::kBadFile, Cat(path.string(), ": there is nothing to show: all of its ",
                                        WithThousands(shown.cloud.size()), " Gaussians have NaN or infinite values")};
}

// A page written over a splat by a slip of the keyboard would be a loss.
bool IsPageName(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".html" || extension == ".htm";
}

Status RunView(const PageFlags& flags, const SharedFlags& shared) {
  if (!IsPageName(flags.output)) {
    return Error{ErrorCode::kBadArgument, Cat("--output: ", flags.output, " is no name for a page, expected .html")};
  }
  if (!flags.truth.empty() && !IsFolder(flags.truth)) {
    return Error{ErrorCode::kNotFound, Cat("--truth: ", flags.truth, ": no such folder")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(flags.output, shared.overwrite));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto pixel_size, ParsePixelSize("--pixel-size", flags.pixel_size));
  CameraSet cameras;
  if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, ReadCameras(flags.cameras));
  }
  ViewerPage page;
  page.title = flags.title;
  page.max_sh_degree = flags.sh_degree;
  page.smaller =
      "leave out view-dependent colour (--sh-degree 0), --before or the true pictures, or show a part of the scene";
  ANCHORSPLAT_ASSIGN_OR_RETURN(page.views, ChooseViews(flags, cameras));
  if (cameras.background) page.background = *cameras.background;
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(page.background, ParseColor("--background", flags.background));
  }

  ANCHORSPLAT_ASSIGN_OR_RETURN(const Shown after, ReadShown(flags.after, flags.mode));
  page.after = {&after.cloud, after.name, after.bytes};
  if (!page.views.empty()) {  // the first is where the page opens
    const std::string warning =
        NothingToSee(after.cloud, page.views.front().camera, OptionsFor(after.cloud), std::nullopt);
    if (!warning.empty()) LogWarning(warning);
  }
  Shown before;
  if (!flags.before.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(before, ReadShown(flags.before, flags.mode));
    page.before = ViewerSplat{&before.cloud, before.name, before.bytes};
  }
  if (pixel_size) {
    page.pixel_size = static_cast<float>(*pixel_size);
  } else if (page.before) {
    // Of what was trained; what came out of it says less. A splat with too little to say gets no scale bar.
    if (const auto found = FindPixelSize(before.cloud); found.ok() && !found->contradicted()) {
      page.pixel_size = static_cast<float>(found->size);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WriteViewerPage(flags.output, page, WriteOptionsFrom(shared)));

  const uint64_t bytes = FileBytes(flags.output).value_or(0);
  if (shared.json) {
    PrintJson({{"output", flags.output},
               {"bytes", bytes},
               {"views", page.views.size()},
               {"pixel_size", page.pixel_size ? nlohmann::json(*page.pixel_size) : nlohmann::json()}});
  } else if (!shared.quiet) {
    std::cout << OneLine(flags.output) << ": " << HumanBytes(bytes) << ", open it in any browser\n";
  }
  return {};
}

}  // namespace

void AddView(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "view", "Write one HTML file that shows a splat, before and after, anywhere",
                           "anchorsplat view scan-4x.ply --before scan.ply -o page.html");
  const auto flags = std::make_shared<PageFlags>();
  verb.add_option("after", flags->after, "Splat file")->required();
  verb.add_option("-o,--output", flags->output, "HTML file to write")->required();
  verb.add_option("--before", flags->before, "Splat to compare with");
  auto* cameras = verb.add_option("--cameras", flags->cameras, "Views to jump to; the first one opens the page");
  verb.add_option("--truth", flags->truth, "Folder of true pictures with the cameras' names")->needs(cameras);
  verb.add_option("--views", flags->views, "How many of the cameras at most, evenly chosen")
      ->check(AtLeastOne())
      ->capture_default_str()
      ->needs(cameras);
  verb.add_option("--pixel-size", flags->pixel_size,
                  "World size of one training pixel, for the scale bar; auto: estimated from BEFORE")
      ->capture_default_str();
  verb.add_option("--sh-degree", flags->sh_degree, "Keep view-dependent colour up to this degree: 0 makes small pages")
      ->check(CLI::Range(0, kMaxShDegree))
      ->capture_default_str();
  AddModeOption(verb, flags->mode, "Rasterization of both (default: each file's tag, else classic)");
  verb.add_option("--background", flags->background,
                  "R,G,B, each 0-1 (default: what the camera file says, else black)");
  verb.add_option("--title", flags->title, "Heading of the page (default: the file's name)");
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunView(*flags, program.flags); }; });
}

}  // namespace anchorsplat
