#include "formats/spz/spz_reader.h"

#include <algorithm>
#include <array>
#include <memory>

#include "core/parallel.h"
#include "formats/axes.h"
#include "formats/spz/spz_file.h"
#include "formats/spz/spz_sections.h"
#include "io/inflating_reader.h"

namespace anchorsplat {

namespace {

constexpr int64_t kSpzBlock = 1 << 15;  // Gaussians per task, unpacked while in the cache
constexpr int64_t kSpzGrain = 1 << 12;

Status ReadSection(const SpzLayout& layout, SpzSection section, const AxisFlip& flip, InflatingReader& reader,
                   GaussianCloud& cloud) {
  const size_t record = layout.record_size(section);
  Buffer<uint8_t> bytes(static_cast<size_t>(std::min(kSpzBlock, cloud.size())) * record);
  for (int64_t begin = 0; begin < cloud.size(); begin += kSpzBlock) {
    const int64_t end = std::min(begin + kSpzBlock, cloud.size());
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(bytes.data(), static_cast<size_t>(end - begin) * record));
    ParallelFor(begin, end, kSpzGrain, [&](int64_t first, int64_t last) {
      UnpackSpz(layout, section, first, last, bytes.data() + static_cast<size_t>(first - begin) * record, flip, cloud);
    });
  }
  return {};
}

Status ReadGzipped(const SpzFile& spz, const AxisFlip& flip, GaussianCloud& cloud) {
  for (size_t k = 0; k < spz.sections(); ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadSection(spz.layout, kSpzSections[k], flip, *spz.stream, cloud));
  }
  // A stream longer than its header states does not match it.
  return spz.end_read ? Status() : spz.stream->ExpectEnd();
}

Status ReadStreams(const InputFile& file, const SpzFile& spz, const AxisFlip& flip, GaussianCloud& cloud) {
  const size_t streams = spz.sections();
  std::array<Status, 6> statuses;
  ParallelFor(0, static_cast<int64_t>(streams), 1, [&](int64_t first, int64_t last) {
    for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
      // The last stream is by far the longest, so it starts first.
      const size_t stream = streams - 1 - k;
      const std::unique_ptr<InflatingReader> reader = OpenZstd(file, spz.begins[stream], spz.begins[stream + 1]);
      statuses[stream] = ReadSection(spz.layout, kSpzSections[stream], flip, *reader, cloud);
      if (statuses[stream].ok()) statuses[stream] = reader->ExpectEnd();
    }
  });
  for (const Status& status : statuses) ANCHORSPLAT_RETURN_IF_ERROR(status);
  return {};
}

}  // namespace

Result<GaussianCloud> ReadSpz(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzFile spz, OpenSpz(file, limits));
  WarnOfSpz(file, spz);
  GaussianCloud cloud;
  cloud.Resize(spz.count, spz.sh_degree());
  if (spz.antialiased) cloud.render_mode = RenderMode::kAntialiased;
  const auto [flip, turn] = TurnOfSpz(spz);
  ANCHORSPLAT_RETURN_IF_ERROR(spz.stream ? ReadGzipped(spz, flip, cloud) : ReadStreams(file, spz, flip, cloud));
  TurnAxes(cloud, turn);
  cloud.comments = CommentsOfSpzExtensions(spz.extensions, spz.axes);
  return cloud;
}

}  // namespace anchorsplat
