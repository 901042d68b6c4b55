#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cameras/camera_checks.h"
#include "cameras/camera_io.h"
#include "core/number_text.h"
#include "core/text.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

using Json = nlohmann::ordered_json;  // keys in a readable order

struct IntrinsicsKey {
  const char* name;
  double (*value)(const Pinhole&);
};
constexpr IntrinsicsKey kKeys[] = {
    {"fl_x", [](const Pinhole& c) { return c.fx; }},
    {"fl_y", [](const Pinhole& c) { return c.fy; }},
    {"cx", [](const Pinhole& c) { return c.cx; }},
    {"cy", [](const Pinhole& c) { return c.cy; }},
    {"w", [](const Pinhole& c) { return static_cast<double>(c.width); }},
    {"h", [](const Pinhole& c) { return static_cast<double>(c.height); }},
};

// Writes whole numbers without ".0", as expected for w and h.
Json Number(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return static_cast<int64_t>(value);
  return value;
}

// The double with the fewest digits that rounds to the same float: 0.1, not 0.10000000149.
double ShortestDouble(float value) {
  char text[64];
  const auto written = std::to_chars(text, text + sizeof text, value);
  double out = 0;
  FromChars(text, written.ptr, out);
  return out;
}

Result<Json> FrameToJson(const Camera& camera, const Pinhole& shared) {
  const auto complain = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadArgument, Cat("view \"", Printable(camera.name), "\": ", sentence)};
  };
  if (camera.name.empty()) return complain("has no name");
  if (const Status status = CheckIntrinsics(camera.intrinsics); !status.ok()) return complain(status.error().message);
  Json frame;
  frame["file_path"] = camera.name + (camera.image.has_extension() ? camera.image.extension().string() : ".png");
  for (const IntrinsicsKey& key : kKeys) {
    if (key.value(camera.intrinsics) != key.value(shared)) frame[key.name] = Number(key.value(camera.intrinsics));
  }
  const std::array<double, 16> matrix = OpenGlCameraToWorld(camera.world_to_camera);
  if (auto pose = PoseFromOpenGlCameraToWorld(matrix); !pose.ok()) return complain(pose.error().message);
  Json& rows = frame["transform_matrix"] = Json::array();
  for (size_t r = 0; r < 4; ++r) {
    rows.push_back({matrix[4 * r], matrix[4 * r + 1], matrix[4 * r + 2], matrix[4 * r + 3]});
  }
  return frame;
}

}  // namespace

Status WriteTransforms(const std::filesystem::path& path, const CameraSet& cameras, const WriteOptions& options) {
  if (cameras.cameras.empty()) return Error{ErrorCode::kBadArgument, Cat(path.string(), ": no cameras to write")};
  const Pinhole& shared = cameras.cameras[0].intrinsics;
  Json root;
  for (const IntrinsicsKey& key : kKeys) root[key.name] = Number(key.value(shared));
  if (cameras.background) {
    for (const float x : *cameras.background) {
      if (!(x >= 0 && x <= 1))
        return Error{ErrorCode::kBadArgument, Cat(path.string(), ": background is not in 0 to 1")};
      root["background"].push_back(Number(ShortestDouble(x)));
    }
  }
  Json& frames = root["frames"] = Json::array();
  for (const Camera& camera : cameras.cameras) {
    auto frame = FrameToJson(camera, shared);
    if (!frame.ok()) return Error{frame.error().code, Cat(path.string(), ": ", frame.error().message)};
    frames.push_back(*std::move(frame));
  }
  std::string text;
  try {
    text = root.dump(1) + "\n";
  } catch (const Json::exception&) {  // dump() fails only on invalid UTF-8
    return Error{ErrorCode::kBadArgument, Cat(path.string(), ": a view's name is not UTF-8, which JSON needs")};
  }
  return WriteWholeFile(path, text, options.overwrite);
}

}  // namespace anchorsplat
