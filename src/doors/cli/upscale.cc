#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/batch.h"
#include "cli/clean_output.h"
#include "cli/standard_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "images/image_io.h"
#include "images/orientation.h"
#include "images/rendering.h"
#include "io/input_record.h"
#include "metrics/compare.h"
#include "request/choice.h"
#include "request/parse.h"
#include "request/upscale_flags.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct UpscaleWords {
  std::vector<std::string> pictures;
  std::string output;
  UpscaleFlags how;
};

// Pictures keep their names; those in folders keep their paths.
Result<std::vector<BatchItem>> Items(const UpscaleWords& flags, bool overwrite) {
  std::vector<std::pair<fs::path, fs::path>> found;  // picture, and its name in the output folder
  for (const std::string& input : flags.pictures) {
    if (!IsFolder(input)) {
      found.emplace_back(input, fs::path(input).filename());
      continue;
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto pictures, ListPictures(input));
    for (const fs::path& picture : pictures) found.emplace_back(picture, picture.lexically_relative(input));
  }
  const bool to_file = IsPngName(flags.output);
  if (!to_file && IsPictureName(flags.output)) {
    return Error{ErrorCode::kBadArgument, Cat("-o ", flags.output, ": pictures are written as .png")};
  }
  if (to_file && found.size() > 1) {
    return Error{ErrorCode::kBadArgument,
                 Cat("-o ", flags.output, " is one picture, but there are ", found.size(), ": pass a folder")};
  }
  std::vector<BatchItem> items;
  std::map<fs::path, fs::path> taken;
  for (auto& [picture, name] : found) {
    const fs::path output = to_file ? fs::path(flags.output) : fs::path(flags.output) / name.replace_extension(".png");
    const auto [other, fresh] = taken.emplace(output, picture);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat(other->second.string(), " and ", picture.string(), " would both become ", output.string())};
    }
    if (!overwrite && Exists(output)) {
      return Error{ErrorCode::kExists, Cat(output.string(), " exists; -w replaces it")};
    }
    items.push_back({picture.string(), output.string()});
  }
  return items;
}

Result<Image> ReadUpright(const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, ReadImageSize(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ReadImage(path));
  return Upright(std::move(image), size.orientation);
}

Result<nlohmann::json> Enlarge(const BatchItem& item, Upscaler& network, const EnlargeOptions& options,
                               const WriteOptions& write) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, ReadUpright(item.input));
  const auto begin = std::chrono::steady_clock::now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image enlarged, EnlargePicture(network, image, options));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(item.output));
  if (const fs::path folder = fs::path(item.output).parent_path(); !folder.empty() && write.memory == nullptr) {
    std::error_code code;
    fs::create_directories(folder, code);
    if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", code.message())};
  }
  const std::string comment = EnlargedComment(network.info(), options.factor);
  // Comparing an enlarged rendering needs no camera either.
  ANCHORSPLAT_RETURN_IF_ERROR(IsOwnRendering(item.input) ? WriteRendering(item.output, enlarged, write, comment)
                                                         : WritePng(item.output, enlarged, write, comment));
  return nlohmann::json{{"input", item.input},      {"output", item.output},
                        {"width", enlarged.width},  {"height", enlarged.height},
                        {"factor", options.factor}, {"seconds", seconds},
                        {"detail", "invented"},     {"network", ToJson(network.info())}};
}

Status RunUpscale(UpscaleWords flags, Program& program) {
  std::optional<StandardOutput> piped;
  if (IsStandardOutput(flags.output)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(piped, StandardOutput::Open(".png", program.flags));
    flags.output = piped->path().string();
  }
  WriteOptions write = WriteOptionsFrom(program.flags);
  write.memory = piped ? piped->memory() : nullptr;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Upscaler network, Upscaler::Read(flags.how.network));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnlargeOptions options, MakeEnlargeOptions(flags.how, network.info()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto items, Items(flags, program.flags.overwrite || piped));
  const StopSignal stop_signal(StopSignal::Leaves::kNothing);
  double seconds = 0;
  int64_t done = 0;
  {
    Progress progress("upscale", static_cast<int64_t>(items.size()));
    ANCHORSPLAT_RETURN_IF_ERROR(RunBatch(
        items,
        [&](size_t k) -> Result<nlohmann::json> {
          auto row = Enlarge(items[k], network, options, write);
          if (row.ok()) {
            seconds += (*row)["seconds"].get<double>();
            ++done;
          }
          progress.Advance();
          return row;
        },
        program));
  }
  if (!program.flags.json && !program.flags.quiet) {
    ResultsBeside(write.memory) << "enlarged " << done << (done == 1 ? " picture " : " pictures ") << options.factor
                                << " times in " << HumanSeconds(seconds) << " (without reading and writing) to "
                                << OutputName(flags.output, write.memory) << "; the network invents detail\n";
  }
  return piped ? piped->Send() : Status();
}

}  // namespace

void AddUpscale(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "upscale", "Enlarge pictures with a network",
                           "anchorsplat upscale renders/ -o large/ --network span.safetensors");
  const auto flags = std::make_shared<UpscaleWords>();
  verb.add_option("pictures", flags->pictures, "PNG, JPEG, WebP or TIFF files, or folders of them")
      ->required()
      ->check(NotEmpty());
  verb.add_option("-o,--output", flags->output,
                  "Folder for PNGs; for one picture also a .png file, or - for standard output")
      ->type_name("PATH")
      ->required()
      ->check(NotEmpty());
  flags->how.AddTo(verb);
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunUpscale(*flags, program); }; });
}

}  // namespace anchorsplat
