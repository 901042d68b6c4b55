#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
int PlyTypeSize(PlyType type);          // bytes in binary files
const char* PlyTypeName(PlyType type);  // "float"
inline bool IsFloating(PlyType type) { return type == PlyType::kFloat || type == PlyType::kDouble; }
float FullIntensity(PlyType type);  // full intensity of a colour: the largest value of the type, 1 for floats

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;     // of the list's items if `list_count` is set
  std::optional<PlyType> list_count;  // integer type of the count before each list
  int line = 0;                       // in the header, from 1
};

struct PlyElement {
  std::string name;
  int64_t count = 0;
  std::vector<PlyProperty> properties;
  int line = 0;

  bool has_lists() const;
  // Bytes of a row in a binary file; for lists the minimum (all empty).
  uint64_t row_size() const;
  const PlyProperty* Find(std::string_view property) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  // except those for render mode and origin; obj_info is dropped
  std::optional<RenderMode> render_mode;
  WorldOrigin origin = {0, 0, 0};              // of the positions
  std::vector<std::string> unknown_mode_tags;  // comments that look like a render mode tag but have no known value
  uint64_t body = 0;                           // offset of the data
  int lines = 0;                               // of the header, including end_header

  const PlyElement* Find(std::string_view element) const;
};

// Reads a PLY header. Lines end in LF, CR LF or CR. The header must end within kMaxPlyHeader bytes, so that other files
// are not searched to their end. Errors (kBadFile) give the line.
inline constexpr size_t kMaxPlyHeader = size_t{1} << 20;
Result<PlyHeader> ReadPlyHeader(const InputFile& file);

// Header lines for a splat's comments (control bytes become spaces, as a line end would turn the rest into header
// lines), render mode and, if not zero, origin of its means.
std::string PlyComments(std::span<const std::string> comments, std::optional<RenderMode> render_mode,
                        const WorldOrigin& origin);

// Warns of unknown render mode tags, and of the mode used instead. For readers of Gaussians.
void WarnOfUnknownModeTags(const InputFile& file, const PlyHeader& header);

}  // namespace anchorsplat
