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

// A furnished room seen from within: what people capture instead of objects from all around. Distances range from 15 cm
// to the houses behind the window, and every ray hits something.
//
// Metres, y up: x from 0 to the room's width, z from 0 (the wall with the window) to its depth.
struct RoomOptions {
  std::array<double, 3> size = {5.2, 2.7, 4.4};  // width, height, depth; at least 4.5 x 2.5 x 4
  uint64_t seed = 0;                             // of all painted pictures
};

// A piece of furniture: mesh address, position of the centre of its underside, rotation about the vertical (degrees,
// counterclockwise from above), and height (metres).
struct PlacedMesh {
  std::string mesh;
  std::array<double, 3> at = {0, 0, 0};
  double turn = 0;
  double height = 1;
};

// Reads a text file with one piece per line: address, x, y, z, turn, height. Skips empty lines and those starting with
// #. Addresses are below `objects`, as in dataset_split.h. Errors name file and line: kBadFile; those of ReadFileBytes
// and ResolveAddresses.
Result<std::vector<PlacedMesh>> ReadFurniture(const std::filesystem::path& file, const std::filesystem::path& objects);

struct Room {
  struct Box {
    std::array<float, 3> low, high;
  };
  Mesh mesh;                   // not lit yet
  std::vector<Box> furniture;  // where no camera may be
  DaylightOptions daylight;
  std::array<double, 3> size;
};

// Builds walls, window, curtains, rug, pictures, a bookshelf and the furniture. Errors: those of ReadMesh;
// kBadArgument: a room too small, or furniture outside it.
Result<Room> FurnishRoom(const std::vector<PlacedMesh>& furniture, const RoomOptions& options);

// `count` views from all over the room, at least 15 cm from furniture and 35 cm from walls. Pictures are 4 : 3, `low`
// and `high` pixels wide, with a field of view of 75°. A view's pose depends on its number only. kBadArgument: no views
// or more than 10,000; sizes that are not multiples of 4; a room without free space.
Result<ViewSetCameras> RoomCameras(const Room& room, int count, int low, int high);

}  // namespace anchorsplat
