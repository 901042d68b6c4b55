#include "formats/camera_io.h"

#include "core/text.h"
#include "formats/json_file.h"
#include "formats/transforms_json.h"

namespace anchorsplat {

Result<CameraSet> ReadCameras(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile file, JsonFile::Read(path));
  return CamerasFromTransforms(file.root(), path.parent_path());
}

}  // namespace anchorsplat
