#include "core/row_scatter.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

// Bytes of the result that are sorted at a time: it fits in the cache, and is too small to be a Buffer on disk.
constexpr int64_t kBucketBytes = int64_t{3} << 20;
constexpr int64_t kChunks = 16;

// The pieces, concatenated.
class Rows {
 public:
  Rows(std::span<const std::span<const float>> pieces, int64_t width) : pieces_(pieces), width_(width) {
    for (const auto piece : pieces) ends_.push_back((ends_.empty() ? 0 : ends_.back()) + std::ssize(piece) / width);
  }
  // Calls `each` for rows begin to end.
  template <typename Body>
  void ForEach(int64_t begin, int64_t end, Body&& body) const {
    auto piece = static_cast<size_t>(std::ranges::upper_bound(ends_, begin) - ends_.begin());
    for (int64_t row = begin; row < end; ++piece) {
      const int64_t first = piece == 0 ? 0 : ends_[piece - 1];
      const float* from = pieces_[piece].data() + (row - first) * width_;
      for (const int64_t last = std::min(end, ends_[piece]); row < last; ++row, from += width_) body(row, from);
    }
  }

 private:
  std::span<const std::span<const float>> pieces_;
  int64_t width_;
  std::vector<int64_t> ends_;
};

}  // namespace

Buffer<float> ScatterRows(std::span<const std::span<const float>> pieces, int64_t width,
                          std::span<const int32_t> places) {
  const Rows rows(pieces, width);
  const int64_t n = std::ssize(places);
  Buffer<float> out(static_cast<size_t>(n * width));
  if (n == 0) return out;
  const int64_t in_bucket = std::max<int64_t>(1, kBucketBytes / (width * static_cast<int64_t>(sizeof(float))));
  const int64_t buckets = (n + in_bucket - 1) / in_bucket, in_chunk = (n + kChunks - 1) / kChunks;
  const auto place = [&](int64_t row) { return int64_t{places[static_cast<size_t>(row)]}; };
  if (buckets == 1) {
    ParallelFor(0, n, in_chunk, [&](int64_t begin, int64_t end) {
      rows.ForEach(begin, end,
                   [&](int64_t row, const float* from) { std::copy_n(from, width, out.data() + place(row) * width); });
    });
    return out;
  }
  // First pass: append each row to its bucket of the result, in input order.
  std::vector<int64_t> next(static_cast<size_t>(kChunks * buckets), 0);  // per chunk and bucket
  ParallelFor(0, n, in_chunk, [&](int64_t begin, int64_t end) {
    int64_t* const counts = next.data() + begin / in_chunk * buckets;
    for (int64_t row = begin; row < end; ++row) ++counts[place(row) / in_bucket];
  });
  for (int64_t bucket = 0; bucket < buckets; ++bucket) {
    int64_t at = bucket * in_bucket;
    for (int64_t chunk = 0; chunk < kChunks; ++chunk) {
      int64_t& count = next[static_cast<size_t>(chunk * buckets + bucket)];
      at += count;
      count = at - count;
    }
  }
  Buffer<int32_t> belongs(static_cast<size_t>(n));
  ParallelFor(0, n, in_chunk, [&](int64_t begin, int64_t end) {
    int64_t* const at = next.data() + begin / in_chunk * buckets;
    rows.ForEach(begin, end, [&](int64_t row, const float* from) {
      const int64_t to = at[place(row) / in_bucket]++;
      std::copy_n(from, width, out.data() + to * width);
      belongs[static_cast<size_t>(to)] = static_cast<int32_t>(place(row));
    });
  });
  ParallelFor(0, buckets, 1, [&](int64_t bucket, int64_t) {
    const int64_t begin = bucket * in_bucket, end = std::min(begin + in_bucket, n);
    const Buffer<float> mixed(out.begin() + begin * width, out.begin() + end * width);
    for (int64_t row = begin; row < end; ++row) {
      std::copy_n(mixed.data() + (row - begin) * width, width,
                  out.data() + int64_t{belongs[static_cast<size_t>(row)]} * width);
    }
  });
  return out;
}

}  // namespace anchorsplat
