#include "formats/splat/splat_writer.h"

#include <array>
#include <atomic>
#include <cmath>
#include <cstring>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/quantize.h"
#include "formats/record_blocks.h"
#include "formats/splat/splat_reader.h"
#include "formats/splat_order.h"

namespace anchorsplat {

namespace {

// Rows that ReadSplat would find implausible.
int64_t CountUnreadable(const CloudView& cloud) {
  constexpr int64_t kGrain = 1 << 14;
  std::atomic<int64_t> sum = 0;
  ParallelFor(0, cloud.size(), kGrain, [&](int64_t first, int64_t last) {
    int64_t here = 0;
    for (int64_t i = first; i < last; ++i) {
      float numbers[6];
      for (int64_t k = 0; k < 3; ++k) {
        numbers[k] = cloud.means[static_cast<size_t>(3 * i + k)];
        numbers[3 + k] = std::exp(cloud.log_scales[static_cast<size_t>(3 * i + k)]);
      }
      here += IsImplausibleRow(numbers) ? 1 : 0;
    }
    sum += here;
  });
  return sum;
}

}  // namespace

uint64_t PredictedSplatSize(int64_t count, int /*sh_degree*/) { return static_cast<uint64_t>(count) * kSplatRecord; }

Status WriteSplat(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const int64_t unreadable = CountUnreadable(cloud);
  if (2 * unreadable > cloud.size()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": ", WithThousands(unreadable), " of ", WithThousands(cloud.size()),
                     " Gaussians have positions or scales that are not finite or above 1e12, so the file would not be "
                     "recognised as a .splat: write another format")};
  }
  const Buffer<uint32_t> rows = WriteOrder(cloud, options.order, SplatOrder::kImportance);
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Reserve(PredictedSplatSize(cloud.size(), 0)));
  ANCHORSPLAT_RETURN_IF_ERROR(
      WriteRecords(file, 0, cloud.size(), kSplatRecord, [&](int64_t first, int64_t last, uint8_t* bytes) {
        for (int64_t i = first; i < last; ++i, bytes += kSplatRecord) {
          const int64_t row = rows.empty() ? i : int64_t{rows[static_cast<size_t>(i)]};
          float numbers[6];
          const float* dc = cloud.sh.data() + row * cloud.sh_stride();
          for (int k = 0; k < 3; ++k) {
            numbers[k] = cloud.means[static_cast<size_t>(3 * row + k)];
            numbers[3 + k] = std::exp(cloud.log_scales[static_cast<size_t>(3 * row + k)]);
            bytes[24 + k] = QuantizeByte(255 * ColorFromDc(dc[k]));
          }
          std::memcpy(bytes, numbers, sizeof numbers);
          bytes[27] = OpacityByte(cloud.opacity_logits[static_cast<size_t>(row)]);
          const std::array<float, 4> q = RescaledToFloat(cloud.quats.data() + 4 * row);
          const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
          for (size_t k = 0; k < 4; ++k) {
            const float component = norm > 0 ? q[k] / norm : (k == 0 ? 1.0f : 0.0f);
            bytes[28 + k] = QuantizeByte(component * 128 + 128);
          }
        }
      }));
  return file.Commit();
}

}  // namespace anchorsplat
