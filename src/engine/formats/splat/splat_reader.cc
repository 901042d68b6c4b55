#include "formats/splat/splat_reader.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "core/activations.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/file_blocks.h"
#include "formats/number_or_nan.h"
#include "formats/record_blocks.h"

namespace anchorsplat {

static_assert(std::endian::native == std::endian::little, "records are copied as they lie in the file");

bool IsImplausibleRow(const float numbers[6]) {  // NaN fails these comparisons
  for (int k = 0; k < 3; ++k) {
    if (!(std::fabs(numbers[k]) <= kSplatExtent)) return true;
    if (!(numbers[3 + k] >= 0 && numbers[3 + k] <= kSplatExtent)) return true;
  }
  return false;
}

namespace {

using SplatTable = std::array<float, 256>;
template <typename Function>
SplatTable OfEachByte(Function&& value) {
  SplatTable table;
  for (size_t k = 0; k < table.size(); ++k) table[k] = value(static_cast<float>(k) / 255);
  return table;
}

// Number of Gaussians.
Result<int64_t> CountOfSplat(const InputFile& file, const ReadLimits& limits) {
  if (file.size() == 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": is empty, expected 32 bytes per Gaussian of a .splat file")};
  }
  if (file.size() % kSplatRecord != 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(file.size())),
                                          ": a .splat file has 32 bytes per Gaussian, this one ends ",
                                          file.size() % kSplatRecord, " bytes after a whole number of them")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), file.size() / kSplatRecord, limits));
  return static_cast<int64_t>(file.size() / kSplatRecord);
}

// Unpacks `count` records into rows from `to` on; returns how many are implausible.
int64_t UnpackSplat(const uint8_t* bytes, int64_t count, int64_t to, GaussianCloud& cloud) {
  static const SplatTable kLogits = OfEachByte(LogitFromOpacity), kDc = OfEachByte(DcFromColor);
  int64_t implausible = 0;
  for (int64_t i = to; i < to + count; ++i, bytes += kSplatRecord) {
    float numbers[6];
    std::memcpy(numbers, bytes, sizeof numbers);
    if (IsImplausibleRow(numbers)) ++implausible;
    for (int k = 0; k < 3; ++k) {
      cloud.means[static_cast<size_t>(3 * i + k)] = numbers[k];
      cloud.log_scales[static_cast<size_t>(3 * i + k)] = LogFromStoredScale(numbers[3 + k]);
      cloud.sh[static_cast<size_t>(3 * i + k)] = kDc[bytes[24 + k]];
    }
    cloud.opacity_logits[static_cast<size_t>(i)] = kLogits[bytes[27]];
    for (int k = 0; k < 4; ++k) {
      cloud.quats[static_cast<size_t>(4 * i + k)] = (static_cast<float>(bytes[28 + k]) - 128) / 128;
    }
  }
  return implausible;
}

Status CheckSplatRows(const InputFile& file, int64_t implausible, int64_t count) {
  if (2 * implausible <= count) return {};
  return Error{ErrorCode::kBadFile,
               Cat(file.name(), ": is not a .splat file: ", WithThousands(implausible), " of ", WithThousands(count),
                   " rows of 32 bytes have positions or scales that are not finite, negative or above 1e12")};
}

class SplatBlocks final : public FileBlocks {
 public:
  SplatBlocks(const InputFile& file, int64_t count) : file_(file) { size_ = count; }

 private:
  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t> finite) override {
    int64_t implausible = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadRows(file_, 0, kSplatRecord, first, last, scratch.bytes,
                                         [&](const uint8_t* bytes, int64_t count, int64_t to) {
                                           implausible += UnpackSplat(bytes, count, to, scratch.rows);
                                         }));
    if (!finite.empty()) implausible_ += implausible;
    return {};
  }
  Status EndFirstPass() override { return CheckSplatRows(file_, implausible_.exchange(0), size_); }

  const InputFile& file_;
  std::atomic<int64_t> implausible_ = 0;  // implausible rows of the first pass
};

}  // namespace

bool LooksLikeSplat(const InputFile& file) {
  constexpr uint64_t kLooked = 128;  // rows
  constexpr float kFarOut = 1e7f;
  if (file.size() == 0 || file.size() % kSplatRecord != 0) return false;
  const auto head = file.Head(kLooked * kSplatRecord);
  if (!head.ok()) return false;
  for (size_t at = 0; at < head->size(); at += kSplatRecord) {
    float numbers[6];
    std::memcpy(numbers, head->data() + at, sizeof numbers);
    if (IsImplausibleRow(numbers)) return false;
    float square = 0;
    for (size_t k = 0; k < 4; ++k) {
      const float q = (static_cast<float>(static_cast<uint8_t>((*head)[at + 28 + k])) - 128) / 128;
      square += q * q;
    }
    const bool near_by = std::ranges::all_of(numbers, [](float x) { return std::fabs(x) < kFarOut; });
    if (!near_by || std::fabs(square - 1) > 0.1f) return false;
  }
  return true;
}

Result<GaussianCloud> ReadSplat(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t count, CountOfSplat(file, limits));
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  std::atomic<int64_t> implausible = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadRecords(file, 0, count, kSplatRecord, [&](int64_t first, int64_t last, const uint8_t* bytes) {
        implausible += UnpackSplat(bytes, last - first, first, cloud);
      }));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSplatRows(file, implausible, count));
  return cloud;
}

Result<std::unique_ptr<CloudBlocks>> BlocksOfSplat(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t count, CountOfSplat(file, limits));
  return std::unique_ptr<CloudBlocks>(std::make_unique<SplatBlocks>(file, count));
}

}  // namespace anchorsplat
