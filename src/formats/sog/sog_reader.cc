#include "formats/sog/sog_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/json_asset.h"
#include "formats/quantize.h"
#include "images/webp_image.h"
#include "io/compression_ratio.h"
#include "io/input_record.h"
#include "io/json_file.h"
#include "io/zip_archive.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxArchive = uint64_t{8} << 30;
constexpr uint64_t kMaxMeta = uint64_t{4} << 20;
constexpr uint64_t kMaxPicture = uint64_t{1} << 30;
constexpr int64_t kSogReadGrain = 1 << 14;
constexpr int64_t kEntriesPerRow = 64;  // of the palette

// Beside meta.json there is nothing to look for in other folders.
bool IsPlainName(const std::string& member) {
  return !member.empty() && member.find_first_of("/\\:") == member.npos && !member.starts_with(".") &&
         member.find('\0') == member.npos;
}

// Where the members are: in an archive, or beside meta.json. Not longer there than the file.
class Members {
 public:
  static Result<Members> Of(const InputFile& file) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
    Members members;
    members.name_ = file.name();
    if (head == "PK") {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view bytes, file.Whole(kMaxArchive));
      ANCHORSPLAT_ASSIGN_OR_RETURN(ZipReader archive, ZipReader::View(file.name(), bytes));
      members.archive_.emplace(std::move(archive));
    } else {
      members.file_ = &file;
      members.folder_ = file.path().parent_path();
    }
    return members;
  }

  Result<std::string> Meta(const InputFile& file) const {
    return archive_ ? archive_->Read("meta.json", kMaxMeta) : file.ReadAll(kMaxMeta);
  }
  bool is_archive() const { return archive_.has_value(); }
  // Bytes of a file of the folder; 0 where it is none.
  uint64_t SizeBeside(const std::string& name) const {
    std::error_code failed;
    const uint64_t size = IsPlainName(name) ? std::filesystem::file_size(folder_ / name, failed) : 0;
    if (size > 0) RecordInput(folder_ / name);
    return failed ? 0 : size;
  }
  std::string meta_name() const { return archive_ ? name_ + ": meta.json" : name_; }

  // The picture called `name`.
  Result<ByteImage> Picture(const JsonValue& name, int64_t min_pixels, int64_t max_pixels) const {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string member, name.Text());
    if (!IsPlainName(member)) {
      return name.Complain(Cat("expected the name of a file beside it, found \"", Printable(member), "\""));
    }
    std::string bytes;
    if (archive_) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(bytes, archive_->Read(member, kMaxPicture));
    } else {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, file_->OpenBeside(member));
      ANCHORSPLAT_ASSIGN_OR_RETURN(bytes, file.ReadAll(kMaxPicture));
    }
    const std::string where = archive_ ? Cat(name_, ": ", member) : (folder_ / member).string();
    ANCHORSPLAT_RETURN_IF_ERROR(CheckRatio(where, bytes.size(), static_cast<uint64_t>(min_pixels) * 2));
    return DecodeWebp(where, bytes, min_pixels, max_pixels);
  }

 private:
  std::string name_;
  std::optional<ZipReader> archive_;
  const InputFile* file_ = nullptr;  // meta.json itself, and
  std::filesystem::path folder_;     // where it lies
};

// 256 values per channel that bytes stand for.
using Channel = std::array<float, 256>;

// `count` numbers of an array. A double that no float can hold would become infinite.
Result<std::vector<double>> FloatNumbers(const JsonValue& list, size_t count) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<double> values, list.Numbers(count));
  for (const double x : values) {
    if (std::fabs(x) > double{std::numeric_limits<float>::max()})
      return list.Complain(Cat("holds ", x, ", which is out of range"));
  }
  return values;
}

Result<Channel> Codebook(const JsonValue& part) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, part.Get("codebook"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> values, FloatNumbers(list, 256));
  Channel channel;
  std::ranges::transform(values, channel.begin(), [](double x) { return static_cast<float>(x); });
  return channel;
}

Channel Range(double min, double max) {
  Channel channel;
  for (size_t k = 0; k < channel.size(); ++k) {
    channel[k] = static_cast<float>(min + (max - min) * static_cast<double>(k) / 255);
  }
  return channel;
}

// Version 2: one codebook for all channels; version 1: a range for each.
Result<std::vector<Channel>> Channels(const JsonValue& part, int version, size_t count) {
  if (version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Channel channel, Codebook(part));
    return std::vector<Channel>(count, channel);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> min, FloatNumbers(mins, count));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> max, FloatNumbers(maxs, count));
  std::vector<Channel> channels;
  for (size_t k = 0; k < count; ++k) channels.push_back(Range(min[k], max[k]));
  return channels;
}

struct Sog {
  const Members& members;
  JsonValue meta;
  int version;
  int64_t count;
  int width = 0, height = 0;  // of all pictures with a pixel per Gaussian, once one is known

  // Picture k of the part's "files". Pictures have a pixel per Gaussian and at most some rows more, all of them alike:
  // where they are not, the files do not belong together.
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
  // Version 1 says the number of Gaussians for every attribute.
  Status CheckShape(const JsonValue& part) const {
    const std::optional<JsonValue> shape = part.Find("shape");
    if (!shape) return {};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> sizes, shape->Elements());
    if (sizes.empty()) return shape->Complain("is empty, expected the number of Gaussians");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int said, sizes[0].WholeNumber(1, std::numeric_limits<int>::max()));
    if (said != count) return shape->Complain(Cat("says ", said, " Gaussians, the means say ", count));
    return {};
  }
  template <typename Body>
  void ForAll(Body&& body) const {
    ParallelFor(0, count, kSogReadGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) body(i);
    });
  }
};

Status ReadMeans(Sog& sog, GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("means"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> min, mins.Numbers(3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> max, maxs.Numbers(3));
  // They are logarithms: e⁸⁸ is the end of what floats can hold.
  constexpr double kMaxLogarithm = 88;
  for (size_t k = 0; k < 3; ++k) {
    if (std::fabs(min[k]) > kMaxLogarithm) return mins.Complain(Cat("holds ", min[k], ", expected -88 to 88"));
    if (std::fabs(max[k]) > kMaxLogarithm) return maxs.Complain(Cat("holds ", max[k], ", expected -88 to 88"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage low, sog.Picture(part, 0, 2));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage high, sog.Picture(part, 1, 2));
  sog.ForAll([&](int64_t i) {
    for (size_t k = 0; k < 3; ++k) {
      const size_t at = 4 * static_cast<size_t>(i) + k;
      const double t = (low.rgba[at] + 256 * high.rgba[at]) / 65535.0;
      const double logarithm = min[k] + (max[k] - min[k]) * t;
      cloud.means[static_cast<size_t>(3 * i) + k] =
          static_cast<float>(std::copysign(std::expm1(std::fabs(logarithm)), logarithm));
    }
  });
  return {};
}

void UnpackQuats(const Sog& sog, const ByteImage& picture, GaussianCloud& cloud) {
  sog.ForAll([&](int64_t i) {
    const uint8_t* pixel = picture.rgba.data() + 4 * i;
    SmallestThree three;  // the identity where the mark is none
    if (pixel[3] >= 252) {
      three.largest = pixel[3] - 252u;
      for (size_t k = 0; k < 3; ++k) three.rest[k] = (static_cast<float>(pixel[k]) / 127.5f - 1) * kSqrtHalf;
    }
    RestoreLargest(three, cloud.quats.data() + 4 * i);
  });
}

Status ReadScales(Sog& sog, GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("scales"));
  ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(part));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<Channel> channels, Channels(part, sog.version, 3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage picture, sog.Picture(part, 0, 1));
  sog.ForAll([&](int64_t i) {
    for (size_t k = 0; k < 3; ++k) {
      cloud.log_scales[static_cast<size_t>(3 * i) + k] = channels[k][picture.rgba[4 * static_cast<size_t>(i) + k]];
    }
  });
  return {};
}

Status ReadColors(Sog& sog, GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue part, sog.meta.Get("sh0"));
  ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(part));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Channel> channels, Channels(part, sog.version, sog.version == 2 ? 3 : 4));
  if (sog.version == 2) {
    channels.emplace_back();
    for (size_t k = 0; k < 256; ++k) channels[3][k] = LogitFromOpacity(static_cast<float>(k) / 255);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage picture, sog.Picture(part, 0, 1));
  sog.ForAll([&](int64_t i) {
    const uint8_t* pixel = picture.rgba.data() + 4 * i;
    float* dc = cloud.sh.data() + i * cloud.sh_stride();
    for (size_t k = 0; k < 3; ++k) dc[k] = channels[k][pixel[k]];
    cloud.opacity_logits[static_cast<size_t>(i)] = channels[3][pixel[3]];
  });
  return {};
}

// The palette's picture, which also tells the degree in version 1: 64 entries of 3, 8 or 15 pixels in a row.
struct Palette {
  int degree = 0;
  ByteImage picture;
  int64_t entries = 0;
};

Result<Palette> ReadPalette(const Sog& sog, const JsonValue& part) {
  Palette palette;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, part.Get("files"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> names, list.Elements());
  if (names.size() < 2) return list.Complain(Cat("expected 2 names, found ", names.size()));
  constexpr int64_t kMost = int64_t{65536} * (ShCoefficients(kMaxShDegree) - 1);
  ANCHORSPLAT_ASSIGN_OR_RETURN(palette.picture, sog.members.Picture(names[0], 1, kMost + 65536));
  for (int degree = 1; degree <= kMaxShDegree; ++degree) {
    if (palette.picture.width == kEntriesPerRow * (ShCoefficients(degree) - 1)) palette.degree = degree;
  }
  if (palette.degree == 0) {
    return names[0].Complain(Cat("has a width of ", palette.picture.width, ", expected 192, 512 or 960"));
  }
  palette.entries = kEntriesPerRow * palette.picture.height;
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

Status ReadHarmonics(Sog& sog, const JsonValue& part, const Palette& palette, GaussianCloud& cloud) {
  Channel values;
  if (sog.version == 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(values, Codebook(part));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue mins, part.Get("mins"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue maxs, part.Get("maxs"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double min, mins.Number());
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double max, maxs.Number());
    values = Range(min, max);
    for (const float x : values) {
      if (!std::isfinite(x)) return part.Complain(Cat("has a range of ", min, " to ", max));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage labels, sog.Picture(part, 1, 2));
  const int64_t coefficients = cloud.coefficients() - 1;
  std::vector<char> bad(static_cast<size_t>((sog.count + kSogReadGrain - 1) / kSogReadGrain), 0);
  ParallelFor(0, sog.count, kSogReadGrain, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const uint8_t* pixel = labels.rgba.data() + 4 * i;
      const int64_t label = pixel[0] + 256 * pixel[1];
      if (label >= palette.entries) {
        bad[static_cast<size_t>(first / kSogReadGrain)] = 1;
        return;
      }
      const int64_t row = label / kEntriesPerRow, column = label % kEntriesPerRow * coefficients;
      const uint8_t* entry = palette.picture.rgba.data() + 4 * (row * palette.picture.width + column);
      float* sh = cloud.sh.data() + i * cloud.sh_stride() + 3;
      for (int64_t k = 0; k < coefficients; ++k) {
        for (int64_t channel = 0; channel < 3; ++channel) sh[3 * k + channel] = values[entry[4 * k + channel]];
      }
    }
  });
  if (std::ranges::find(bad, 1) != bad.end()) {
    return part.Complain(Cat("has labels beyond its palette of ", palette.entries, " entries"));
  }
  return {};
}

// The members, with meta.json parsed.
struct OpenedSog {
  Members members;
  JsonFile json;
};

Result<OpenedSog> OpenSog(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Members members, Members::Of(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, members.Meta(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(JsonFile json, JsonFile::Parse(members.meta_name(), text));
  return OpenedSog{std::move(members), std::move(json)};
}

}  // namespace

Result<FormatFacts> DescribeSog(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSog opened, OpenSog(file));
  const JsonValue meta = opened.json.root();
  FormatFacts facts;
  // Version 1 does not say its number.
  const std::optional<JsonValue> version = meta.Find("version");
  facts.Add("version", version ? Printable(version->raw().dump()) : "1",
            opened.members.is_archive() ? ", a ZIP archive" : ", a folder of pictures");
  if (const std::optional<JsonValue> asset = meta.Find("asset"); asset && asset->has("generator")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue generator, asset->Get("generator"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, generator.Text());
    facts.Add("made by", Printable(name));
  }
  const std::optional<JsonValue> harmonics = meta.Find("shN");
  if (harmonics && harmonics->has("count")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue count, harmonics->Get("count"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int entries, count.WholeNumber(1, 65536));
    facts.Add("palette of harmonics", WithThousands(entries), " entries");
  }
  return facts;
}

uint64_t SogSize(const InputFile& file) {
  uint64_t sum = file.size();
  const Result<std::string> head = file.Head(2);
  if (!head.ok() || *head == "PK") return sum;  // an archive holds all of it
  const Result<OpenedSog> opened = OpenSog(file);
  if (!opened.ok()) return sum;
  std::set<std::string> seen;
  for (const char* part : {"means", "quats", "scales", "sh0", "shN"}) {
    const std::optional<JsonValue> value = opened->json.root().Find(part);
    const std::optional<JsonValue> list = value ? value->Find("files") : std::nullopt;
    if (!list || !list->raw().is_array()) continue;
    for (const nlohmann::json& name : list->raw()) {
      if (!name.is_string() || !seen.insert(name.get<std::string>()).second) continue;
      sum += opened->members.SizeBeside(name.get<std::string>());
    }
  }
  return sum;
}

Result<GaussianCloud> ReadSog(const InputFile& file, const ReadLimits& limits) {
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
  // Pictures of the right size come before the cloud: a count alone allocates nothing.
  const std::optional<JsonValue> harmonics = meta.Find("shN");
  Palette palette;
  if (harmonics && !harmonics->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(palette, ReadPalette(sog, *harmonics));
  }
  GaussianCloud cloud;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue quats, meta.Get("quats"));
  {
    ANCHORSPLAT_RETURN_IF_ERROR(sog.CheckShape(quats));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage picture, sog.Picture(quats, 0, 1));
    cloud.Resize(count, palette.degree);
    UnpackQuats(sog, picture, cloud);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ReadMeans(sog, cloud));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadScales(sog, cloud));
  ANCHORSPLAT_RETURN_IF_ERROR(ReadColors(sog, cloud));
  if (palette.degree > 0) ANCHORSPLAT_RETURN_IF_ERROR(ReadHarmonics(sog, *harmonics, palette, cloud));
  if (const std::optional<JsonValue> model = meta.Find("model"); model && model->raw() == "antialiased") {
    cloud.render_mode = RenderMode::kAntialiased;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud.comments, CommentsOfAsset(meta));
  return cloud;
}

}  // namespace anchorsplat
