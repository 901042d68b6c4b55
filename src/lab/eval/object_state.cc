#include "eval/object_state.h"

#include <span>
#include <system_error>

#include "core/text.h"
#include "dataset/object_name.h"
#include "dataset/picture_defects.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

void AddFile(std::string& state, const fs::path& path) {
  std::error_code code;
  state += Cat(path.filename().string(), " ", fs::file_size(path, code), " ",
               fs::last_write_time(path, code).time_since_epoch().count(), "\n");
}

// With the bits of its numbers: Cat would round them.
void AddCamera(std::string& state, const Camera& camera) {
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

void AddCameras(std::string& state, std::span<const Camera> cameras) {
  for (const Camera& camera : cameras) {
    AddCamera(state, camera);
    if (!camera.image.empty()) AddFile(state, camera.image);
  }
}

}  // namespace

std::string CamerasState(std::span<const Camera> cameras) {
  std::string state;
  AddCameras(state, cameras);
  return Cat(StableHash(state));
}

std::string ObjectState(const BenchmarkObject& object, const std::vector<size_t>& views) {
  std::string state;
  AddFile(state, object.splat);
  if (!object.mesh.empty()) AddFile(state, object.mesh);
  AddCameras(state, object.low_cameras.cameras);
  // Those of a fit that saw other pictures and poses: methods may read them.
  if (const fs::path poses = object.low_project / "sparse" / "0" / "images.bin";
      object.low_project.filename() == kCapturedName) {
    AddFile(state, poses);
    for (const Camera& camera : object.low_cameras.cameras) {
      AddFile(state, object.low_project / "images" / camera.image.filename());
    }
  }
  for (const size_t view : views) AddCameras(state, {&object.views[view], 1});
  return Cat(object.splat.filename().string(), " ", StableHash(state));
}

}  // namespace anchorsplat
