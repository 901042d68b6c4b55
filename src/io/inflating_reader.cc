#include "io/inflating_reader.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <new>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr size_t kInput = size_t{128} << 10;

// Hands out the file's bytes block by block.
class Input {
 public:
  Input(const InputFile& file, uint64_t begin, uint64_t end)
      : file_(&file), next_(begin), end_(end), block_(new uint8_t[kInput]) {}
  Input(const Input& other) : Input(*other.file_, other.next_, other.end_) {
    filled_ = other.filled_;
    std::copy_n(other.block_.get(), filled_, block_.get());
  }
  Input& operator=(const Input&) = delete;

  // The next block, empty at the end.
  Result<size_t> Fill() {
    const size_t size = static_cast<size_t>(std::min<uint64_t>(kInput, end_ - next_));
    ANCHORSPLAT_RETURN_IF_ERROR(file_->ReadAt(next_, block_.get(), size));
    next_ += size;
    filled_ = size;
    return size;
  }
  const uint8_t* block() const { return block_.get(); }
  Error Bad(size_t left, const std::string& what) const {
    return {ErrorCode::kBadFile,
            Cat(file_->name(), ": byte ", WithThousands(static_cast<int64_t>(next_ - left)), ": ", what)};
  }

 private:
  const InputFile* file_;
  uint64_t next_, end_;
  std::unique_ptr<uint8_t[]> block_;
  size_t filled_ = 0;  // bytes of the block
};

class GzipReader : public CopyableReader {
 public:
  GzipReader(const InputFile& file, uint64_t begin) : input_(file, begin, file.size()) {
    if (inflateInit2(&stream_, 16 + MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  GzipReader(const GzipReader& other) : input_(other.input_), ended_(other.ended_) {
    if (inflateCopy(&stream_, const_cast<z_stream*>(&other.stream_)) != Z_OK) throw std::bad_alloc();
    if (stream_.avail_in == 0) return;
    stream_.next_in = const_cast<Bytef*>(input_.block()) + (other.stream_.next_in - other.input_.block());
  }
  GzipReader& operator=(const GzipReader&) = delete;
  ~GzipReader() override { inflateEnd(&stream_); }

  std::unique_ptr<CopyableReader> Copy() const override { return std::make_unique<GzipReader>(*this); }

  Status Read(void* out, size_t size) override {
    auto* to = static_cast<Bytef*>(out);
    while (size > 0) {
      if (stream_.avail_in == 0) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
        if (filled == 0) return input_.Bad(0, "the file ends before its gzip stream does");
        stream_.next_in = const_cast<Bytef*>(input_.block());
        stream_.avail_in = static_cast<uInt>(filled);
      }
      const auto chunk = static_cast<uInt>(std::min<size_t>(size, size_t{1} << 30));
      stream_.next_out = to;
      stream_.avail_out = chunk;
      const int code = ended_ ? Z_STREAM_END : inflate(&stream_, Z_NO_FLUSH);
      to += chunk - stream_.avail_out;
      size -= chunk - stream_.avail_out;
      if (code == Z_STREAM_END && size > 0) {
        return input_.Bad(stream_.avail_in, "the gzip stream ends before its data does");
      }
      ended_ = code == Z_STREAM_END;
      if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) return Damaged();
    }
    return {};
  }

  Status ExpectEnd() override {
    Bytef beyond = 0;
    while (!ended_) {
      if (stream_.avail_in == 0) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
        if (filled == 0) return input_.Bad(0, "the file ends before its gzip stream does");
        stream_.next_in = const_cast<Bytef*>(input_.block());
        stream_.avail_in = static_cast<uInt>(filled);
      }
      stream_.next_out = &beyond;
      stream_.avail_out = 1;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) return Damaged();
      if (stream_.avail_out == 0) return input_.Bad(stream_.avail_in, "the gzip stream goes on behind its data");
      ended_ = code == Z_STREAM_END;
    }
    if (stream_.avail_in == 0) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
      stream_.avail_in = static_cast<uInt>(filled);
    }
    if (stream_.avail_in > 0) return input_.Bad(stream_.avail_in, "there are bytes behind the gzip stream");
    return {};
  }

 private:
  Error Damaged() const {
    return input_.Bad(stream_.avail_in, Cat("the gzip stream is damaged",
                                            stream_.msg != nullptr ? Cat(" (", stream_.msg, ")") : std::string()));
  }

  Input input_;
  z_stream stream_{};
  bool ended_ = false;
};

class ZstdReader : public InflatingReader {
 public:
  ZstdReader(const InputFile& file, uint64_t begin, uint64_t end)
      : input_(file, begin, end), context_(ZSTD_createDCtx()) {
    if (context_ == nullptr) throw std::bad_alloc();
  }
  ZstdReader(const ZstdReader&) = delete;
  ZstdReader& operator=(const ZstdReader&) = delete;
  ~ZstdReader() override { ZSTD_freeDCtx(context_); }

  Status Read(void* out, size_t size) override {
    ZSTD_outBuffer to{out, size, 0};
    while (to.pos < to.size) {
      const size_t before = to.pos;
      const size_t code = ZSTD_decompressStream(context_, &to, &from_);
      if (ZSTD_isError(code) != 0) return Damaged(code);
      if (to.pos == to.size) break;
      if (from_.pos < from_.size || to.pos > before) continue;
      ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
      if (filled == 0) return input_.Bad(0, "the zstd stream ends before its data does");
      from_ = {input_.block(), filled, 0};
    }
    return {};
  }

  Status ExpectEnd() override {
    uint8_t beyond = 0;
    for (;;) {
      if (from_.pos == from_.size) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
        if (filled == 0) return {};
        from_ = {input_.block(), filled, 0};
      }
      ZSTD_outBuffer to{&beyond, 1, 0};
      const size_t code = ZSTD_decompressStream(context_, &to, &from_);
      if (ZSTD_isError(code) != 0) return Damaged(code);
      if (to.pos > 0) return input_.Bad(from_.size - from_.pos, "the zstd stream goes on behind its data");
    }
  }

 private:
  Error Damaged(size_t code) const {
    return input_.Bad(from_.size - from_.pos, Cat("the zstd stream is damaged (", ZSTD_getErrorName(code), ")"));
  }

  Input input_;
  ZSTD_DCtx* context_;
  ZSTD_inBuffer from_{nullptr, 0, 0};
};

}  // namespace

std::unique_ptr<CopyableReader> OpenGzip(const InputFile& file, uint64_t begin) {
  return std::make_unique<GzipReader>(file, begin);
}

std::unique_ptr<InflatingReader> OpenZstd(const InputFile& file, uint64_t begin, uint64_t end) {
  return std::make_unique<ZstdReader>(file, begin, end);
}

}  // namespace anchorsplat
