#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "cli/clean_output.h"
#include "cli/stop_signal.h"
#include "cli/with_lab/dataset.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "dataset/room.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/input_record.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kRoomName = "room.json";  // beside the views: their settings

struct RoomFlags {
  std::string furniture;
  std::string objects;
  std::string output;
  RoomOptions room;
  ViewSetOptions views;
  int count = 200;
  double light_every = 0.06;  // metres

  RoomFlags() {
    views.high_size = 1600;
    views.low_size = 400;
    views.opaque = true;
    views.trace.samples = 3;
    views.points = 100000;
  }
};

// Equal text means equal pictures.
std::string RoomText(const RoomFlags& flags, const std::vector<PlacedMesh>& pieces) {
  nlohmann::json list = nlohmann::json::array();
  for (const PlacedMesh& p : pieces) {
    list.push_back(
        {{"mesh", fs::path(p.mesh).filename().string()}, {"at", p.at}, {"turn", p.turn}, {"height", p.height}});
  }
  const nlohmann::json json = {{"version", 1},
                               {"size", flags.room.size},
                               {"seed", flags.room.seed},
                               {"views", flags.count},
                               {"sizes", {flags.views.low_size, flags.views.high_size}},
                               {"samples", flags.views.trace.samples},
                               {"points", flags.views.points},
                               {"light_every", flags.light_every},
                               {"furniture", list}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Status RunRoom(const RoomFlags& given, const SharedFlags& shared) {
  RoomFlags flags = given;
  flags.room.seed = flags.views.seed = shared.seed;
  flags.views.overwrite = shared.overwrite;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto pieces, ReadFurniture(flags.furniture, flags.objects));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Room room, FurnishRoom(pieces, flags.room));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const ViewSetCameras cameras,
      RoomCameras(room, flags.count, flags.views.low_size, flags.views.high_size));  // complains before hours of work

  const fs::path folder = flags.output, note = folder / kRoomName;
  const std::string text = RoomText(flags, pieces);
  bool keep = false;
  RecordOwnFile(note);
  if (IsFile(note) && !shared.overwrite) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string earlier, ReadFileBytes(note, uint64_t{1} << 20));
    if (earlier != text) {
      return Error{ErrorCode::kExists,
                   Cat(folder.string(), ": has views made with other settings or furniture; -w makes them again")};
    }
    keep = true;
  }
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", code.message())};
  room.daylight.longest_edge = static_cast<float>(flags.light_every);
  LogInfo("computing daylight");
  ANCHORSPLAT_RETURN_IF_ERROR(BakeDaylight(room.mesh, room.daylight));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const RayTracer tracer, RayTracer::Create(std::move(room.mesh)));
  // Pictures in the folder now belong to this room.
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(note, text, true));
  std::optional<StopSignal> stop_signal(std::in_place);
  const auto cost = WriteViews(tracer, folder, cameras, flags.views, keep);
  stop_signal.reset();
  if (!cost.ok()) return cost.error();
  if (shared.json) {
    PrintJson({{"output", flags.output},
               {"triangles", tracer.mesh().triangles.size()},
               {"textures", tracer.mesh().textures.size()},
               {"views", flags.count},
               {"sizes", {flags.views.low_size, flags.views.high_size}},
               {"seconds", cost->seconds}});
  } else if (!shared.quiet) {
    std::cout << flags.count << " views of a room of " << WithThousands(std::ssize(tracer.mesh().triangles))
              << " triangles, " << flags.views.low_size << " and " << flags.views.high_size << " pixels wide, in "
              << HumanSeconds(cost->seconds) << " to " << OneLine(flags.output) << '\n';
  }
  return {};
}

}  // namespace

void AddDatasetRoom(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "room", "Render views inside a furnished room, at two sizes",
                           "anchorsplat dataset room data/room.txt --objects objects -o scenes/room");
  const auto flags = std::make_shared<RoomFlags>();
  verb.add_option("furniture", flags->furniture, "Text file with mesh, x, y, z, turn and height per line")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--objects", flags->objects, "Folder of the meshes")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  verb.add_option("-o,--output", flags->output, "Folder for the views")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--views", flags->count, "Cameras in the room")->check(CLI::Range(1, 10000))->capture_default_str();
  verb.add_option("--size", flags->views.high_size, "Width of the high-resolution views; a multiple of 4")
      ->check(CLI::Range(4, 16384))
      ->capture_default_str();
  verb.add_option("--low-size", flags->views.low_size, "Width of the low-resolution views; a multiple of 4")
      ->check(CLI::Range(4, 16384))
      ->capture_default_str();
  verb.add_option("--samples", flags->views.trace.samples, "Rays per pixel and side: 3 is 9 rays a pixel")
      ->check(CLI::Range(1, kMaxTraceSamples))
      ->capture_default_str();
  verb.add_option("--light-every", flags->light_every, "Spacing of the light samples, metres")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  verb.add_option("--points", flags->views.points, "Surface samples to start a fit from")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunRoom(*flags, program.flags); }; });
}

}  // namespace anchorsplat
