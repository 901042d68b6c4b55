#include "cameras/nerfstudio_frame.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera_checks.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/rotation.h"
#include "core/text.h"
#include "core/words.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMostConfigBytes = uint64_t{4} << 20;

// Three or four rows of a rotation and a translation.
Result<Similarity> RigidRows(const JsonValue& matrix) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> rows, matrix.Elements());
  if (rows.size() != 3 && rows.size() != 4) return matrix.Complain(Cat("expected 3 rows, found ", rows.size()));
  Similarity rigid;
  for (size_t i = 0; i < 3; ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> row, rows[i].Numbers(4));
    std::copy_n(row.begin(), 3, rigid.rotation.begin() + static_cast<ptrdiff_t>(3 * i));
    rigid.translation[i] = row[3];
  }
  const auto checked = PoseFromCameraToWorld(rigid.rotation, rigid.translation);
  if (!checked.ok()) return matrix.Complain(checked.error().message);
  rigid.rotation = NearestRotation(rigid.rotation);
  return rigid;
}

Result<double> PositiveScale(const JsonValue& value) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double scale, value.Number());
  if (!(scale > 0)) return value.Complain(Cat("expected a positive number, found ", scale));
  return scale;
}

// The first path in a config.yml, in the YAML of Python's pathlib: "data: !!python/object/apply:pathlib.PosixPath" and
// a line "- PART" per part. Empty if there is none.
std::filesystem::path DataOfConfig(std::string_view yaml) {
  std::filesystem::path data;
  bool within = false;
  while (!yaml.empty()) {
    const size_t end = std::min(yaml.find('\n'), yaml.size());
    std::string_view line = Trimmed(yaml.substr(0, end));
    yaml.remove_prefix(std::min(end + 1, yaml.size()));
    if (within && line.starts_with("- ")) {
      line = Trimmed(line.substr(2));
      if (line.size() > 1 && (line.front() == '\'' || line.front() == '"') && line.back() == line.front()) {
        line = line.substr(1, line.size() - 2);
      }
      data /= line;
    } else {
      if (!data.empty()) break;
      within = line.starts_with("data:") && line.find("pathlib.") != std::string_view::npos;
    }
  }
  return data;
}

}  // namespace

Result<Similarity> ReadNerfstudioFrame(const std::filesystem::path& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue transform, json.root().Get("transform"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Similarity frame, RigidRows(transform));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue scale, json.root().Get("scale"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(frame.scale, PositiveScale(scale));
  for (double& x : frame.translation) x *= frame.scale;  // nerfstudio scales after moving
  return frame;
}

Result<Similarity> AppliedByNerfstudio(const JsonValue& transforms, const std::filesystem::path& folder) {
  Similarity applied;
  if (const auto given = transforms.Find("applied_transform"); given && !given->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(applied, RigidRows(*given));
  } else if (IsFolder(folder / "colmap" / "sparse" / "0")) {
    applied.rotation = {0, 1, 0, 1, 0, 0, 0, 0, -1};
  }
  return applied;
}

Status MoveToNerfstudioFrame(const std::filesystem::path& file, const Similarity& applied, CameraSet& set) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Similarity frame, ReadNerfstudioFrame(file));
  set.moved = Compose(frame, Inverse(applied));
  for (Camera& camera : set.cameras) {
    camera.world_to_camera = Moved(camera.world_to_camera, *set.moved);
    for (const double x : camera.world_to_camera.translation) {
      if (std::isfinite(x)) continue;
      return Error{ErrorCode::kBadFile, Cat(file.string(), ": moves camera ", Printable(camera.name),
                                            " so far that its position overflows")};
    }
  }
  LogInfo(Cat(file.string(), ": converted the cameras to nerfstudio's training coordinates (scale ", frame.scale, ")"));
  return {};
}

Result<std::filesystem::path> DataOfNerfstudioRun(const std::filesystem::path& folder) {
  const std::filesystem::path config = folder / "config.yml";
  const std::string otherwise = Cat("; copy ", (folder / kNerfstudioFrame).string(),
                                    " next to the transforms.json or COLMAP model it was trained on, and pass that");
  const auto yaml = ReadFileBytes(config, kMostConfigBytes);
  if (!yaml.ok()) {
    return Error{ErrorCode::kNotFound, Cat(folder.string(),
                                           ": is a nerfstudio run without a config.yml that says where its "
                                           "cameras are",
                                           otherwise)};
  }
  const std::filesystem::path data = DataOfConfig(*yaml);
  if (data.empty() || data.native().find('\0') != std::string::npos) {
    return Error{ErrorCode::kNotFound, Cat(config.string(), ": does not say where the cameras are", otherwise)};
  }
  for (std::filesystem::path from = AbsolutePath(folder); !data.is_absolute(); from = from.parent_path()) {
    if (Exists(from / data)) return from / data;
    if (from == from.parent_path()) break;
  }
  if (Exists(data)) return data;
  return Error{ErrorCode::kNotFound, Cat(config.string(), ": the cameras were in ", Printable(data.string(), 400),
                                         ", which does not exist", otherwise)};
}

}  // namespace anchorsplat
