#include "formats/sog/sog_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "core/activations.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/json_asset.h"
#include "formats/quantize.h"
#include "formats/sog/sog_members.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

constexpr int64_t kSogReadGrain = 1 << 14;

// `count` numbers of an array. Rejects doubles beyond the range of floats, which would become infinite.
Result<std::vector<double>> FloatNumbers(const JsonValue& list, size_t count) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<double> values, list.Numbers(count));
  for (const double x : values) {
    if (std::fabs(x) > double{std::numeric_limits<float>::max()})
      return list.Complain(Cat("holds ", x, ", which is out of range"));
  }
  return values;
}

Result<SogChannel> Codebook(const JsonValue& part) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, part.Get("codebook"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> values, FloatNumbers(list, 256));
  SogChannel channel;
  std::ranges::transform(values, channel.begin(), [](double x) { return static_cast<float>(x); });
  return channel;
}

SogChannel Range(double min, double max) {
  SogChannel channel;
  for (size_t k = 0; k < channel.size(); ++k) {
    channel[k] = static_cast<float>(min + (max - min) * static_cast<double>(k) / 255);
  }
  return channel;
}

// Version 2: one codebook for all channels; version 1: a range per channel.
Result<std::vector<SogChannel>> Channels(const JsonValue& part, int version, size_t count) {
  if (version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const SogChannel channel, Codebook(part));
    return std::vector<SogChannel>(count, channel);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> min, FloatNumbers(mins, count));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> max, FloatNumbers(maxs, count));
  std::vector<SogChannel> channels;
  for (size_t k = 0; k < count; ++k) {
    if (min[k] > max[k])
      return part.Complain(Cat("has a range from ", min[k], " to ", max[k], ": the minimum is above the maximum"));
    channels.push_back(Range(min[k], max[k]));
  }
  return channels;
}

struct Sog {
  const SogMembers& members;
  JsonValue meta;
  int version;
  int64_t count;
  int width = 0, height = 0;  // of all images with a pixel per Gaussian, once known

  // Image k of the part's "files". Images have a pixel per Gaussian and at most some extra rows, and all the same size;
  // otherwise the files do not belong together.
  Result<ByteImage> Picture(const JsonValue& part, size_t k, size_t files) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, part.Get("files"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> names, list.Elements());
    if (names.size() < files) return list.Complain(Cat("expected ", files, " names, found ", names.size()));
    ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage picture, members.Picture(names[k], count, 4 * count + 65536));
    if (width > 0 && (picture.width != width || picture.height != height)) {
      return names[k].Complain(
          Cat("has ", picture.width, " x ", picture.height, " pixels, other pictures have ", width, " x ", height));
    }
    width = picture.width;
    height = picture.height;
    return picture;
  }
  // Version 1 gives the number of Gaussians per attribute.
  Status CheckShape(const JsonValue& part) const {
    const std::optional<JsonValue> shape = part.Find("shape");
    if (!shape) return {};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> sizes, shape->Elements());
    if (sizes.empty()) return shape->Complain("is empty, expected the number of Gaussians");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int said, sizes[0].WholeNumber(1, std::numeric_limits<int>::max()));
    if (said != count) return shape->Complain(Cat("says ", said, " Gaussians, but the means have ", count));
    return {};
  }
};

Status VisitMeans(Sog& sog, SogVisitor& visitor) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("means"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
  SogMeanRange range;
  ANCHORSPLAT_ASSIGN_OR_RETURN(range.min, mins.Numbers(3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(range.max, maxs.Numbers(3));
  // Logarithms: e⁸⁸ is the limit of floats.
  constexpr double kMaxLogarithm = 88;
  for (size_t k = 0; k < 3; ++k) {
    if (std::fabs(range.min[k]) > kMaxLogarithm)
      return mins.Complain(Cat("holds ", range.min[k], ", expected -88 to 88"));
    if (std::fabs(range.max[k]) > kMaxLogarithm)
      return maxs.Complain(Cat("holds ", range.max[k], ", expected -88 to 88"));
    if (range.min[k] > range.max[k]) {
      return part.Complain(
          Cat("has a range from ", range.min[k], " to ", range.max[k], ": the minimum is above the maximum"));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage low, sog.Picture(part, 0, 2));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage high, sog.Picture(part, 1, 2));
  visitor.Means(std::move(range), std::move(low), std::move(high));
  return {};
}

Status VisitScales(Sog& sog, SogVisitor& visitor) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("scales"));
  ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(part));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<SogChannel> channels, Channels(part, sog.version, 3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage picture, sog.Picture(part, 0, 1));
  visitor.Scales(std::move(channels), std::move(picture));
  return {};
}

Status VisitColors(Sog& sog, SogVisitor& visitor) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("sh0"));
  ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(part));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<SogChannel> channels, Channels(part, sog.version, sog.version == 2 ? 3 : 4));
  if (sog.version == 2) {
    channels.emplace_back();
    for (size_t k = 0; k < 256; ++k) channels[3][k] = LogitFromOpacity(static_cast<float>(k) / 255);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage picture, sog.Picture(part, 0, 1));
  visitor.Colors(std::move(channels), std::move(picture));
  return {};
}

// The palette's image, which gives the degree in version 1.
Result<SogPalette> ReadPalette(const Sog& sog, const JsonValue& part) {
  SogPalette palette;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, part.Get("files"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> names, list.Elements());
  if (names.size() < 2) return list.Complain(Cat("expected 2 names, found ", names.size()));
  constexpr int64_t kMost = int64_t{65536} * (ShCoefficients(kMaxShDegree) - 1);
  ANCHORSPLAT_ASSIGN_OR_RETURN(palette.picture, sog.members.Picture(names[0], 1, kMost + 65536));
  for (int degree = 1; degree <= kMaxShDegree; ++degree) {
    if (palette.picture.width == kSogEntriesPerRow * (ShCoefficients(degree) - 1)) palette.degree = degree;
  }
  if (palette.degree == 0) {
    return names[0].Complain(Cat("has a width of ", palette.picture.width, ", expected 192, 512 or 960"));
  }
  palette.entries = kSogEntriesPerRow * palette.picture.height;
  if (sog.version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue bands, part.Get("bands"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int degree, bands.WholeNumber(1, kMaxShDegree));
    if (degree != palette.degree) {
      return bands.Complain(Cat("is ", degree, ", but the palette has a width of ", palette.picture.width));
    }
    if (const std::optional<JsonValue> said = part.Find("count")) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const int entries, said->WholeNumber(1, 65536));
      if (entries > palette.entries) {
        return said->Complain(Cat("is ", entries, ", but the palette's picture has room for ", palette.entries));
      }
      palette.entries = entries;
    }
  }
  return palette;
}

Status VisitHarmonics(Sog& sog, const JsonValue& part, const SogPalette& palette, SogVisitor& visitor) {
  SogChannel values;
  if (sog.version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(values, Codebook(part));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double min, mins.Number());
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double max, maxs.Number());
    if (const std::optional<JsonValue> bits = part.Find("quantization"); bits && bits->raw() != 8) {
      return bits->Complain(Cat("is ", Printable(bits->raw().dump()), ", expected 8"));
    }
    if (min > max)
      return part.Complain(Cat("has a range from ", min, " to ", max, ": the minimum is above the maximum"));
    values = Range(min, max);
    for (const float x : values) {
      if (!std::isfinite(x)) return part.Complain(Cat("has a range of ", min, " to ", max));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage labels, sog.Picture(part, 1, 2));
  std::vector<char> bad(static_cast<size_t>((sog.count + kSogReadGrain - 1) / kSogReadGrain), 0);
  ParallelFor(0, sog.count, kSogReadGrain, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const uint8_t* pixel = labels.rgba.data() + 4 * i;
      if (pixel[0] + 256 * pixel[1] >= palette.entries) bad[static_cast<size_t>(first / kSogReadGrain)] = 1;
    }
  });
  if (std::ranges::find(bad, 1) != bad.end()) {
    return part.Complain(Cat("has labels beyond its palette of ", palette.entries, " entries"));
  }
  visitor.Harmonics(values, labels, palette);
  return {};
}

}  // namespace

void UnpackSogMeans(const SogMeanRange& range, const uint8_t* low, const uint8_t* high, size_t stride, int64_t count,
                    float* means) {
  for (int64_t i = 0; i < count; ++i, low += stride, high += stride) {
    for (size_t k = 0; k < 3; ++k) {
      const double t = (low[k] + 256 * high[k]) / 65535.0;
      const double logarithm = range.min[k] + (range.max[k] - range.min[k]) * t;
      *means++ = static_cast<float>(std::copysign(std::expm1(std::fabs(logarithm)), logarithm));
    }
  }
}

void UnpackSogQuats(const uint8_t* pixels, int64_t count, float* quats) {
  for (int64_t i = 0; i < count; ++i, pixels += 4, quats += 4) {
    SmallestThree three;  // identity if the mark is invalid
    if (pixels[3] >= 252) {
      three.largest = pixels[3] - 252u;
      for (size_t k = 0; k < 3; ++k) three.rest[k] = (static_cast<float>(pixels[k]) / 127.5f - 1) * kSqrtHalf;
    }
    RestoreLargest(three, quats);
  }
}

void UnpackSogScales(const std::vector<SogChannel>& channels, const uint8_t* pixels, size_t stride, int64_t count,
                     float* log_scales) {
  for (int64_t i = 0; i < count; ++i, pixels += stride) {
    for (size_t k = 0; k < 3; ++k) *log_scales++ = channels[k][pixels[k]];
  }
}

void UnpackSogColors(const std::vector<SogChannel>& channels, const uint8_t* pixels, int64_t count, float* dc,
                     int64_t dc_stride, float* opacity_logits) {
  for (int64_t i = 0; i < count; ++i, pixels += 4, dc += dc_stride) {
    for (size_t k = 0; k < 3; ++k) dc[k] = channels[k][pixels[k]];
    opacity_logits[i] = channels[3][pixels[3]];
  }
}

namespace {

// Only one packing of rotations exists; the fourth byte gives the omitted component.
Status CheckQuats(const InputFile& file, const JsonValue& part, const ByteImage& picture, int64_t count) {
  if (const std::optional<JsonValue> encoding = part.Find("encoding");
      encoding && encoding->raw() != "quaternion_packed") {
    return encoding->Complain(Cat("is ", Printable(encoding->raw().dump()), ", expected \"quaternion_packed\""));
  }
  int64_t unmarked = 0;
  for (int64_t i = 0; i < count; ++i) unmarked += picture.rgba[static_cast<size_t>(4 * i + 3)] < 252 ? 1 : 0;
  if (unmarked > 0) {
    LogWarning(Cat(file.name(), ": ", WithThousands(unmarked), " of ", WithThousands(count),
                   " rotations are invalid (fourth byte below 252): read as no rotation"));
  }
  return {};
}

void WarnOfMeta(const InputFile& file, const JsonValue& meta, const std::optional<JsonValue>& model) {
  if (model && model->raw() != "antialiased" && model->raw() != "default") {
    LogWarning(Cat(file.name(), ": unknown model ", Printable(model->raw().dump()), ": the splat is read as classic"));
  }
  WarnOfAxisEntries(file.name(), OtherSogEntries(meta));
}

}  // namespace

std::vector<std::string> OtherSogEntries(const JsonValue& meta) {
  constexpr std::array<std::string_view, 10> kKnown = {"version", "count", "asset", "means", "scales",
                                                       "quats",   "sh0",   "shN",   "model", "extras"};
  return OtherEntries(meta, kKnown);
}

Status VisitSog(const InputFile& file, const ReadLimits& limits, SogVisitor& visitor) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSog opened, OpenSog(file));
  const JsonValue meta = opened.json.root();
  const int most = static_cast<int>(std::min<int64_t>(limits.max_gaussians, int64_t{1} << 28));
  int version = 1, count = 0;
  if (const std::optional<JsonValue> value = meta.Find("version")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(version, value->WholeNumber(1, 2));
  }
  if (version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue number, meta.Get("count"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(count, number.WholeNumber(1, most));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue means, meta.Get("means"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue shape, means.Get("shape"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> sizes, shape.Elements());
    if (sizes.empty()) return shape.Complain("is empty, expected the number of Gaussians");
    ANCHORSPLAT_ASSIGN_OR_RETURN(count, sizes[0].WholeNumber(1, most));
  }
  Sog sog{opened.members, meta, version, count};
  // Images of the right size are checked before the cloud is allocated.
  const std::optional<JsonValue> harmonics = meta.Find("shN");
  SogPalette palette;
  if (harmonics && !harmonics->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(palette, ReadPalette(sog, *harmonics));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue quats, meta.Get("quats"));
  ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(quats));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ByteImage picture, sog.Picture(quats, 0, 1));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckQuats(file, quats, picture, count));
  visitor.Begin(count, palette.degree);
  visitor.Quats(std::move(picture));
  ANCHORSPLAT_RETURN_IF_ERROR(VisitMeans(sog, visitor));
  ANCHORSPLAT_RETURN_IF_ERROR(VisitScales(sog, visitor));
  ANCHORSPLAT_RETURN_IF_ERROR(VisitColors(sog, visitor));
  if (palette.degree > 0) ANCHORSPLAT_RETURN_IF_ERROR(VisitHarmonics(sog, *harmonics, palette, visitor));
  std::optional<RenderMode> mode;
  const std::optional<JsonValue> model = meta.Find("model");
  if (model && model->raw() == "antialiased") mode = RenderMode::kAntialiased;
  WarnOfMeta(file, meta, model);
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::string> comments, CommentsOfAsset(meta));
  visitor.End(mode, std::move(comments));
  return {};
}

}  // namespace anchorsplat
