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
float FullIntensity(PlyType type);  // of a colour: the largest number of the type, 1 of floats

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;     // of a list's items when `list_count` is there
  std::optional<PlyType> list_count;  // integer type of the count before each list
  int line = 0;                       // of the header, from 1
};

struct PlyElement {
  std::string name;
  int64_t count = 0;
  std::vector<PlyProperty> properties;
  int line = 0;

  bool has_lists() const;
  // Bytes of a row in a binary file; with lists, the least it can have (all lists empty).
  uint64_t row_size() const;
  const PlyProperty* Find(std::string_view property) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  // without the tags of render mode and origin; obj_info is not kept
  std::optional<RenderMode> render_mode;
  WorldOrigin origin = {0, 0, 0};     // that the positions are from
  std::vector<std::string> odd_tags;  // those of the comments that look like a tag of the mode and say no known one
  uint64_t body = 0;                  // byte where the data begins
  int lines = 0;                      // of the header, end_header included

  const PlyElement* Find(std::string_view element) const;
};

// Reads the header of a PLY file: lines end in LF, CR LF or CR; the header must end within kMaxPlyHeader bytes, so that
// a file of another kind is not searched to its end. Errors (kBadFile) name the line.
inline constexpr size_t kMaxPlyHeader = size_t{1} << 20;
Result<PlyHeader> ReadPlyHeader(const InputFile& file);

// The lines of a header that say what a splat says of itself: its comments (control bytes become blanks, as a line end
// would turn the rest into header lines), its render mode and, without `origin` being zero, the origin of its means.
std::string PlyComments(std::span<const std::string> comments, std::optional<RenderMode> render_mode,
                        const WorldOrigin& origin);

// Says which of the header's tags are not understood, and what is taken instead. For who reads the Gaussians.
void WarnOfOddTags(const InputFile& file, const PlyHeader& header);

}  // namespace anchorsplat
