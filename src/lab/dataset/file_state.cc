#include "dataset/file_state.h"

#include <system_error>

#include "core/text.h"
#include "dataset/object_name.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// With the bits of its numbers: Cat would round them.
void AddPlace(std::string& state, const Camera& camera) {
  const Pinhole& p = camera.intrinsics;
  const double intrinsics[] = {static_cast<double>(p.width), static_cast<double>(p.height), p.fx, p.fy, p.cx, p.cy};
  const auto add = [&](std::span<const double> numbers) {
    const auto bytes = std::as_bytes(numbers);
    state.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  state += camera.name + "\n";
  add(intrinsics);
  add(camera.world_to_camera.rotation);
  add(camera.world_to_camera.translation);
}

}  // namespace

void AddFileState(std::string& state, const fs::path& file) {
  std::error_code code;
  state += Cat(file.filename().string(), " ", fs::file_size(file, code), " ",
               fs::last_write_time(file, code).time_since_epoch().count(), "\n");
}

void AddCameraState(std::string& state, std::span<const Camera> cameras) {
  for (const Camera& camera : cameras) {
    AddPlace(state, camera);
    if (!camera.image.empty()) AddFileState(state, camera.image);
  }
}

std::string CamerasState(std::span<const Camera> cameras) {
  std::string state;
  AddCameraState(state, cameras);
  return Cat(StableHash(state));
}

}  // namespace anchorsplat
