#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/colmap_model.h"
#include "core/finite.h"
#include "core/number_text.h"
#include "core/text.h"
#include "core/words.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

// images.txt lists every feature point and can reach gigabytes, but a line this long is more likely another format.
constexpr uint64_t kMaxTextBytes = uint64_t{4} << 30;

class Lines {
 public:
  Lines(std::string name, std::string_view text) : name_(std::move(name)), rest_(text) {}

  // The next line without its end; false at the end.
  bool Next(std::string_view& line) {
    if (rest_.empty()) return false;
    const size_t end = rest_.find('\n');
    line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    return true;
  }

  // The next line that is neither empty nor a comment.
  bool NextStatement(std::string_view& line) {
    while (Next(line)) {
      size_t first = 0;
      while (first < line.size() && IsBlank(line[first])) ++first;
      if (first < line.size() && line[first] != '#') return true;
    }
    return false;
  }

  Error Complain(const std::string& sentence) const {
    return Error{ErrorCode::kBadFile, Cat(name_, ": line ", number_, ": ", sentence)};
  }

 private:
  std::string name_;
  std::string_view rest_;
  int64_t number_ = 0;
};

template <typename T>
Status TakeNumber(const Lines& lines, std::string_view& line, const char* what, T& out) {
  const std::string_view word = TakeWord(line);
  const auto [end, code] = FromChars(word.data(), word.data() + word.size(), out);
  if (word.empty()) return lines.Complain(Cat("ends before ", what));
  if (code != std::errc() || end != word.data() + word.size()) {
    return lines.Complain(Cat("expected ", what, ", found \"", Printable(std::string(word)), "\""));
  }
  return {};
}

// Checks a line of feature points (X Y POINT3D_ID each). They are unused, but another kind of line means that the file
// lost the empty lines of images without points, and every second image would be skipped.
Status CheckPoints(const Lines& lines, std::string_view line) {
  size_t count = 0;
  for (std::string_view word = TakeWord(line); !word.empty(); word = TakeWord(line)) {
    ++count;
    double number = 0;
    const auto [end, code] = FromChars(word.data(), word.data() + word.size(), number);
    if (code == std::errc::invalid_argument || end != word.data() + word.size()) {
      return lines.Complain(Cat("expected the image's points (X Y POINT3D_ID), found \"", Printable(std::string(word)),
                                "\"; every image has two lines, the second of which may be empty"));
    }
  }
  if (count % 3 != 0) {
    return lines.Complain(Cat("expected the image's points (X Y POINT3D_ID), found ", count, " numbers"));
  }
  return {};
}

}  // namespace

Result<ColmapCameras> ReadColmapCamerasText(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxTextBytes));
  Lines lines(path.string(), text);
  ColmapCameras cameras;
  std::string_view line;
  while (lines.NextStatement(line)) {
    uint32_t id = 0;
    uint64_t width = 0, height = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the camera's id", id));
    const std::string name(TakeWord(line));
    const ColmapCameraModel* model = FindColmapCameraModel(name);
    if (model == nullptr) return lines.Complain(Cat("unknown camera model \"", Printable(name), "\""));
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the width in pixels", width));
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the height in pixels", height));
    std::vector<double> params(model->params);
    for (double& param : params) {
      ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, Cat(model->params, " parameters of ", name).c_str(), param));
    }
    if (!TakeWord(line).empty()) return lines.Complain(Cat(name, " has ", model->params, " parameters, found more"));
    auto camera = CameraFromColmap(*model, width, height, params);
    if (!camera.ok()) return lines.Complain(Cat("camera ", id, ": ", camera.error().message));
    if (!cameras.emplace(id, *std::move(camera)).second) return lines.Complain(Cat("camera ", id, " is listed twice"));
  }
  return cameras;
}

Result<std::vector<Camera>> ReadColmapImagesText(const std::filesystem::path& path, const ColmapCameras& cameras) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxTextBytes));
  Lines lines(path.string(), text);
  std::vector<Camera> views;
  QuaternionNorms norms;
  std::string_view line;
  while (lines.NextStatement(line)) {
    uint32_t id = 0;
    ColmapImage image;
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the image's id", id));
    for (double& x : image.quaternion) {
      ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the quaternion QW QX QY QZ", x));
    }
    for (double& x : image.translation) {
      ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the translation TX TY TZ", x));
    }
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the camera's id", image.camera));
    // The rest of the line, as names may contain spaces.
    image.name = Trimmed(line);
    auto camera = ViewFromColmap(image, cameras);
    if (!camera.ok()) return lines.Complain(camera.error().message);
    norms.Add(image.quaternion);
    views.push_back(*std::move(camera));
    if (lines.Next(line)) ANCHORSPLAT_RETURN_IF_ERROR(CheckPoints(lines, line));
  }
  norms.Report(path);
  return views;
}

Result<size_t> CountColmapImagesText(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxTextBytes));
  Lines lines(path.string(), text);
  std::string_view line;
  size_t count = 0;
  for (; lines.NextStatement(line); ++count) (void)lines.Next(line);  // its points
  return count;
}

Result<std::vector<ColmapPoint>> ReadColmapPointsText(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path, kMaxTextBytes));
  Lines lines(path.string(), text);
  std::vector<ColmapPoint> points;
  std::string_view line;
  while (lines.NextStatement(line)) {
    uint64_t id = 0;
    ColmapPoint point;
    ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the point's id", id));
    for (double& x : point.position) ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the position X Y Z", x));
    for (uint8_t& c : point.color) {
      ANCHORSPLAT_RETURN_IF_ERROR(TakeNumber(lines, line, "the colour R G B, 0 to 255", c));
    }
    if (!AllFinite(point.position)) return lines.Complain(Cat("point ", id, " has a position that is not finite"));
    points.push_back(point);
    // The error and the track that follow are unused.
  }
  return points;
}

}  // namespace anchorsplat
