#include "io/inflating_reader.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <new>
#include <string>

#include "core/text.h"
#include "io/little_endian.h"

namespace anchorsplat {

namespace {

constexpr size_t kInput = size_t{128} << 10;

// Reads the file block by block.
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

  // State after the last `unused` bytes of the block were not consumed: trailing bytes, the first four as a number
  // (zero-padded), and an error at that position.
  uint64_t TrailingBytes(size_t unused) const { return end_ - next_ + unused; }
  Result<uint32_t> Mark(size_t unused) const {
    uint8_t bytes[4] = {};
    const auto size = static_cast<size_t>(std::min<uint64_t>(sizeof bytes, TrailingBytes(unused)));
    ANCHORSPLAT_RETURN_IF_ERROR(file_->ReadAt(next_ - unused, bytes, size));
    return LoadLittleEndian<uint32_t>(bytes);
  }
  Error Bad(size_t unused, const std::string& what) const {
    return {ErrorCode::kBadFile,
            Cat(file_->name(), ": byte ", WithThousands(static_cast<int64_t>(next_ - unused)), ": ", what)};
  }

 private:
  const InputFile* file_;
  uint64_t next_, end_;
  std::unique_ptr<uint8_t[]> block_;
  size_t filled_ = 0;  // bytes in the block
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

  Result<size_t> ReadSome(void* out, size_t size) override {
    constexpr uint32_t kGzip = 0x8b1f;
    size_t done = 0;
    while (done < size && !ended_) {
      if (stream_.avail_in == 0) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
        if (filled == 0) return input_.Bad(0, "the file ends before its gzip stream does");
        stream_.next_in = const_cast<Bytef*>(input_.block());
        stream_.avail_in = static_cast<uInt>(filled);
      }
      const auto chunk = static_cast<uInt>(std::min<size_t>(size - done, size_t{1} << 30));
      stream_.next_out = static_cast<Bytef*>(out) + done;
      stream_.avail_out = chunk;
      const int code = inflate(&stream_, Z_NO_FLUSH);
      done += chunk - stream_.avail_out;
      if (code == Z_STREAM_END) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const uint32_t next, input_.Mark(stream_.avail_in));
        ended_ = (next & 0xffff) != kGzip;
        if (!ended_) inflateReset(&stream_);
      } else if (code != Z_OK && code != Z_BUF_ERROR) {
        return Bad("", Cat(" is damaged", stream_.msg != nullptr ? Cat(" (", stream_.msg, ")") : std::string()));
      }
    }
    return done;
  }

  uint64_t TrailingBytes() const override { return input_.TrailingBytes(stream_.avail_in); }

 private:
  Error Bad(std::string_view before, std::string_view after) const override {
    return input_.Bad(stream_.avail_in, Cat(before, "the gzip stream", after));
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

  Result<size_t> ReadSome(void* out, size_t size) override {
    ZSTD_outBuffer to{out, size, 0};
    while (to.pos < to.size) {
      if (!in_frame_) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(const uint32_t next, input_.Mark(unused()));
        // Trailing bytes after the first frame that do not start another frame are not part of the data. Errors in the
        // first frame are reported by the library.
        const bool is_frame =
            next == ZSTD_MAGICNUMBER || (next & ZSTD_MAGIC_SKIPPABLE_MASK) == ZSTD_MAGIC_SKIPPABLE_START;
        if (!is_frame && any_frame_) break;
        in_frame_ = any_frame_ = true;
      }
      const size_t before = to.pos;
      const size_t code = ZSTD_decompressStream(context_, &to, &from_);
      if (ZSTD_isError(code) != 0) return Bad("", Cat(" is damaged (", ZSTD_getErrorName(code), ")"));
      in_frame_ = code != 0;
      if (!in_frame_ || from_.pos < from_.size || to.pos > before) continue;
      ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t filled, input_.Fill());
      if (filled == 0) return Bad("", " is cut off");
      from_ = {input_.block(), filled, 0};
    }
    return to.pos;
  }

  uint64_t TrailingBytes() const override { return input_.TrailingBytes(unused()); }

 private:
  size_t unused() const { return from_.size - from_.pos; }
  Error Bad(std::string_view before, std::string_view after) const override {
    return input_.Bad(unused(), Cat(before, "the zstd stream", after));
  }

  Input input_;
  ZSTD_DCtx* context_;
  ZSTD_inBuffer from_{nullptr, 0, 0};
  bool in_frame_ = false, any_frame_ = false;
};

class PlainReader : public CopyableReader {
 public:
  PlainReader(const InputFile& file, uint64_t begin) : file_(&file), next_(begin) {}

  std::unique_ptr<CopyableReader> Copy() const override { return std::make_unique<PlainReader>(*this); }

  Result<size_t> ReadSome(void* out, size_t size) override {
    const auto some = static_cast<size_t>(std::min<uint64_t>(size, file_->size() - next_));
    ANCHORSPLAT_RETURN_IF_ERROR(file_->ReadAt(next_, out, some));
    next_ += some;
    return some;
  }

  uint64_t TrailingBytes() const override { return file_->size() - next_; }

 private:
  Error Bad(std::string_view before, std::string_view after) const override {
    return {ErrorCode::kBadFile,
            Cat(file_->name(), ": byte ", WithThousands(static_cast<int64_t>(next_)), ": ", before, "the file", after)};
  }

  const InputFile* file_;
  uint64_t next_;
};

}  // namespace

Status InflatingReader::Read(void* out, size_t size) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t read, ReadSome(out, size));
  return read == size ? Status() : Status(Bad("", " ends before its data does"));
}

Status InflatingReader::ExpectEnd() {
  uint8_t beyond = 0;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t read, ReadSome(&beyond, 1));
  if (read > 0) return Bad("", " continues after its data");
  return TrailingBytes() == 0 ? Status() : Status(Bad("there are bytes after ", ""));
}

std::unique_ptr<CopyableReader> OpenPlain(const InputFile& file, uint64_t begin) {
  return std::make_unique<PlainReader>(file, begin);
}

std::unique_ptr<CopyableReader> OpenGzip(const InputFile& file, uint64_t begin) {
  return std::make_unique<GzipReader>(file, begin);
}

std::unique_ptr<InflatingReader> OpenZstd(const InputFile& file, uint64_t begin, uint64_t end) {
  return std::make_unique<ZstdReader>(file, begin, end);
}

}  // namespace anchorsplat
