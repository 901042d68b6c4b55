#include <bit>
#include <cstdio>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/colmap_model.h"
#include "core/finite.h"
#include "core/text.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kSmallestImage = 4 + 7 * 8 + 4 + 1 + 8;  // no name, no points

// Sequential reader of a little-endian file. Every read is checked against the remaining size.
class ByteStream {
 public:
  static Result<ByteStream> Open(const std::filesystem::path& path) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(OpenedFile file, OpenForReading(path));
    return ByteStream(path.string(), std::move(file));
  }

  uint64_t left() const { return file_.size - position_; }

  Status Read(uint8_t& out, const char* what) { return ReadInteger(out, what); }
  Status Read(uint32_t& out, const char* what) { return ReadInteger(out, what); }
  Status Read(uint64_t& out, const char* what) { return ReadInteger(out, what); }
  Status Read(double& out, const char* what) {
    uint64_t bits = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadInteger(bits, what));
    out = std::bit_cast<double>(bits);
    return {};
  }

  // Reads up to and including a zero byte.
  Status ReadName(std::string& out) {
    constexpr size_t kLongestPath = 4096;  // Linux's PATH_MAX
    out.clear();
    for (;;) {
      const int c = std::fgetc(file_.handle.get());
      if (c == EOF) return Complain("file ends inside an image's name");
      ++position_;
      if (c == 0) return {};
      out += static_cast<char>(c);
      if (out.size() > kLongestPath) return Complain(Cat("an image's name is longer than ", kLongestPath, " bytes"));
    }
  }

  // Reads the count of records of at least `size` bytes each, which must fit into the rest of the file.
  Status ReadCount(uint64_t& count, uint64_t size, const char* what) {
    ANCHORSPLAT_RETURN_IF_ERROR(Read(count, what));
    if (count > left() / size) {
      return Complain(
          Cat(what, " is ", count, ", but only ", WithThousands(static_cast<int64_t>(left())), " bytes follow"));
    }
    return {};
  }

  Status Skip(uint64_t bytes) {
    if (bytes == 0) return {};  // seeking discards the read-ahead
    position_ += bytes;
    if (fseeko(file_.handle.get(), static_cast<off_t>(position_), SEEK_SET) != 0) return Complain("cannot be read");
    return {};
  }

  Error Complain(const std::string& sentence) const {
    return Error{ErrorCode::kBadFile,
                 Cat(name_, ": byte ", WithThousands(static_cast<int64_t>(position_)), ": ", sentence)};
  }

 private:
  ByteStream(std::string name, OpenedFile file) : name_(std::move(name)), file_(std::move(file)) {}

  template <typename T>
  Status ReadInteger(T& out, const char* what) {
    unsigned char bytes[sizeof(T)];
    if (std::fread(bytes, 1, sizeof bytes, file_.handle.get()) != sizeof bytes) {
      return Complain(Cat("file ends inside ", what));
    }
    out = 0;
    for (size_t i = 0; i < sizeof bytes; ++i) out |= T{bytes[i]} << (8 * i);
    position_ += sizeof bytes;
    return {};
  }

  std::string name_;
  OpenedFile file_;
  uint64_t position_ = 0;
};

// A sound file ends after the last record; trailing bytes mean that it was misread.
Status ExpectEnd(const ByteStream& stream) {
  if (stream.left() == 0) return {};
  return stream.Complain(
      Cat("expected the end of the file, found ", WithThousands(static_cast<int64_t>(stream.left())), " more bytes"));
}

}  // namespace

Result<ColmapCameras> ReadColmapCamerasBinary(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteStream stream, ByteStream::Open(path));
  constexpr uint64_t kSmallestCamera = 4 + 4 + 8 + 8 + 3 * 8;  // SIMPLE_PINHOLE
  uint64_t count = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(count, kSmallestCamera, "the number of cameras"));
  ColmapCameras cameras;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0, model_id = 0;
    uint64_t width = 0, height = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(id, "a camera's id"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(model_id, "a camera's model"));
    const ColmapCameraModel* model = FindColmapCameraModel(static_cast<int>(model_id));
    if (model == nullptr) return stream.Complain(Cat("camera ", id, ": unknown camera model ", model_id));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(width, "a camera's width"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(height, "a camera's height"));
    std::vector<double> params(model->params);
    for (double& param : params) ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(param, "a camera's parameters"));
    auto camera = CameraFromColmap(*model, width, height, params);
    if (!camera.ok()) return stream.Complain(Cat("camera ", id, ": ", camera.error().message));
    if (!cameras.emplace(id, *std::move(camera)).second) return stream.Complain(Cat("camera ", id, " is listed twice"));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ExpectEnd(stream));
  return cameras;
}

Result<std::vector<Camera>> ReadColmapImagesBinary(const std::filesystem::path& path, const ColmapCameras& cameras) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteStream stream, ByteStream::Open(path));
  constexpr uint64_t kPoint = 8 + 8 + 8;
  uint64_t count = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(count, kSmallestImage, "the number of images"));
  std::vector<Camera> views;
  QuaternionNorms norms;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0;
    uint64_t points = 0;
    ColmapImage image;
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(id, "an image's id"));
    for (double& x : image.quaternion) ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(x, "an image's quaternion"));
    for (double& x : image.translation) ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(x, "an image's translation"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(image.camera, "an image's camera"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadName(image.name));
    auto camera = ViewFromColmap(image, cameras);
    if (!camera.ok()) return stream.Complain(camera.error().message);
    norms.Add(image.quaternion);
    views.push_back(*std::move(camera));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(points, kPoint, "an image's number of points"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Skip(points * kPoint));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ExpectEnd(stream));
  norms.Report(path);
  return views;
}

Result<size_t> CountColmapImagesBinary(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteStream stream, ByteStream::Open(path));
  uint64_t count = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(count, kSmallestImage, "the number of images"));
  return static_cast<size_t>(count);
}

Result<std::vector<ColmapPoint>> ReadColmapPointsBinary(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteStream stream, ByteStream::Open(path));
  constexpr uint64_t kSmallestPoint = 8 + 3 * 8 + 3 + 8 + 8;  // without a track
  constexpr uint64_t kTrackElement = 4 + 4;
  uint64_t count = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(count, kSmallestPoint, "the number of points"));
  std::vector<ColmapPoint> points(count);
  for (ColmapPoint& point : points) {
    uint64_t id = 0, track = 0;
    double error = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(id, "a point's id"));
    for (double& x : point.position) ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(x, "a point's position"));
    for (uint8_t& c : point.color) ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(c, "a point's colour"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Read(error, "a point's error"));
    if (!AllFinite(point.position)) return stream.Complain(Cat("point ", id, " has a position that is not finite"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.ReadCount(track, kTrackElement, "a point's number of images"));
    ANCHORSPLAT_RETURN_IF_ERROR(stream.Skip(track * kTrackElement));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ExpectEnd(stream));
  return points;
}

}  // namespace anchorsplat
