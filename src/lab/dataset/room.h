#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "scene/baked_light.h"
#include "scene/mesh.h"
#include "scene/view_set.h"

namespace anchorsplat {

// A furnished room seen from within: what people capture, where objects are seen from all around. Everything is near
// or far, from 15 cm to the houses behind the window, and every ray meets something.
//
// Metres, y up: x from 0 to the room's width, z from 0 (the wall with the window) to its depth.
struct RoomOptions {
  std::array<double, 3> size = {5.2, 2.7, 4.4};  // width, height, depth; at least 4.5 x 2.5 x 4
  uint64_t seed = 0;                             // of all that is painted
};

// A piece of furniture: a mesh by its address, how high it is (metres), where the middle of its underside stands, and
// how far it is turned around the vertical (degrees, counterclockwise from above).
struct PlacedMesh {
  std::string mesh;
  std::array<double, 3> at = {0, 0, 0};
  double turn = 0;
  double height = 1;
};

// A text file with a line per piece: address, x, y, z, turn, height. Empty lines and those that begin with # are left
// out. Addresses are below `objects`, as those of lists (dataset_split.h). Errors name file and line: kBadFile; as
// ReadFileBytes and ResolveAddresses.
Result<std::vector<PlacedMesh>> ReadFurniture(const std::filesystem::path& file, const std::filesystem::path& objects);

struct Room {
  struct Box {
    std::array<float, 3> low, high;
  };
  Mesh mesh;                   // not lit yet
  std::vector<Box> furniture;  // where no camera can be
  DaylightOptions daylight;
  std::array<double, 3> size;
};

// Walls, window, curtains, rug, pictures, a shelf of books and the furniture. Errors: as ReadMesh; kBadArgument: a room
// too small, or furniture that is not within it.
Result<Room> FurnishRoom(const std::vector<PlacedMesh>& furniture, const RoomOptions& options);

// `count` views from all over the room, at least 15 cm from furniture and 35 cm from walls, pictures of 4 : 3 with a
// field of view of 75° that are `low` and `high` pixels wide. Where they stand and look follows from their number
// alone. kBadArgument: no views, more than 10,000, sizes that are not multiples of 4, a room without a free place.
Result<ViewSetCameras> RoomCameras(const Room& room, int count, int low, int high);

}  // namespace anchorsplat
