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

// Decodes the values in a SOG's images, and visits the images.

using SogChannel = std::array<float, 256>;  // value per byte

// Range of sign(p)·ln(1 + |p|) for means p.
struct SogMeanRange {
  std::vector<double> min, max;  // [3]
};

// 64 entries per row, each 3, 8 or 15 pixels.
struct SogPalette {
  int degree = 0;
  ByteImage picture;
  int64_t entries = 0;
};

// Unpacks `count` pixels, `stride` bytes apart, to as many rows.
void UnpackSogMeans(const SogMeanRange& range, const uint8_t* low, const uint8_t* high, size_t stride, int64_t count,
                    float* means);
void UnpackSogQuats(const uint8_t* pixels, int64_t count, float* quats);  // 4 bytes per pixel
void UnpackSogScales(const std::vector<SogChannel>& channels, const uint8_t* pixels, size_t stride, int64_t count,
                     float* log_scales);
// 4 bytes per pixel: colour and opacity. Rows of `dc` are `dc_stride` floats apart.
void UnpackSogColors(const std::vector<SogChannel>& channels, const uint8_t* pixels, int64_t count, float* dc,
                     int64_t dc_stride, float* opacity_logits);

// Receives the images of a SOG in order. Each has at least a pixel per Gaussian, as checked before Begin.
class SogVisitor {
 public:
  virtual ~SogVisitor() = default;
  virtual void Begin(int64_t count, int sh_degree) = 0;
  virtual void Quats(ByteImage picture) = 0;
  virtual void Means(SogMeanRange range, ByteImage low, ByteImage high) = 0;
  virtual void Scales(std::vector<SogChannel> channels, ByteImage picture) = 0;
  virtual void Colors(std::vector<SogChannel> channels, ByteImage picture) = 0;
  // Degree 1 to 3. Labels (the first two bytes of a pixel) are entries of the palette.
  virtual void Harmonics(const SogChannel& values, const ByteImage& labels, const SogPalette& palette) = 0;
  virtual void End(std::optional<RenderMode> mode, std::vector<std::string> comments) = 0;
};

// Names of unknown members of a meta.json.
std::vector<std::string> OtherSogEntries(const JsonValue& meta);

// Reads a SOG. Errors: those of ReadSog.
Status VisitSog(const InputFile& file, const ReadLimits& limits, SogVisitor& visitor);

inline constexpr int64_t kSogEntriesPerRow = 64;  // in the palette's image

}  // namespace anchorsplat
