#include "formats/sog/sog_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/json_asset.h"
#include "formats/quantize.h"
#include "formats/sog/scalar_codebook.h"
#include "formats/sog/sh_palette.h"
#include "formats/splat_order.h"
#include "formats/write_losses.h"
#include "images/webp_image.h"
#include "io/atomic_file.h"
#include "io/zip_archive.h"

namespace anchorsplat {

namespace {

constexpr int64_t kSogWriteGrain = 1 << 14;
constexpr int64_t kSogEntriesPerRow = 64;
constexpr int64_t kMaxSide = 16383;  // WebP limit
constexpr int kPaletteRounds = 8;    // further ones reduce the error by less than 0.5 %
constexpr float kMaxSogLogScale = 20;
// The encoder needs about 50 bytes per pixel. Larger images are compressed and written one by one, so that a conversion
// stays within 1.3 × the cloud.
constexpr int64_t kLargePicture = 1 << 20;

// An image that is generated on demand: all at once would take a fifth of the cloud.
struct Picture {
  std::string name;
  std::function<ByteImage()> draw;
};

struct Pictures {
  const CloudView& cloud;
  Buffer<uint32_t> order;
  int width, height;

  int64_t row(int64_t i) const { return order.empty() ? i : int64_t{order[static_cast<size_t>(i)]}; }

  // An image with a pixel per Gaussian; pixel(row, rgba) sets what differs from 0 0 0 255.
  template <typename Pixel>
  ByteImage Draw(Pixel&& pixel) const {
    ByteImage image{width, height, {}};
    image.rgba.resize(static_cast<size_t>(4 * image.pixels()));
    ParallelFor(0, image.pixels(), kSogWriteGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) {
        uint8_t* rgba = image.rgba.data() + 4 * i;
        rgba[0] = rgba[1] = rgba[2] = 0;
        rgba[3] = 255;
        if (i < cloud.size()) pixel(row(i), rgba);
      }
    });
    return image;
  }
};

constexpr std::array<const char*, 7> kPictures = {
    "shN_centroids.webp", "shN_labels.webp", "means_l.webp", "means_u.webp", "quats.webp", "scales.webp", "sh0.webp"};

double LogOfMean(float x) { return std::copysign(std::log1p(std::fabs(double{x})), double{x}); }

// Range of the means' logarithms, per axis.
struct MeanRange {
  std::array<double, 3> min{}, max{};
};

MeanRange RangeOfMeans(const CloudView& cloud) {
  MeanRange range;
  const std::optional<Bounds> bounds = ComputeBounds(cloud);
  for (size_t k = 0; bounds && k < 3; ++k) {
    range.min[k] = LogOfMean(bounds->min[k]);
    range.max[k] = LogOfMean(bounds->max[k]);
  }
  return range;
}

constexpr double kMeanSteps = 65535;

nlohmann::json DrawMeans(const Pictures& pictures, std::vector<Picture>& out) {
  const CloudView& cloud = pictures.cloud;
  const auto [min, max] = RangeOfMeans(cloud);
  const auto bits = [&cloud, min = min, max = max](int64_t row, size_t k) -> uint32_t {
    if (!(max[k] > min[k])) return 0;
    const double t = (LogOfMean(cloud.means[static_cast<size_t>(3 * row) + k]) - min[k]) / (max[k] - min[k]);
    return t > 0 ? static_cast<uint32_t>(std::lrint(kMeanSteps * std::min(t, 1.0))) : 0;  // NaN: 0
  };
  for (const auto& [name, shift] : {std::pair("means_l.webp", 0), std::pair("means_u.webp", 8)}) {
    out.push_back({name, [&pictures, bits, by = shift] {
                     return pictures.Draw([&](int64_t row, uint8_t* rgba) {
                       for (size_t k = 0; k < 3; ++k) rgba[k] = static_cast<uint8_t>(bits(row, k) >> by & 255);
                     });
                   }});
  }
  return {{"mins", min}, {"maxs", max}, {"files", {"means_l.webp", "means_u.webp"}}};
}

nlohmann::json DrawQuats(const Pictures& pictures, std::vector<Picture>& out) {
  out.push_back({"quats.webp", [&pictures] {
                   return pictures.Draw([&](int64_t row, uint8_t* rgba) {
                     const SmallestThree three = DropLargest(pictures.cloud.quats.data() + 4 * row, 0);
                     for (size_t k = 0; k < 3; ++k) rgba[k] = QuantizeByte(127.5f * (three.rest[k] / kSqrtHalf + 1));
                     rgba[3] = static_cast<uint8_t>(252 + three.largest);
                   });
                 }});
  return {{"files", {"quats.webp"}}};
}

float BoundedLogScale(float x) { return std::clamp(x, -kMaxSogLogScale, kMaxSogLogScale); }  // NaN stays

nlohmann::json DrawScales(const Pictures& pictures, std::vector<Picture>& out) {
  const CloudView& cloud = pictures.cloud;
  Buffer<float> scales(cloud.log_scales.size());
  ParallelFor(0, static_cast<int64_t>(scales.size()), kSogWriteGrain, [&](int64_t first, int64_t last) {
    for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
      scales[i] = BoundedLogScale(cloud.log_scales[i]);
    }
  });
  const ScalarCodebook codebook = BuildScalarCodebook(scales.data(), cloud.size(), 3, 3);
  out.push_back({"scales.webp", [&pictures, codebook] {
                   return pictures.Draw([&](int64_t row, uint8_t* rgba) {
                     const float* log_scales = pictures.cloud.log_scales.data() + 3 * row;
                     for (size_t k = 0; k < 3; ++k) rgba[k] = codebook.IndexOf(BoundedLogScale(log_scales[k]));
                   });
                 }});
  return {{"codebook", codebook.values}, {"files", {"scales.webp"}}};
}

nlohmann::json DrawColors(const Pictures& pictures, std::vector<Picture>& out) {
  const CloudView& cloud = pictures.cloud;
  const ScalarCodebook codebook = BuildScalarCodebook(cloud.sh.data(), cloud.size(), 3, cloud.sh_stride());
  out.push_back({"sh0.webp", [&pictures, &cloud, codebook] {
                   return pictures.Draw([&](int64_t row, uint8_t* rgba) {
                     const float* dc = cloud.sh.data() + row * cloud.sh_stride();
                     for (size_t k = 0; k < 3; ++k) rgba[k] = codebook.IndexOf(dc[k]);
                     rgba[3] = OpacityByte(cloud.opacity_logits[static_cast<size_t>(row)]);
                   });
                 }});
  return {{"codebook", codebook.values}, {"files", {"sh0.webp"}}};
}

// Number of palette entries, as in other programs.
int64_t PaletteEntries(int64_t count) {
  const auto thousands = static_cast<uint64_t>(std::max<int64_t>(1, count / 1024));
  return static_cast<int64_t>(1024 * std::min<uint64_t>(64, std::bit_floor(thousands)));
}

nlohmann::json DrawHarmonics(const Pictures& pictures, std::vector<Picture>& out) {
  const CloudView& cloud = pictures.cloud;
  ShPalette palette = BuildShPalette(cloud, PaletteEntries(cloud.size()), kPaletteRounds);
  const int64_t coefficients = cloud.coefficients() - 1;
  const ScalarCodebook codebook =
      BuildScalarCodebook(palette.centroids.data(), palette.entries, 3 * coefficients, 3 * coefficients);
  const nlohmann::json meta = {{"count", palette.entries},
                               {"bands", cloud.sh_degree},
                               {"codebook", codebook.values},
                               {"files", {"shN_centroids.webp", "shN_labels.webp"}}};
  const auto shared = std::make_shared<const ShPalette>(std::move(palette));
  out.push_back({"shN_centroids.webp", [shared, codebook, coefficients] {
                   ByteImage image{static_cast<int>(kSogEntriesPerRow * coefficients),
                                   static_cast<int>((shared->entries + kSogEntriesPerRow - 1) / kSogEntriesPerRow),
                                   {}};
                   image.rgba.assign(static_cast<size_t>(4 * image.pixels()), 255);
                   // Entries are contiguous and rows hold 64 of them, so the image is one run of pixels.
                   for (int64_t i = 0; i < shared->entries * coefficients; ++i) {
                     for (int64_t k = 0; k < 3; ++k) {
                       image.rgba[static_cast<size_t>(4 * i + k)] =
                           codebook.IndexOf(shared->centroids[static_cast<size_t>(3 * i + k)]);
                     }
                   }
                   return image;
                 }});
  out.push_back({"shN_labels.webp", [&pictures, shared] {
                   return pictures.Draw([&](int64_t row, uint8_t* rgba) {
                     const uint16_t label = shared->labels[static_cast<size_t>(row)];
                     rgba[0] = static_cast<uint8_t>(label & 255);
                     rgba[1] = static_cast<uint8_t>(label >> 8);
                   });
                 }});
  return meta;
}

}  // namespace

std::span<const char* const> SogPictures(int sh_degree) { return std::span(kPictures).subspan(sh_degree > 0 ? 0 : 2); }

std::vector<std::filesystem::path> SogFilesBeside(const std::filesystem::path& path, int sh_degree) {
  std::vector<std::filesystem::path> names;
  if (path.filename() != "meta.json") return names;  // one archive
  for (const char* name : SogPictures(sh_degree)) names.push_back(path.parent_path() / name);
  return names;
}

Status WriteSog(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  // Multiples of four, like other programs.
  const int64_t width = static_cast<int64_t>(std::ceil(std::sqrt(static_cast<double>(cloud.size())) / 4)) * 4;
  const int64_t height = (cloud.size() + 4 * width - 1) / (4 * width) * 4;
  if (width > kMaxSide || height > kMaxSide) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": ", WithThousands(cloud.size()), " Gaussians do not fit into a WebP picture")};
  }
  const std::vector<std::filesystem::path> names = SogFilesBeside(path, cloud.sh_degree);
  const bool bundled = names.empty();
  // Checked before the work, to fail early.
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  std::vector<OutputFile> beside;
  for (const std::filesystem::path& name : names) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile picture, OutputFile::Create(name, options.overwrite, options.memory));
    beside.push_back(std::move(picture));
  }

  const Pictures pictures{cloud, WriteOrder(cloud, options.order, SplatOrder::kMorton), static_cast<int>(width),
                          static_cast<int>(height)};
  nlohmann::json meta = {{"version", 2}, {"asset", AssetOf(cloud.comments, cloud.origin)}, {"count", cloud.size()}};
  if (IsCompensated(cloud.render_mode)) meta["model"] = "antialiased";  // as in splat-transform
  std::vector<Picture> drawn;
  if (cloud.sh_degree > 0) meta["shN"] = DrawHarmonics(pictures, drawn);
  meta["means"] = DrawMeans(pictures, drawn);
  meta["quats"] = DrawQuats(pictures, drawn);
  meta["scales"] = DrawScales(pictures, drawn);
  meta["sh0"] = DrawColors(pictures, drawn);

  const std::string text = meta.dump();
  std::optional<ZipWriter> archive;
  if (bundled) {
    archive.emplace(file);
    ANCHORSPLAT_RETURN_IF_ERROR(archive->Add("meta.json", text));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(file.Write(text));
  }
  const size_t at_once = width * height > kLargePicture ? 1 : drawn.size();
  for (size_t next = 0; next < drawn.size(); next += at_once) {
    std::vector<Result<std::string>> encoded(std::min(at_once, drawn.size() - next), std::string());
    ParallelFor(0, static_cast<int64_t>(encoded.size()), 1, [&](int64_t first, int64_t last) {
      for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
        encoded[k] = EncodeWebp(drawn[next + k].draw());
        drawn[next + k].draw = {};  // frees its captures
      }
    });
    for (size_t k = 0; k < encoded.size(); ++k) {
      if (!encoded[k].ok()) {
        return Error{encoded[k].error().code, Cat(path.string(), ": ", encoded[k].error().message)};
      }
      ANCHORSPLAT_RETURN_IF_ERROR(bundled ? archive->Add(drawn[next + k].name, *encoded[k])
                                          : beside[next + k].Write(*encoded[k]));
    }
  }
  if (!bundled) {
    beside.push_back(std::move(file));  // last: without it, images are not a splat
    return CommitTogether(beside);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(archive->Finish());
  return file.Commit();
}

uint64_t EstimatedSogSize(int64_t count, int sh_degree) {
  constexpr double kMetaBytes = 15'000, kBytes = 12.9, kLabelBytes = 1.95, kBytesPerCentroidValue = 0.79;
  const auto n = static_cast<double>(count);
  double size = kMetaBytes + kBytes * n;
  if (sh_degree > 0) {
    const double values = 3.0 * (ShCoefficients(sh_degree) - 1);
    size +=
        kLabelBytes * n + kBytesPerCentroidValue * values * static_cast<double>(std::min(count, PaletteEntries(count)));
  }
  return static_cast<uint64_t>(size);
}

Strays SogStrays(const CloudView& cloud) {
  return ChooseStrays(
      cloud, [](double reach) { return 2 * std::log1p(reach) / kMeanSteps; }, [](double reach) { return 1 + reach; });
}

std::string SogMeanLoss(const CloudView& cloud) {
  const MeanRange range = RangeOfMeans(cloud);
  double widest = 0;
  for (size_t k = 0; k < 3; ++k) widest = std::max(widest, range.max[k] - range.min[k]);
  const MiddleOfMeans middle = FindMiddleOfMeans(cloud);
  const double step = widest / kMeanSteps * (1 + double{middle.farthest});  // where the middle is coarsest
  constexpr double kFine = 1 << 12;
  if (step * kFine <= double{middle.extent}) return {};
  return Cat("positions are rounded to steps of up to ", step, ", while 98 % of the Gaussians lie within a box of ",
             middle.extent, " (a PLY or a compressed PLY keeps them better)");
}

}  // namespace anchorsplat
