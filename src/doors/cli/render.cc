#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cameras/view_labels.h"
#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/standard_output.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "images/rendering.h"
#include "io/input_record.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"
#include "request/choice.h"
#include "request/parse.h"
#include "request/upscale_flags.h"
#include "request/views.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct RenderFlags {
  std::string input;
  std::string output;
  bool transparent = false;
  std::string enlarge_with;  // network file; empty: not enlarged
  ViewFlags views;
};

// One picture goes to a file, several to a folder under the views' names, which may contain folders.
Result<std::vector<fs::path>> OutputPaths(const std::string& output, const CameraSet& cameras, bool overwrite) {
  const bool to_file = IsPngName(output);
  if (!to_file && IsPictureName(output)) {
    return Error{ErrorCode::kBadArgument, Cat("-o ", output, ": pictures are written as .png")};
  }
  if (to_file && cameras.cameras.size() > 1) {
    return Error{ErrorCode::kBadArgument, Cat("-o ", output, " is one picture, but there are ", cameras.cameras.size(),
                                              " views: pass a folder, or choose one with --view NAME")};
  }
  std::vector<fs::path> paths;
  std::map<fs::path, std::string> taken;
  std::vector<std::string> names;
  for (const Camera& camera : cameras.cameras) names.push_back(camera.name);
  const std::vector<std::string> labels = ViewLabels(names);
  for (size_t i = 0; i < labels.size(); ++i) {
    const Camera& camera = cameras.cameras[i];
    paths.push_back(to_file ? fs::path(output) : fs::path(output) / (labels[i] + ".png"));
    const auto [other, fresh] = taken.emplace(paths.back(), camera.name);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat("views ", other->second, " and ", camera.name, " would both become ", paths.back().string())};
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(paths.back()));
    if (!overwrite && Exists(paths.back())) {
      return Error{ErrorCode::kExists, Cat(paths.back().string(), " exists; -w replaces it")};
    }
  }
  if (!to_file) {
    for (const fs::path& path : paths) {
      std::error_code code;
      fs::create_directories(path.parent_path(), code);
      if (code) {
        return Error{ErrorCode::kIo, Cat(path.parent_path().string(), ": cannot create this folder: ", code.message())};
      }
    }
  }
  return paths;
}

// Clamps to the colours of pictures, on which networks were trained.
Image Clamped(Image image) {
  for (float& value : image.pixels) value = std::clamp(value, 0.0f, 1.0f);
  return image;
}

Status RunRender(const RenderFlags& flags, const SharedFlags& shared) {
  const DeviceUse device;
  std::optional<StandardOutput> piped;
  if (IsStandardOutput(flags.output)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(piped, StandardOutput::Open(".png", shared));
  }
  WriteOptions write = WriteOptionsFrom(shared);
  write.memory = piped ? piped->memory() : nullptr;
  const std::string output = piped ? piped->path().string() : flags.output;
  std::optional<Upscaler> network;
  if (!flags.enlarge_with.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(network, Upscaler::Read(flags.enlarge_with));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadToShow(flags.input));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet cameras, MakeViews(flags.views, cloud));
  ANCHORSPLAT_ASSIGN_OR_RETURN(RenderOptions options, MakeRenderOptions(flags.views, cloud, cameras));
  if (flags.transparent) options.background = {0, 0, 0};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto paths, OutputPaths(output, cameras, shared.overwrite || piped));

  const std::string comment = network ? EnlargedComment(network->info(), network->info().scale) : "";
  double seconds = 0;
  nlohmann::json views = nlohmann::json::array();
  std::string empty;  // why the first empty view is empty
  int64_t empty_views = 0;
  {
    ConstantCloud still(cloud);
    Rasterizer rasterizer;
    Progress progress("render", static_cast<int64_t>(paths.size()));
    Stopwatch watch;
    const auto keep = [&](size_t i, RenderOutput& render) -> Status {
      seconds += watch.Lap();
      const Camera& camera = cameras.cameras[i];
      const std::string warning = EmptyPictureReason(cloud, camera, options, rasterizer.statistics().visible);
      if (!warning.empty() && empty_views++ == 0) empty = warning;
      Image picture = flags.transparent ? WithAlpha(render) : std::move(render.color);
      if (network) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(picture, EnlargePicture(*network, Clamped(std::move(picture))));
      }
      ANCHORSPLAT_RETURN_IF_ERROR(WriteRendering(paths[i], picture, write, comment));
      views.push_back({{"name", camera.name}, {"file", paths[i].string()}});
      progress.Advance();
      watch.Lap();
      return {};
    };
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, cameras.cameras, options, keep));
  }
  if (empty_views > 0) {
    LogWarning(
        Cat(empty, " Check --near and --far",
            empty_views > 1 ? Cat(" (", empty_views - 1, " more of ", paths.size(), " views are as empty)") : ""));
  }
  if (shared.json) {
    nlohmann::json json = {{"input", flags.input},
                           {"gaussians", cloud.size()},
                           {"render_seconds", seconds},
                           {"device", device.ToJson()},
                           {"views", views}};
    if (network) json["enlarged"] = {{"detail", "invented"}, {"network", ToJson(network->info())}};
    PrintJson(json);
  } else if (!shared.quiet) {
    ResultsBeside(write.memory) << "rendered " << paths.size() << (paths.size() == 1 ? " view of " : " views of ")
                                << WithThousands(cloud.size())
                                << (cloud.size() == 1 ? " Gaussian in " : " Gaussians in ") << HumanSeconds(seconds)
                                << " (without reading and "
                                << "writing) to " << OutputName(output, write.memory)
                                << (network ? ", enlarged by a network, which invents detail" : "") << '\n';
  }
  return piped ? piped->Send() : Status();
}

}  // namespace

void AddRender(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "render", "Render a splat to PNG pictures",
                           "anchorsplat render scan.ply -o views/ --orbit 8 --size 800x600 --background 1,1,1");
  const auto flags = std::make_shared<RenderFlags>();
  verb.add_option("input", flags->input, "Splat file")->required();
  verb.add_option("-o,--output", flags->output, "One view: a .png file, or - for standard output. Several: a folder")
      ->type_name("PATH")
      ->required()
      ->check(NotEmpty());
  flags->views.AddTo(verb);
  verb.add_option("--enlarge-with", flags->enlarge_with,
                  "Network that enlarges the renders, a .safetensors of scripts/fetch-upscaler.sh")
      ->type_name("FILE")
      ->check(NotEmpty());
  verb.add_flag("--transparent", flags->transparent, "Write an alpha channel instead of a background")
      ->excludes("--background");
  program.device.AddTo(verb);
  ShortenHelp(verb, {"--output", "--cameras", "--orbit", "--radius", "--up", "--view", "--size", "--background",
                     "--transparent", "--device", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunRender(*flags, program.flags); }; });
}

}  // namespace anchorsplat
