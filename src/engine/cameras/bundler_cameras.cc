#include "cameras/bundler_cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/lensed_pinhole.h"
#include "cameras/picture_search.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/number_text.h"
#include "core/rotation.h"
#include "core/text.h"
#include "core/words.h"
#include "images/image_io.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kBundlerHead = "# Bundle file v0.";
constexpr uint64_t kMostListBytes = uint64_t{64} << 20;

// Parses numbers separated by whitespace.
class BundlerText {
 public:
  BundlerText(std::string name, std::string_view text) : name_(std::move(name)), rest_(text) {}

  template <typename T>
  Status Take(const char* what, T& out) {
    while (!rest_.empty() && (IsBlank(rest_.front()) || rest_.front() == '\n')) {
      if (rest_.front() == '\n') ++line_;
      rest_.remove_prefix(1);
    }
    size_t size = 0;
    while (size < rest_.size() && !IsBlank(rest_[size]) && rest_[size] != '\n') ++size;
    const std::string_view word = rest_.substr(0, size);
    if (word.empty()) return Complain(Cat("ends before ", what));
    const auto [end, code] = FromChars(word.data(), word.data() + word.size(), out);
    bool good = code == std::errc() && end == word.data() + word.size();
    if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(out);
    if (!good) return Complain(Cat("expected ", what, ", found \"", Printable(std::string(word)), "\""));
    rest_.remove_prefix(size);
    return {};
  }
  void SkipLine() {
    const size_t end = rest_.find('\n');
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++line_;
  }
  size_t left() const { return rest_.size(); }
  Error Complain(const std::string& sentence) const {
    return Error{ErrorCode::kBadFile, Cat(name_, ": line ", line_, ": ", sentence)};
  }

 private:
  std::string name_;
  std::string_view rest_;
  int64_t line_ = 1;
};

struct BundlerCamera {
  double focal = 0, k1 = 0, k2 = 0;  // focal length in pixels; 0: not registered
  Pose pose;                         // OpenCV's axes
};

// A number is followed by whitespace, which bounds counts by the file size.
constexpr uint64_t kNumbersPerCamera = 15;

Result<std::vector<BundlerCamera>> BundlerCameras(BundlerText& text) {
  text.SkipLine();
  uint64_t count = 0, points = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(text.Take("the number of cameras", count));
  ANCHORSPLAT_RETURN_IF_ERROR(text.Take("the number of points", points));
  if (count > text.left() / (2 * kNumbersPerCamera - 1)) {
    return text.Complain(Cat("has too few bytes for the ", count, " cameras in its header"));
  }
  std::vector<BundlerCamera> cameras(count);
  for (BundlerCamera& camera : cameras) {
    ANCHORSPLAT_RETURN_IF_ERROR(text.Take("a focal length", camera.focal));
    ANCHORSPLAT_RETURN_IF_ERROR(text.Take("k1", camera.k1));
    ANCHORSPLAT_RETURN_IF_ERROR(text.Take("k2", camera.k2));
    std::array<double, 9> r{};
    std::array<double, 3> t{};
    for (double& x : r) ANCHORSPLAT_RETURN_IF_ERROR(text.Take("a number of the rotation", x));
    for (double& x : t) ANCHORSPLAT_RETURN_IF_ERROR(text.Take("a number of the translation", x));
    if (camera.focal == 0) continue;
    if (!(camera.focal > 0)) return text.Complain(Cat("focal length ", camera.focal, ", expected a positive number"));
    for (size_t i = 3; i < 9; ++i) r[i] = -r[i];  // from axes y up, z backward
    // Only checks that it is a rotation.
    const auto checked = PoseFromCameraToWorld({r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}, {0, 0, 0});
    if (!checked.ok()) return text.Complain(checked.error().message);
    camera.pose = {NearestRotation(r), {t[0], -t[1], -t[2]}};
  }
  return cameras;
}

// Candidate image lists, in search order.
std::vector<std::filesystem::path> Lists(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  std::string stem = file.stem().string();
  std::vector<std::filesystem::path> lists;
  if (stem.ends_with(".bundle")) stem.resize(stem.size() - 7);
  if (stem != "bundle") {
    for (const char* end : {".list.txt", "-list.txt", "_list.txt", ".txt"}) lists.push_back(folder / (stem + end));
  }
  lists.push_back(folder / "list.txt");
  lists.push_back((folder / ".." / "list.txt").lexically_normal());
  return lists;
}

// A line is a path, to which Bundler's tools append "0" and a focal length from EXIF.
std::string PathOfLine(std::string_view line) {
  line = Trimmed(line);
  const size_t last = line.rfind(' ');
  if (last != std::string_view::npos) {
    double focal = 0;
    const auto [end, code] = FromChars(line.data() + last + 1, line.data() + line.size(), focal);
    const std::string_view before = Trimmed(line.substr(0, last));
    if (code == std::errc() && end == line.data() + line.size() && before.ends_with(" 0")) {
      line = Trimmed(before.substr(0, before.size() - 2));
    }
  }
  return std::string(line);
}

Result<std::vector<std::string>> ReadList(const std::filesystem::path& list) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(list, kMostListBytes));
  std::vector<std::string> names;
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    if (const std::string_view line = Trimmed(rest.substr(0, end)); !line.empty()) names.push_back(PathOfLine(line));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  for (const std::string& name : names) {
    if (ViewName(name).empty() || name.find('\0') != std::string::npos) {
      return Error{ErrorCode::kBadFile, Cat(list.string(), ": contains a line that is not a picture path")};
    }
  }
  return names;
}

}  // namespace

bool LooksLikeBundler(std::string_view head) { return head.starts_with(kBundlerHead); }

Result<CameraSet> CamerasFromBundler(const std::filesystem::path& file, std::string_view bytes) {
  BundlerText text(file.string(), bytes);
  const std::string_view version = bytes.substr(std::min(kBundlerHead.size(), bytes.size()), 1);
  if (!LooksLikeBundler(bytes) || (version != "3" && version != "4")) {
    return text.Complain("expected \"# Bundle file v0.3\"");
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<BundlerCamera> cameras, BundlerCameras(text));
  const std::vector<std::filesystem::path> lists = Lists(file);
  const auto list = std::ranges::find_if(lists, IsFile);
  if (list == lists.end()) {
    return Error{ErrorCode::kNotFound, Cat(file.string(), ": picture list not found: expected ", lists.front().string(),
                                           " with one picture path per line, one line per camera")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<std::string> names, ReadList(*list));
  if (names.size() != cameras.size()) {
    return Error{ErrorCode::kBadFile,
                 Cat(list->string(), ": lists ", names.size(), " pictures, but ", file.string(), " has ",
                     cameras.size(), " cameras; they are matched by order, so the counts must agree")};
  }
  const std::vector<FoundPicture> pictures =
      FindPictures({.folders = FoldersOfPictures(list->parent_path()), .project = list->parent_path()}, names);
  CameraSet set;
  size_t registered = 0;
  std::string first_missing;
  std::map<std::array<double, 5>, LensedPinhole> known;  // by size, focal length, k1 and k2
  for (size_t i = 0; i < cameras.size(); ++i) {
    const BundlerCamera& camera = cameras[i];
    if (camera.focal == 0) continue;
    ++registered;
    const std::filesystem::path& picture = pictures[i].file;
    // the size comes from the image
    if (!pictures[i].ambiguity.empty()) return Error{ErrorCode::kBadArgument, pictures[i].ambiguity};
    if (!IsFile(picture)) {
      if (first_missing.empty()) first_missing = picture.string();
      continue;
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, ReadImageSize(picture));
    const std::array<double, 5> key = {static_cast<double>(size.width), static_cast<double>(size.height), camera.focal,
                                       camera.k1, camera.k2};
    if (!known.contains(key)) {
      const Pinhole distorted{size.width, size.height, camera.focal, camera.focal, 0.5 * size.width, 0.5 * size.height};
      auto through = ThroughLens({.model = LensModel::kRadial, .radial = {camera.k1, camera.k2, 0, 0}}, distorted);
      if (!through.ok()) {
        return Error{through.error().code,
                     Cat(file.string(), ": camera ", i, " (", Printable(names[i]), "): ", through.error().message)};
      }
      known[key] = *std::move(through);
    }
    const LensedPinhole& lensed = known[key];
    Camera view{pictures[i].name, picture, lensed.undistorted, camera.pose, lensed.photograph};
    view.photograph.mask = pictures[i].mask;
    set.cameras.push_back(std::move(view));
  }
  if (registered == 0)
    return Error{ErrorCode::kBadFile, Cat(file.string(), ": no camera is registered (every focal length is 0)")};
  if (set.cameras.empty()) {
    return Error{ErrorCode::kNotFound,
                 Cat(Printable(first_missing, 400), ": picture not found, nor any other picture of ", file.string(),
                     "; the camera sizes are taken from the pictures")};
  }
  if (registered < cameras.size()) {
    LogInfo(Cat(file.string(), ": ", cameras.size() - registered, " of ", cameras.size(),
                " cameras skipped: not registered (focal length 0)"));
  }
  if (set.cameras.size() < registered) {
    LogWarning(Cat(file.string(), ": ", registered - set.cameras.size(), " of ", registered,
                   " cameras skipped: their pictures, needed for the image size, are missing; the first is ",
                   Printable(first_missing, 400)));
  }
  return set;
}

}  // namespace anchorsplat
