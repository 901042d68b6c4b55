#include "cameras/poses_bounds.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/camera_checks.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/picture_names.h"
#include "io/file_bytes.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostBytes = uint64_t{1} << 28;  // 1.5 million views
constexpr size_t kRow = 17;

// An array of doubles or floats in NumPy's format 1.0 to 3.0
// (numpy.org/doc/stable/reference/generated/numpy.lib.format.html).
struct NumpyArray {
  int item = 0;  // bytes
  bool swapped = false, column_major = false;
  uint64_t rows = 0, columns = 0;
  size_t begin = 0;  // byte of the data
};

// The text after "'key':" in the header's dictionary, which is written by repr().
std::string_view ValueOf(std::string_view header, std::string_view key) {
  const size_t at = header.find(Cat("'", key, "':"));
  if (at == std::string_view::npos) return {};
  std::string_view rest = header.substr(at + key.size() + 3);
  while (rest.starts_with(' ')) rest.remove_prefix(1);
  return rest;
}

Result<NumpyArray> ReadHeader(const std::string& name, std::string_view bytes) {
  const auto bad = [&](size_t byte, const std::string& sentence) {
    return Error{ErrorCode::kBadFile, Cat(name, ": byte ", byte, ": ", sentence)};
  };
  if (bytes.size() < 12 || !bytes.starts_with("\x93NUMPY")) return bad(0, "not a NumPy array (.npy)");
  const auto byte = [&](size_t i) { return static_cast<size_t>(static_cast<unsigned char>(bytes[i])); };
  NumpyArray array;
  const bool wide = byte(6) >= 2;
  const size_t length = byte(8) | byte(9) << 8 | (wide ? byte(10) << 16 | byte(11) << 24 : 0);
  array.begin = (wide ? 12 : 10) + length;
  if (array.begin > bytes.size()) return bad(8, Cat("a header of ", length, " bytes that ends beyond the file"));
  const std::string_view header = bytes.substr(wide ? 12 : 10, length);
  const std::string_view type = ValueOf(header, "descr"), order = ValueOf(header, "fortran_order");
  if (type.size() < 5 || type[0] != '\'' || type[2] != 'f' || (type[3] != '8' && type[3] != '4') || type[4] != '\'') {
    return bad(10, Cat("expected 'descr' of doubles ('<f8') or floats, found ", Printable(std::string(type), 12)));
  }
  array.item = type[3] - '0';
  if (type[1] != '<' && type[1] != '>' && type[1] != '=') return bad(10, "unknown byte order");
  array.swapped = (type[1] == '>') != (std::endian::native == std::endian::big);
  array.column_major = order.starts_with("True");
  const std::string_view shape = ValueOf(header, "shape");
  if (!shape.starts_with('(')) return bad(10, "'shape' is missing");
  const char* at = shape.data() + 1;
  const char* const end = shape.data() + shape.size();
  const auto number = [&](uint64_t& out) {
    while (at < end && *at == ' ') ++at;
    if (at >= end) return false;
    const auto [next, code] = std::from_chars(at, end, out);
    if (code != std::errc()) return false;
    at = next;
    return true;
  };
  if (!number(array.rows) || at >= end || *at++ != ',' || !number(array.columns) || at >= end || *at != ')' ||
      array.columns != kRow) {
    return bad(10, Cat("expected 'shape' (views, 17), found ", Printable(std::string(shape), 24)));
  }
  const uint64_t available = (bytes.size() - array.begin) / (kRow * static_cast<uint64_t>(array.item));
  if (array.rows > available) {
    return bad(array.begin, Cat("an array of ", array.rows, " views, but the file ends after ", available));
  }
  return array;
}

double NumberAt(std::string_view bytes, const NumpyArray& array, uint64_t row, uint64_t column) {
  const uint64_t index = array.column_major ? column * array.rows + row : row * kRow + column;
  char item[8];
  const auto size = static_cast<size_t>(array.item);
  std::memcpy(item, bytes.data() + array.begin + index * size, size);
  if (array.swapped) std::reverse(item, item + size);
  if (size == 8) {
    double value;
    std::memcpy(&value, item, size);
    return value;
  }
  float value;
  std::memcpy(&value, item, size);
  return value;
}

// Images of a folder, sorted by name; subfolders are ignored.
Result<std::vector<fs::path>> PicturesBeside(const fs::path& file) {
  std::vector<fs::path> pictures;
  const fs::path base = file.has_parent_path() ? file.parent_path() : fs::path(".");
  for (const char* name : {"images", "images_2", "images_4", "images_8"}) {
    if (!IsFolder(base / name)) continue;
    std::error_code code;
    for (fs::directory_iterator it(base / name, code), end; !code && it != end; it.increment(code)) {
      if (HasPictureExtension(it->path())) pictures.push_back(it->path());
    }
    if (code) return Error{ErrorCode::kIo, Cat((base / name).string(), ": ", code.message())};
    break;
  }
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

Result<Camera> CameraOf(const std::array<double, kRow>& v) {
  const auto bad = [](std::string sentence) { return Error{ErrorCode::kBadFile, std::move(sentence)}; };
  const double height = v[4], width = v[9], focal = v[14];
  if (!(width >= 1 && width <= kMaxImageSide && height >= 1 && height <= kMaxImageSide) || width != std::floor(width) ||
      height != std::floor(height)) {
    return bad(Cat("size ", width, " x ", height, ", expected whole numbers of pixels"));
  }
  Camera camera;
  camera.intrinsics = {static_cast<int>(width), static_cast<int>(height), focal, focal, 0.5 * width, 0.5 * height};
  ANCHORSPLAT_RETURN_IF_ERROR(CheckIntrinsics(camera.intrinsics));
  // From columns down, right, back to OpenGL's right, up, back.
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera,
                               PoseFromOpenGlCameraToWorld({v[1], -v[0], v[2], v[3], v[6], -v[5], v[7], v[8], v[11],
                                                            -v[10], v[12], v[13], 0, 0, 0, 1}));
  return camera;
}

}  // namespace

Result<CameraSet> ReadPosesBounds(const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path, kMostBytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<fs::path> pictures, PicturesBeside(path));
  return ParsePosesBounds(path.string(), bytes, pictures);
}

Result<CameraSet> ParsePosesBounds(const std::string& name, std::string_view bytes,
                                   std::span<const fs::path> pictures) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const NumpyArray array, ReadHeader(name, bytes));
  if (array.rows == 0) return Error{ErrorCode::kBadFile, Cat(name, ": no views")};
  if (!pictures.empty() && pictures.size() != array.rows) {
    return Error{ErrorCode::kBadFile,
                 Cat(name, ": has ", array.rows, " views, but ", pictures.front().parent_path().string(), " has ",
                     pictures.size(), " pictures; they are matched by order, so the counts must agree")};
  }
  CameraSet set;
  set.source = CameraSource::kLlff;
  for (uint64_t row = 0; row < array.rows; ++row) {
    std::array<double, kRow> values{};
    for (size_t k = 0; k < kRow; ++k) values[k] = NumberAt(bytes, array, row, k);
    auto camera = CameraOf(values);
    if (!camera.ok()) {
      return Error{ErrorCode::kBadFile, Cat(name, ": view ", row, ": ", camera.error().message)};
    }
    if (pictures.empty()) {
      char number[24];
      std::snprintf(number, sizeof number, "%03llu",
                    static_cast<unsigned long long>(row));  // NOLINT(google-runtime-int)
      camera->name = number;
    } else {
      camera->image = pictures[row];
      camera->name = ViewName(pictures[row].filename().string());
      const fs::path folder = pictures[row].parent_path();
      camera->photograph.mask = FindMask({&folder, 1}, pictures[row].filename().string());
      RecordInput(pictures[row]);
    }
    set.cameras.push_back(*std::move(camera));
  }
  return set;
}

}  // namespace anchorsplat
