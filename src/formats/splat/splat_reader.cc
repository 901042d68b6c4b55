#include "formats/splat/splat_reader.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/activations.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/record_blocks.h"

namespace anchorsplat {

static_assert(std::endian::native == std::endian::little, "records are copied as they lie in the file");

bool IsNoSplatRow(const float numbers[6]) {  // comparisons that NaN fails
  for (int k = 0; k < 3; ++k) {
    if (!(std::fabs(numbers[k]) <= kSplatExtent)) return true;
    if (!(numbers[3 + k] >= 0 && numbers[3 + k] <= kSplatExtent)) return true;
  }
  return false;
}

Result<GaussianCloud> ReadSplat(const InputFile& file, const ReadLimits& limits) {
  if (file.size() == 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": is empty, expected 32 bytes per Gaussian of a .splat file")};
  }
  if (file.size() % kSplatRecord != 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(file.size())),
                                          ": a .splat file has 32 bytes per Gaussian, this one ends ",
                                          file.size() % kSplatRecord, " bytes after a whole number of them")};
  }
  const auto count = static_cast<int64_t>(file.size() / kSplatRecord);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(file.name(), file.size() / kSplatRecord, limits));
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  std::atomic<int64_t> absurd = 0;
  ANCHORSPLAT_RETURN_IF_ERROR(
      ReadRecords(file, 0, count, kSplatRecord, [&](int64_t first, int64_t last, const uint8_t* bytes) {
        int64_t absurd_here = 0;
        for (int64_t i = first; i < last; ++i, bytes += kSplatRecord) {
          float numbers[6];
          std::memcpy(numbers, bytes, sizeof numbers);
          if (IsNoSplatRow(numbers)) ++absurd_here;
          for (int k = 0; k < 3; ++k) {
            cloud.means[static_cast<size_t>(3 * i + k)] = numbers[k];
            cloud.log_scales[static_cast<size_t>(3 * i + k)] = LogFromScale(numbers[3 + k]);
            cloud.sh[static_cast<size_t>(3 * i + k)] = DcFromColor(static_cast<float>(bytes[24 + k]) / 255);
          }
          cloud.opacity_logits[static_cast<size_t>(i)] = LogitFromOpacity(static_cast<float>(bytes[27]) / 255);
          for (int k = 0; k < 4; ++k) {
            cloud.quats[static_cast<size_t>(4 * i + k)] = (static_cast<float>(bytes[28 + k]) - 128) / 128;
          }
        }
        absurd += absurd_here;
      }));
  if (2 * absurd > count) {
    return Error{
        ErrorCode::kBadFile,
        Cat(file.name(), ": is no .splat file: ", WithThousands(absurd), " of ", WithThousands(count),
            " rows of 32 bytes have positions or scales that are no numbers, negative or above a million millions")};
  }
  return cloud;
}

}  // namespace anchorsplat
