#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/render_mode.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "images/webp_image.h"
#include "io/input_file.h"
#include "io/json_file.h"

namespace anchorsplat {

// What the bytes of a SOG's pictures stand for, and the pictures one after the other.

using SogChannel = std::array<float, 256>;  // by byte

// Of logarithms: sign(p)·ln(1 + |p|) of a mean p lies between them.
struct SogMeanRange {
  std::vector<double> min, max;  // [3]
};

// 64 entries of 3, 8 or 15 pixels in a row.
struct SogPalette {
  int degree = 0;
  ByteImage picture;
  int64_t entries = 0;
};

// `count` pixels, one every `stride` bytes, to as many rows.
void UnpackSogMeans(const SogMeanRange& range, const uint8_t* low, const uint8_t* high, size_t stride, int64_t count,
                    float* means);
void UnpackSogQuats(const uint8_t* pixels, int64_t count, float* quats);  // of 4 bytes
void UnpackSogScales(const std::vector<SogChannel>& channels, const uint8_t* pixels, size_t stride, int64_t count,
                     float* log_scales);
// Of 4 bytes: colour and opacity. Rows of `dc` are `dc_stride` floats apart.
void UnpackSogColors(const std::vector<SogChannel>& channels, const uint8_t* pixels, int64_t count, float* dc,
                     int64_t dc_stride, float* opacity_logits);

// Takes the pictures of a SOG in their order. Each has at least a pixel per Gaussian, checked before Begin.
class SogVisitor {
 public:
  virtual ~SogVisitor() = default;
  virtual void Begin(int64_t count, int sh_degree) = 0;
  virtual void Quats(ByteImage picture) = 0;
  virtual void Means(SogMeanRange range, ByteImage low, ByteImage high) = 0;
  virtual void Scales(std::vector<SogChannel> channels, ByteImage picture) = 0;
  virtual void Colors(std::vector<SogChannel> channels, ByteImage picture) = 0;
  // Of degree 1 to 3. Labels are entries of the palette: the first two bytes of their pixels.
  virtual void Harmonics(const SogChannel& values, const ByteImage& labels, const SogPalette& palette) = 0;
  virtual void End(std::optional<RenderMode> mode, std::vector<std::string> comments) = 0;
};

// The names of entries of a meta.json that the format does not have.
std::vector<std::string> OtherSogEntries(const JsonValue& meta);

// Errors as ReadSog.
Status VisitSog(const InputFile& file, const ReadLimits& limits, SogVisitor& visitor);

inline constexpr int64_t kSogEntriesPerRow = 64;  // of the palette

}  // namespace anchorsplat
