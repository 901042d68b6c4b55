#include "eval/object_state.h"

#include <filesystem>

#include "core/text.h"
#include "dataset/file_state.h"
#include "dataset/object_name.h"
#include "dataset/picture_defects.h"

namespace anchorsplat {

namespace fs = std::filesystem;

std::string ObjectState(const BenchmarkObject& object, const std::vector<size_t>& views) {
  std::string state;
  AddFileState(state, object.splat);
  if (!object.mesh.empty()) AddFileState(state, object.mesh);
  AddCameraState(state, object.low_cameras.cameras);
  // Those of a fit that saw other pictures and poses: methods may read them.
  if (const fs::path poses = object.low_project / "sparse" / "0" / "images.bin";
      object.low_project.filename() == kCapturedName) {
    AddFileState(state, poses);
    for (const Camera& camera : object.low_cameras.cameras) {
      AddFileState(state, object.low_project / "images" / camera.image.filename());
    }
  }
  for (const size_t view : views) AddCameraState(state, {&object.views[view], 1});
  return Cat(object.splat.filename().string(), " ", StableHash(state));
}

}  // namespace anchorsplat
