#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/clean_output.h"
#include "cli/edit_steps_report.h"
#include "cli/help.h"
#include "cli/standard_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/log.h"
#include "core/statistics.h"
#include "core/text.h"
#include "edit/edit_clouds.h"
#include "formats/opened_splat.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "request/edit_flags.h"
#include "request/page_flags.h"
#include "request/views.h"
#include "viewer/page_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct PageWords {
  std::string after;
  std::string before;
  std::string output;
  bool folder = false;
  PageFlags how;
  EditFlags edits;
};

// Above this, a single file loads slowly in browsers.
constexpr int64_t kManyGaussians = 1'000'000;

uint64_t FileBytes(const fs::path& path) {
  std::error_code failed;
  const uint64_t bytes = fs::file_size(path, failed);
  return failed ? 0 : bytes;
}

// Warns if a single file is large.
void WarnOfLargePage(const PageWords& flags, int64_t gaussians, uint64_t bytes) {
  if (flags.folder || gaussians <= kManyGaussians) return;
  LogWarning(Cat(flags.output, ": ", WithThousands(gaussians), " Gaussians in one file of ", HumanBytes(bytes),
                 " load slowly in a browser. Pass --folder to write a page that streams them"));
}

struct Shown {
  GaussianCloud cloud;
  std::string name;
  uint64_t bytes = 0;
};

// Reads a splat to show; an empty one is an error.
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
  return Error{ErrorCode::kBadFile, Cat(path.string(), ": nothing to show: all ", WithThousands(shown.cloud.size()),
                                        " Gaussians have NaN or infinite values")};
}

// The given edits, in order. Edits that move the splat exclude cameras, which do not move.
Result<std::vector<EditAction>> EditsOf(const PageWords& flags) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto actions, ActionsAmongPaths(flags.edits));
  for (const EditAction& action : actions[0]) {
    const bool moves = std::holds_alternative<MoveWorld>(action.what) || std::holds_alternative<TurnToUp>(action.what);
    if (moves && !flags.how.cameras.empty()) {
      return Error{ErrorCode::kBadArgument,
                   Cat(action.words, " moves the splat away from its cameras: omit --cameras")};
    }
  }
  return std::move(actions[0]);
}

// The edited splat, and a report per edit.
Result<Shown> EditShown(const Shown& shown, const std::vector<EditAction>& actions, std::vector<EditStep>& steps) {
  const std::array<CloudView, 1> clouds = {shown.cloud};
  const std::array<EditRun, 1> runs = {EditRun{0, 1, actions}};
  ANCHORSPLAT_ASSIGN_OR_RETURN(EditedCloud edited, EditClouds(clouds, runs));
  steps = std::move(edited.steps);
  if (CountUnusable(edited.cloud) == edited.cloud.size()) {
    return Error{ErrorCode::kBadArgument, Cat(shown.name, ": the edits leave nothing to show")};
  }
  return Shown{std::move(edited.cloud), Cat(shown.name, ", edited")};
}

// Guards against overwriting a splat by a mistyped name.
bool IsPageName(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".html" || extension == ".htm";
}

Status RunView(const PageWords& flags, const SharedFlags& shared) {
  const DeviceUse device;
  std::optional<StandardOutput> piped;
  if (IsStandardOutput(flags.output)) {
    if (flags.folder) {
      return Error{ErrorCode::kBadArgument, "--folder writes several files, and standard output is one"};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(piped, StandardOutput::Open(".html", shared));
  } else if (!IsPageName(flags.output)) {
    return Error{ErrorCode::kBadArgument, Cat("--output: ", flags.output, " is not a .html file")};
  }
  if (!piped) ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(flags.output, shared.overwrite));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewerPage page, MakePage(flags.how));
  page.memory = piped ? piped->memory() : nullptr;
  const fs::path output = piped ? piped->path() : fs::path(flags.output);
  page.folder = flags.folder;
  page.smaller = flags.folder ? "use fewer ground-truth pictures (--views)"
                              : Cat("pass --folder to store the data beside the page, or ", page.smaller);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<EditAction> actions, EditsOf(flags));
  const StopSignal stop_signal(StopSignal::Leaves::kNothing);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Shown after, ReadShown(flags.after, flags.how.mode));
  Shown before;
  std::vector<EditStep> steps;
  if (!actions.empty()) {
    before = std::move(after);
    ANCHORSPLAT_ASSIGN_OR_RETURN(after, EditShown(before, actions, steps));
  }
  if (!flags.before.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(before, ReadShown(flags.before, flags.how.mode));
  }
  if (before.cloud.size() > 0) page.before = ViewerSplat{&before.cloud, before.name, before.bytes};
  page.after = {&after.cloud, after.name, {}};
  if (actions.empty()) page.after.file_bytes = after.bytes;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPageSize(output, page));
  LookAtSplats(page);
  ANCHORSPLAT_RETURN_IF_ERROR(WriteViewerPage(output, page, WriteOptionsFrom(shared)));

  const uint64_t bytes = piped ? piped->memory()->files.at(output).size() : FileBytes(output);
  WarnOfLargePage(flags, after.cloud.size() + before.cloud.size(), bytes);
  if (shared.json) {
    nlohmann::json json = {{"output", flags.output},
                           {"bytes", bytes},
                           {"views", page.views.size()},
                           {"device", device.ToJson()},
                           {"pixel_size", page.pixel_size ? nlohmann::json(*page.pixel_size) : nlohmann::json()}};
    if (!steps.empty()) json["actions"] = ToJson(steps);
    PrintJson(json);
  } else if (!shared.quiet) {
    ResultsBeside(page.memory)
        << OutputName(output, page.memory) << ": " << HumanBytes(bytes)
        << (piped          ? ", a page for any browser\n"
            : flags.folder ? ", with its data in the folder beside it; keep them together. Open it in any browser\n"
                           : ", open it in any browser\n");
    PrintSteps(steps, ResultsBeside(page.memory));
  }
  return piped ? piped->Send() : Status();
}

}  // namespace

void AddView(CLI::App& app, Program& program) {
  CLI::App& verb =
      AddVerb(app, program, "view", "Write an HTML page that shows a splat in any browser, before and after",
              "anchorsplat view scan-4x.ply --before scan.ply -o page.html");
  const auto flags = std::make_shared<PageWords>();
  verb.add_option("after", flags->after, "Splat file")->required();
  verb.add_option("-o,--output", flags->output, "HTML file to write; - is standard output")
      ->type_name("FILE")
      ->required();
  verb.add_option("--before", flags->before, "Splat to compare with (default with edits: the unedited splat)")
      ->type_name("FILE");
  verb.add_flag("--folder", flags->folder,
                "Store the splats in a folder beside the page, PAGE.data, and stream the largest Gaussians first; for "
                "large splats");
  flags->how.AddTo(verb);
  flags->edits.AddTo(verb);
  verb.remove_option(verb.get_option("--dry-run"));  // only for `convert`; here the page shows the result
  program.device.AddTo(verb);
  ShortenHelp(verb, {"--output", "--before", "--cameras", "--truth", "--title", "--background", "--sh-degree",
                     "--folder", "--filter-box", "--filter-floaters", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &program] {
    program.device.device = {};  // a page is data: nothing is rasterized here
    program.run = [flags, &program] { return RunView(*flags, program.flags); };
  });
}

}  // namespace anchorsplat
