#include "cameras/colmap_writer.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "core/finite.h"
#include "core/rotation.h"
#include "core/text.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

constexpr int32_t kPinholeModel = 1;  // COLMAP's id of PINHOLE: fx fy cx cy

// Appends values in little-endian (little_endian.h).
template <typename T>
void Put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// The shortest text that parses to the same number.
void PutText(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

bool SameIntrinsics(const Pinhole& a, const Pinhole& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

struct Entry {
  std::string name;
  std::array<double, 4> quaternion;
  std::array<double, 3> translation;
  uint32_t camera;  // from 1
};

struct Model {
  std::vector<Pinhole> cameras;
  std::vector<Entry> images;
};

Result<Model> MakeModel(const std::filesystem::path& folder, const CameraSet& set) {
  if (set.cameras.empty()) return Error{ErrorCode::kBadArgument, Cat(folder.string(), ": no cameras to write")};
  Model model;
  for (const Camera& camera : set.cameras) {
    const auto complain = [&](const std::string& sentence) {
      return Error{ErrorCode::kBadArgument,
                   Cat(folder.string(), ": view \"", Printable(camera.name), "\": ", sentence)};
    };
    if (const Status status = CheckIntrinsics(camera.intrinsics); !status.ok()) return complain(status.error().message);
    Entry entry;
    entry.name = camera.name + (camera.image.has_extension() ? camera.image.extension().string() : ".png");
    if (camera.name.empty()) return complain("has no name");
    if (entry.name.find_first_of(std::string("\n\r\0", 3)) != std::string::npos) {
      return complain("its name has a line break or a zero byte, which a COLMAP model cannot hold");
    }
    if (!AllFinite(camera.world_to_camera.rotation)) return complain("its rotation is not finite");
    if (!AllFinite(camera.world_to_camera.translation)) return complain("its position is not finite");
    entry.quaternion = QuaternionFromRotation(camera.world_to_camera.rotation);
    entry.translation = camera.world_to_camera.translation;
    const auto known = std::find_if(model.cameras.begin(), model.cameras.end(),
                                    [&](const Pinhole& p) { return SameIntrinsics(p, camera.intrinsics); });
    entry.camera = static_cast<uint32_t>(known - model.cameras.begin()) + 1;
    if (known == model.cameras.end()) model.cameras.push_back(camera.intrinsics);
    model.images.push_back(std::move(entry));
  }
  return model;
}

std::string CamerasBinary(const Model& model) {
  std::string out;
  Put(out, uint64_t{model.cameras.size()});
  for (uint32_t i = 0; i < model.cameras.size(); ++i) {
    const Pinhole& k = model.cameras[i];
    Put(out, i + 1);
    Put(out, kPinholeModel);
    Put(out, static_cast<uint64_t>(k.width));
    Put(out, static_cast<uint64_t>(k.height));
    for (const double x : {k.fx, k.fy, k.cx, k.cy}) Put(out, x);
  }
  return out;
}

std::string CamerasText(const Model& model) {
  std::string out = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (size_t i = 0; i < model.cameras.size(); ++i) {
    const Pinhole& k = model.cameras[i];
    out += Cat(i + 1, " PINHOLE ", k.width, " ", k.height);
    for (const double x : {k.fx, k.fy, k.cx, k.cy}) {
      out += ' ';
      PutText(out, x);
    }
    out += '\n';
  }
  return out;
}

std::string ImagesBinary(const Model& model) {
  std::string out;
  Put(out, uint64_t{model.images.size()});
  uint32_t id = 0;
  for (const Entry& image : model.images) {
    Put(out, ++id);
    for (const double x : image.quaternion) Put(out, x);
    for (const double x : image.translation) Put(out, x);
    Put(out, image.camera);
    out.append(image.name.c_str(), image.name.size() + 1);
    Put(out, uint64_t{0});
  }
  return out;
}

std::string ImagesText(const Model& model) {
  std::string out =
      "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  size_t id = 0;
  for (const Entry& image : model.images) {
    out += Cat(++id);
    for (const double x : image.quaternion) {
      out += ' ';
      PutText(out, x);
    }
    for (const double x : image.translation) {
      out += ' ';
      PutText(out, x);
    }
    out += Cat(' ', image.camera, ' ', image.name, "\n\n");
  }
  return out;
}

std::string PointsBinary(std::span<const ColmapPoint> points) {
  std::string out;
  Put(out, uint64_t{points.size()});
  uint64_t id = 0;
  for (const ColmapPoint& point : points) {
    Put(out, ++id);
    for (const double x : point.position) Put(out, x);
    for (const uint8_t x : point.color) Put(out, x);
    Put(out, 0.0);          // reprojection error
    Put(out, uint64_t{0});  // track
  }
  return out;
}

std::string PointsText(std::span<const ColmapPoint> points) {
  std::string out =
      "# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n";
  uint64_t id = 0;
  for (const ColmapPoint& point : points) {
    out += Cat(++id);
    for (const double x : point.position) {
      out += ' ';
      PutText(out, x);
    }
    for (const uint8_t x : point.color) out += Cat(' ', int{x});
    out += " 0\n";
  }
  return out;
}

}  // namespace

Status WriteColmapCameras(const std::filesystem::path& folder, const CameraSet& cameras, ColmapForm form,
                          const WriteOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Model model, MakeModel(folder, cameras));
  const bool binary = form == ColmapForm::kBinary;
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(folder / (binary ? "cameras.bin" : "cameras.txt"),
                                             binary ? CamerasBinary(model) : CamerasText(model), options.overwrite));
  return WriteWholeFile(folder / (binary ? "images.bin" : "images.txt"),
                        binary ? ImagesBinary(model) : ImagesText(model), options.overwrite);
}

Status WriteColmapPoints(const std::filesystem::path& folder, std::span<const ColmapPoint> points, ColmapForm form,
                         const WriteOptions& options) {
  for (const ColmapPoint& point : points) {
    if (!AllFinite(point.position)) {
      return Error{ErrorCode::kBadArgument, Cat(folder.string(), ": a point's position is not finite")};
    }
  }
  const bool binary = form == ColmapForm::kBinary;
  return WriteWholeFile(folder / (binary ? "points3D.bin" : "points3D.txt"),
                        binary ? PointsBinary(points) : PointsText(points), options.overwrite);
}

}  // namespace anchorsplat
