#include "formats/spz/spz_blocks.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/run_context.h"
#include "formats/axes.h"
#include "formats/file_blocks.h"
#include "formats/spz/spz_file.h"
#include "formats/spz/spz_sections.h"
#include "io/inflating_reader.h"

namespace anchorsplat {

namespace {

constexpr size_t kLooked = 5;     // sections needed for degree 0: the first ones
constexpr size_t kHarmonics = 5;  // this one is only verified
constexpr int64_t kBatchRows = 8 * kRowsPerScratch;

// Skips decompressed bytes.
Status Drain(InflatingReader& reader, uint64_t bytes) {
  std::array<uint8_t, size_t{64} << 10> scratch;
  for (uint64_t done = 0; done < bytes;) {
    LeaveIfAbandoned();
    const auto size = static_cast<size_t>(std::min<uint64_t>(scratch.size(), bytes - done));
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(scratch.data(), size));
    done += size;
  }
  return {};
}

class SpzBlocks final : public FileBlocks {
 public:
  SpzBlocks(const InputFile& file, SpzFile spz) : file_(file), spz_(std::move(spz)), turn_(TurnOfSpz(spz_)) {
    size_ = spz_.count;
    sh_degree_ = spz_.sh_degree();
    if (spz_.antialiased) render_mode_ = RenderMode::kAntialiased;
    comments_ = CommentsOfSpzExtensions(spz_.extensions, spz_.axes);
  }

  Status ForEach(const Visitor& visit) override {
    BeginPass();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Readers readers, OpenReaders());
    now_ = {};
    Batch next;
    do {
      std::swap(now_, next);
      next.first = now_.last;
      next.last = std::min(next.first + kBatchRows, size_);
      ANCHORSPLAT_RETURN_IF_ERROR(VisitAndDecompress(readers, next, visit));
    } while (now_.last < size_);
    return EndPass();
  }

 private:
  // Per section; null if it is not read.
  using Readers = std::array<std::unique_ptr<InflatingReader>, kSpzSections.size()>;
  // A batch of decompressed rows.
  struct Batch {
    int64_t first = 0, last = 0;
    std::array<Buffer<uint8_t>, kLooked> bytes;
  };

  Result<Readers> OpenReaders() {
    Readers readers;
    if (!spz_.stream) {
      for (size_t k = 0; k < (first_time() ? spz_.sections() : kLooked); ++k) {
        readers[k] = OpenZstd(file_, spz_.begins[k], spz_.begins[k + 1]);
      }
      return readers;
    }
    if (first_time()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(readers[kHarmonics], FindStarts());
    }
    for (size_t k = 0; k < kLooked; ++k) readers[k] = starts_[k]->Copy();
    return readers;
  }

  // Decompresses the sections for degree 0 once and stores their starts. Returns the reader of the harmonics, which
  // follow; null without harmonics.
  Result<std::unique_ptr<InflatingReader>> FindStarts() {
    std::unique_ptr<CopyableReader> reader = spz_.stream->Copy();
    for (size_t k = 0; k < kLooked; ++k) {
      starts_[k] = reader->Copy();
      ANCHORSPLAT_RETURN_IF_ERROR(Drain(*reader, BytesOf(k, size_)));
    }
    if (spz_.sections() > kLooked) return std::unique_ptr<InflatingReader>(std::move(reader));
    if (!spz_.end_read) ANCHORSPLAT_RETURN_IF_ERROR(reader->ExpectEnd());
    return std::unique_ptr<InflatingReader>();
  }

  // Visits the decompressed batch while decompressing the next.
  Status VisitAndDecompress(const Readers& readers, Batch& next, const Visitor& visit) {
    std::vector<size_t> sections;
    for (const size_t k : {kHarmonics, size_t{0}, size_t{4}, size_t{2}, size_t{3}, size_t{1}}) {  // longest first
      if (readers[k] && next.first < next.last) sections.push_back(k);
    }
    const auto streams = std::ssize(sections);
    const int64_t rooms = (now_.last - now_.first + kRowsPerScratch - 1) / kRowsPerScratch;
    std::array<Status, kSpzSections.size()> statuses;
    ParallelFor(0, streams + rooms, 1, [&](int64_t begin, int64_t end) {
      for (int64_t task = begin; task < end; ++task) {
        if (task < streams) {
          const size_t k = sections[static_cast<size_t>(task)];
          statuses[k] = Decompress(k, *readers[k], next);
        } else {
          const int64_t first = now_.first + (task - streams) * kRowsPerScratch;
          Scratch scratch;
          (void)VisitRows(first, std::min(now_.last, first + kRowsPerScratch), scratch,
                          visit);  // does not read the file
        }
      }
    });
    for (const Status& status : statuses) {
      if (!status.ok()) return FirstError(status);
    }
    return {};
  }

  Status Decompress(size_t section, InflatingReader& reader, Batch& batch) const {
    const uint64_t bytes = BytesOf(section, batch.last - batch.first);
    if (section == kHarmonics) {
      ANCHORSPLAT_RETURN_IF_ERROR(Drain(reader, bytes));
    } else {
      batch.bytes[section].resize(static_cast<size_t>(bytes));
      ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(batch.bytes[section].data(), batch.bytes[section].size()));
    }
    const bool has_end = !spz_.stream || (section == kHarmonics && !spz_.end_read);
    return has_end && batch.last == size_ ? reader.ExpectEnd() : Status();
  }

  // The reader processes one section after another; this processes all sections row by row.
  Status FirstError(const Status& found) const {
    if (spz_.stream) return found;  // its other sections were read before
    for (size_t k = 0; k < spz_.sections(); ++k) {
      const std::unique_ptr<InflatingReader> reader = OpenZstd(file_, spz_.begins[k], spz_.begins[k + 1]);
      ANCHORSPLAT_RETURN_IF_ERROR(Drain(*reader, BytesOf(k, size_)));
      ANCHORSPLAT_RETURN_IF_ERROR(reader->ExpectEnd());
    }
    return found;
  }

  Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t>) override {
    for (size_t k = 0; k < kLooked; ++k) {
      const uint8_t* const bytes = now_.bytes[k].data() + BytesOf(k, first - now_.first);
      UnpackSpz(spz_.layout, kSpzSections[k], 0, last - first, bytes, turn_.flip, scratch.rows);
    }
    TurnAxes(scratch.rows, turn_.turn);
    return {};
  }

  uint64_t BytesOf(size_t section, int64_t rows) const {
    return static_cast<uint64_t>(rows) * spz_.layout.record_size(kSpzSections[section]);
  }

  const InputFile& file_;
  SpzFile spz_;
  std::array<std::unique_ptr<CopyableReader>, kLooked> starts_;  // positions in the single stream
  Batch now_;
  SpzTurn turn_;
};

}  // namespace

Result<std::unique_ptr<CloudBlocks>> BlocksOfSpz(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(SpzFile spz, OpenSpz(file, limits));
  WarnOfSpz(file, spz);
  return std::unique_ptr<CloudBlocks>(std::make_unique<SpzBlocks>(file, std::move(spz)));
}

}  // namespace anchorsplat
