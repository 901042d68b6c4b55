#include "formats/ksplat/ksplat_reader.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/finite.h"
#include "core/half.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/file_blocks.h"
#include "formats/number_or_nan.h"
#include "formats/record_blocks.h"
#include "io/little_endian.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in the file");

constexpr uint64_t kHeaderBytes = 4096;
constexpr uint64_t kSectionHeaderBytes = 1024;
constexpr float kDefaultShRange = 1.5f;

// Bytes of a Gaussian's fields at each compression level.
struct Level {
  size_t number;    // bytes of a scale or a component of the quaternion
  size_t mean;      // of a coordinate
  size_t harmonic;  // of an SH coefficient
  uint32_t range;   // default range of 16-bit coordinates
};
constexpr std::array<Level, 3> kLevels = {{{4, 4, 4, 1}, {2, 2, 2, 32767}, {2, 2, 1, 32767}}};

template <typename T>
T At(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

struct Section {
  uint64_t count, max_count, bucket_size, buckets, full_buckets, partial_buckets, bucket_bytes;
  float block_size;
  uint32_t range;
  int degree;
  uint64_t begin;   // offset of the bucket sizes
  uint64_t record;  // bytes per Gaussian

  uint64_t centers_begin() const { return begin + 4 * partial_buckets; }
  uint64_t data_begin() const { return centers_begin() + bucket_bytes * buckets; }
  uint64_t end() const { return data_begin() + record * max_count; }
};

struct Ksplat {
  size_t level = 0;
  float sh_min = -kDefaultShRange, sh_max = kDefaultShRange;
  std::array<float, 3> center{};  // the viewer's orbit centre; does not affect positions
  std::vector<Section> sections;
  uint64_t count = 0;
  int degree = 0;
};

Error Bad(const InputFile& file, uint64_t byte, const std::string& what) {
  return {ErrorCode::kBadFile, Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(byte)), ": ", what)};
}

Status ReadSectionHeader(const InputFile& file, uint64_t at, uint64_t begin, const Level& level, Section& section) {
  std::string header(48, '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(at, header.data(), header.size()));
  section.count = At<uint32_t>(header, 0);
  section.max_count = At<uint32_t>(header, 4);
  section.bucket_size = At<uint32_t>(header, 8);
  section.buckets = At<uint32_t>(header, 12);
  section.block_size = At<float>(header, 16);
  section.bucket_bytes = At<uint16_t>(header, 20);
  section.range = At<uint32_t>(header, 24);
  if (section.range == 0) section.range = level.range;
  section.full_buckets = At<uint32_t>(header, 32);
  section.partial_buckets = At<uint32_t>(header, 36);
  const int degree = At<uint16_t>(header, 40);
  if (degree > kMaxShDegree) return Bad(file, at + 40, Cat("SH degree ", degree, ", expected 0 to 3"));
  section.degree = degree;
  section.begin = begin;
  section.record = 3 * level.mean + 7 * level.number + 4 + 3 * level.harmonic * (ShCoefficients(degree) - 1);
  // All factors have at most 32 bits and records fewer than 256 bytes: no 64-bit overflow.
  if (section.count > section.max_count || section.end() > file.size()) {
    return Bad(file, at,
               Cat("a section of ", section.count, " Gaussians (room for ", section.max_count,
                   ") that would end at byte ", section.end(), " of ", file.size()));
  }
  if (level.mean == 2) {
    const bool enough = section.full_buckets + section.partial_buckets <= section.buckets &&
                        (section.bucket_bytes >= 12 || section.buckets == 0);
    if (!enough || !std::isfinite(section.block_size)) {
      return Bad(file, at + 8, "the section's bucket sizes are inconsistent");
    }
  }
  return {};
}

Result<Ksplat> ReadHeaders(const InputFile& file, const ReadLimits& limits) {
  if (file.size() < kHeaderBytes) return Bad(file, file.size(), "is shorter than the header of a KSPLAT file");
  std::string header(48, '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(0, header.data(), header.size()));
  const int major = At<uint8_t>(header, 0), minor = At<uint8_t>(header, 1);
  if (major != 0 || minor < 1) return Bad(file, 0, Cat("KSPLAT version ", major, ".", minor, ", expected 0.1"));
  Ksplat ksplat;
  const uint64_t sections = At<uint32_t>(header, 4);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(Cat(file.name(), ": byte 16"), At<uint32_t>(header, 16), limits));
  ksplat.level = At<uint16_t>(header, 20);
  if (ksplat.level >= kLevels.size())
    return Bad(file, 20, Cat("compression level ", ksplat.level, ", expected 0 to 2"));
  const float min = At<float>(header, 36), max = At<float>(header, 40);
  if (!std::isfinite(min) || !std::isfinite(max)) return Bad(file, 36, "a range of harmonics that is not finite");
  if (min != 0) ksplat.sh_min = min;
  if (max != 0) ksplat.sh_max = max;
  if (ksplat.sh_min > ksplat.sh_max) {
    return Bad(
        file, 36,
        Cat("a range of harmonics from ", ksplat.sh_min, " to ", ksplat.sh_max, ": the minimum is above the maximum"));
  }
  for (size_t k = 0; k < 3; ++k) ksplat.center[k] = At<float>(header, 24 + 4 * k);
  if (sections > (file.size() - kHeaderBytes) / kSectionHeaderBytes) {
    return Bad(file, 4, Cat(sections, " sections in a file of ", file.size(), " bytes"));
  }
  uint64_t begin = kHeaderBytes + sections * kSectionHeaderBytes;
  for (uint64_t k = 0; k < sections; ++k) {
    Section section;
    ANCHORSPLAT_RETURN_IF_ERROR(
        ReadSectionHeader(file, kHeaderBytes + k * kSectionHeaderBytes, begin, kLevels[ksplat.level], section));
    begin = section.end();
    ksplat.count += section.count;
    if (section.count > 0) ksplat.degree = std::max(ksplat.degree, section.degree);
    ksplat.sections.push_back(section);
  }
  if (ksplat.count != At<uint32_t>(header, 16)) {
    return Bad(file, 16, Cat("has ", At<uint32_t>(header, 16), " Gaussians, but its sections have ", ksplat.count));
  }
  return ksplat;
}

// Finds a Gaussian's bucket: full ones come first, then partly filled ones, whose first Gaussians are in `starts`.
struct Buckets {
  std::vector<float> centers;    // [buckets,3]
  std::vector<uint64_t> starts;  // first Gaussian of each partly filled bucket

  const float* CenterOf(const Section& section, uint64_t i) const {
    uint64_t bucket = 0;
    if (section.bucket_size > 0 && i < section.full_buckets * section.bucket_size) {
      bucket = i / section.bucket_size;
    } else {
      const auto after = std::upper_bound(starts.begin(), starts.end(), i);
      if (after == starts.begin()) return nullptr;
      bucket = section.full_buckets + static_cast<uint64_t>(after - starts.begin()) - 1;
    }
    return bucket < section.buckets ? centers.data() + 3 * bucket : nullptr;
  }
};

Result<Buckets> ReadBuckets(const InputFile& file, const Section& section) {
  Buckets buckets;
  std::vector<uint32_t> sizes(section.partial_buckets);
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(section.begin, sizes.data(), 4 * sizes.size()));
  uint64_t next = section.full_buckets * section.bucket_size;
  for (const uint32_t size : sizes) {
    buckets.starts.push_back(next);
    next += size;
  }
  buckets.centers.resize(3 * section.buckets);
  std::string raw(section.bucket_bytes * section.buckets, '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(section.centers_begin(), raw.data(), raw.size()));
  for (size_t k = 0; k < section.buckets; ++k) std::memcpy(&buckets.centers[3 * k], &raw[section.bucket_bytes * k], 12);
  return buckets;
}

float Number(const uint8_t* bytes, size_t size) {
  if (size == 2) return FloatFromHalf(LoadLittleEndian<uint16_t>(bytes));
  float value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

void UnpackHarmonics(const Ksplat& ksplat, const Section& section, const uint8_t* bytes, float* sh) {
  const size_t size = kLevels[ksplat.level].harmonic;
  for (int degree = 1; degree <= section.degree; ++degree) {
    const int first = ShCoefficients(degree - 1), count = 2 * degree + 1;
    for (int channel = 0; channel < 3; ++channel) {
      for (int k = first; k < first + count; ++k, bytes += size) {
        sh[3 * k + channel] = size == 1
                                  ? ksplat.sh_min + static_cast<float>(*bytes) / 255 * (ksplat.sh_max - ksplat.sh_min)
                                  : Number(bytes, size);
      }
    }
  }
}

// Buckets of a section; none if its level has none.
Result<Buckets> BucketsOf(const InputFile& file, const Ksplat& ksplat, const Section& section) {
  return kLevels[ksplat.level].mean == 2 ? ReadBuckets(file, section) : Buckets();
}

Error LostRow(const InputFile& file, const Section& section) {
  return Bad(file, section.begin, "a Gaussian is in no bucket of its section");
}

// Unpacks records [first, first + count) of a section into rows of the cloud from `to` on, with as many harmonics as it
// holds. Calls each(row, harmonics) with the harmonics' bytes. False if a Gaussian is in no bucket.
template <typename Each>
bool UnpackKsplat(const Ksplat& ksplat, const Section& section, const Buckets& buckets, const uint8_t* record,
                  int64_t first, int64_t count, int64_t to, GaussianCloud& cloud, Each&& each) {
  const Level& level = kLevels[ksplat.level];
  const float step = section.block_size / 2 / static_cast<float>(section.range);
  for (int64_t i = first; i < first + count; ++i, record += section.record) {
    const int64_t row = to + (i - first);
    const uint8_t* bytes = record;
    float* mean = cloud.means.data() + 3 * row;
    const float* center = level.mean == 2 ? buckets.CenterOf(section, static_cast<uint64_t>(i)) : nullptr;
    if (level.mean == 2 && center == nullptr) return false;
    for (int k = 0; k < 3; ++k, bytes += level.mean) {
      mean[k] =
          level.mean == 4
              ? Number(bytes, 4)
              : (static_cast<float>(bytes[0] + 256 * bytes[1]) - static_cast<float>(section.range)) * step + center[k];
    }
    for (int k = 0; k < 3; ++k, bytes += level.number) {
      cloud.log_scales[static_cast<size_t>(3 * row + k)] = LogFromStoredScale(Number(bytes, level.number));
    }
    for (int k = 0; k < 4; ++k, bytes += level.number) {
      cloud.quats[static_cast<size_t>(4 * row + k)] = Number(bytes, level.number);
    }
    float* sh = cloud.sh.data() + row * cloud.sh_stride();
    for (int k = 0; k < 3; ++k) sh[k] = DcFromColor(static_cast<float>(*bytes++) / 255);
    cloud.opacity_logits[static_cast<size_t>(row)] = LogitFromOpacity(static_cast<float>(*bytes++) / 255);
    each(row, bytes);
  }
  return true;
}

Status ReadSection(const InputFile& file, const Ksplat& ksplat, const Section& section, int64_t begin,
                   GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Buckets buckets, BucketsOf(file, ksplat, section));
  std::atomic<bool> lost = false;
  ANCHORSPLAT_RETURN_IF_ERROR(ReadRecords(file, section.data_begin(), static_cast<int64_t>(section.count),
                                          section.record, [&](int64_t first, int64_t last, const uint8_t* bytes) {
                                            const auto harmonics = [&](int64_t row, const uint8_t* from) {
                                              float* sh = cloud.sh.data() + row * cloud.sh_stride();
                                              std::fill_n(sh + 3, cloud.sh_stride() - 3, 0.0f);
                                              UnpackHarmonics(ksplat, section, from, sh);
                                            };
                                            if (!UnpackKsplat(ksplat, section, buckets, bytes, first, last - first,
                                                              begin + first, cloud, harmonics)) {
                                              lost = true;
                                            }
                                          }));
  if (lost) return LostRow(file, section);
  return {};
}

class KsplatBlocks final : public FileBlocks {
 public:
  KsplatBlocks(const InputFile& file, Ksplat ksplat, std::vector<Buckets> buckets)
      : file_(file), ksplat_(std::move(ksplat)), buckets_(std::move(buckets)) {
    size_ = static_cast<int64_t>(ksplat_.count);
    sh_degree_ = ksplat_.degree;
    int64_t begin = 0;
    for (const Section& section : ksplat_.sections) {
      begins_.push_back(begin);
      begin += static_cast<int64_t>(section.count);
    }
  }

 private:
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t> finite) override {
    for (int64_t i = first; i < last;) {
      // The last section that begins here: earlier ones that do are empty.
      const auto s = static_cast<size_t>(std::upper_bound(begins_.begin(), begins_.end(), i) - begins_.begin()) - 1;
      const Section& section = ksplat_.sections[s];
      const int64_t end = std::min(last, begins_[s] + static_cast<int64_t>(section.count));
      ANCHORSPLAT_RETURN_IF_ERROR(FillFrom(s, i - begins_[s], end - begins_[s], i - first, scratch, finite));
      i = end;
    }
    return {};
  }

  // Reads rows [first, last) of section s into scratch rows from `to` on.
  Status FillFrom(size_t s, int64_t first, int64_t last, int64_t to, Scratch& scratch,
                  std::span<uint8_t> finite) const {
    const Section& section = ksplat_.sections[s];
    const auto harmonics = [&](int64_t row, const uint8_t* bytes) {
      if (finite.empty() || section.degree == 0) return;
      std::array<float, 3 * ShCoefficients(kMaxShDegree)> sh{};
      UnpackHarmonics(ksplat_, section, bytes, sh.data());
      if (!AllFinite(sh)) finite[static_cast<size_t>(row)] = 0;
    };
    bool all = true;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadRows(file_, section.data_begin(), static_cast<size_t>(section.record), first, last,
                                         scratch.bytes, [&](const uint8_t* bytes, int64_t count, int64_t at) {
                                           all = all && UnpackKsplat(ksplat_, section, buckets_[s], bytes, first + at,
                                                                     count, to + at, scratch.rows, harmonics);
                                         }));
    return all ? Status() : LostRow(file_, section);
  }

  const InputFile& file_;
  Ksplat ksplat_;
  std::vector<Buckets> buckets_;  // of each section
  std::vector<int64_t> begins_;   // the first row of each
};

}  // namespace

Result<FormatFacts> DescribeKsplat(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Ksplat ksplat, ReadHeaders(file, {}));
  FormatFacts facts;
  facts.Add("version", "0.1");
  facts.Add("compression", "level ", ksplat.level,
            ksplat.level == 0   ? ": floats"
            : ksplat.level == 1 ? ": 16 bits"
                                : ": 16 bits, harmonics of 8 bits");
  facts.Add("sections", ksplat.sections.size());
  if (ksplat.center != std::array<float, 3>{}) {
    facts.Add("scene centre", ksplat.center[0], " ", ksplat.center[1], " ", ksplat.center[2],
              ", the centre of its viewer's orbit");
  }
  return facts;
}

bool LooksLikeKsplat(const InputFile& file) { return ReadHeaders(file, {}).ok(); }

Result<GaussianCloud> ReadKsplat(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Ksplat ksplat, ReadHeaders(file, limits));
  GaussianCloud cloud;
  cloud.Resize(static_cast<int64_t>(ksplat.count), ksplat.degree);
  int64_t begin = 0;
  for (const Section& section : ksplat.sections) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadSection(file, ksplat, section, begin, cloud));
    begin += static_cast<int64_t>(section.count);
  }
  return cloud;
}

Result<std::unique_ptr<CloudBlocks>> BlocksOfKsplat(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Ksplat ksplat, ReadHeaders(file, limits));
  std::vector<Buckets> buckets;
  for (const Section& section : ksplat.sections) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Buckets of_one, BucketsOf(file, ksplat, section));
    buckets.push_back(std::move(of_one));
  }
  return std::unique_ptr<CloudBlocks>(std::make_unique<KsplatBlocks>(file, std::move(ksplat), std::move(buckets)));
}

}  // namespace anchorsplat
