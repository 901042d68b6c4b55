#include "images/tiff_file.h"

#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/text.h"
#include "io/compression_ratio.h"

namespace anchorsplat {

namespace {

// Source for libtiff: bytes in memory, and its first error.
struct TiffBytes {
  std::string bytes;
  toff_t position = 0;
  std::string complaint;
};

tmsize_t ReadBytes(thandle_t handle, void* to, tmsize_t count) {
  auto& file = *static_cast<TiffBytes*>(handle);
  // Never -1: libtiff 4.5 adds it to the bytes read and clears memory before its buffer.
  if (count < 0 || file.position > file.bytes.size()) return 0;
  const size_t taken = std::min(static_cast<size_t>(count), file.bytes.size() - static_cast<size_t>(file.position));
  std::memcpy(to, file.bytes.data() + file.position, taken);
  file.position += taken;
  return static_cast<tmsize_t>(taken);
}

tmsize_t WriteNothing(thandle_t, void*, tmsize_t) { return -1; }

toff_t Seek(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<TiffBytes*>(handle);
  file.position = offset + (whence == SEEK_CUR ? file.position : whence == SEEK_END ? file.bytes.size() : 0);
  return file.position;
}

int Close(thandle_t) { return 0; }
toff_t Length(thandle_t handle) { return static_cast<TiffBytes*>(handle)->bytes.size(); }

int OnError(TIFF*, void* user, const char*, const char* format, va_list values) {
  auto& file = *static_cast<TiffBytes*>(user);
  if (!file.complaint.empty()) return 1;
  char text[160];
  std::vsnprintf(text, sizeof text, format, values);
  file.complaint = Printable(text);
  return 1;
}

int OnWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }  // about unused tags

struct TiffCloser {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

// Layout of the image in the file.
struct TiffLayout {
  uint32_t width = 0, height = 0;
  uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK;
  uint16_t planar = PLANARCONFIG_CONTIG, compression = COMPRESSION_NONE, orientation = 1;
  int colors = 1;              // colour samples: grey 1, rgb 3
  bool alpha = false;          // one sample after them
  bool premultiplied = false;  // colours are multiplied by alpha

  // Interleaved samples per pixel.
  int together() const { return planar == PLANARCONFIG_SEPARATE ? 1 : samples; }
  uint64_t bytes() const { return uint64_t{width} * height * samples * (bits / 8u); }
};

class TiffPicture {
 public:
  TiffPicture(std::string name, std::string bytes) : name_(std::move(name)) { file_.bytes = std::move(bytes); }

  Status Open() {
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   &TIFFOpenOptionsFree);
    constexpr tmsize_t kLeast = tmsize_t{1} << 20;
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kLeast + 2 * static_cast<tmsize_t>(file_.bytes.size()));
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), &OnError, &file_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), &OnWarning, &file_);
    tiff_.reset(TIFFClientOpenExt("TIFF", "rm", &file_, &ReadBytes, &WriteNothing, &Seek, &Close, &Length, nullptr,
                                  nullptr, options.get()));
    if (!tiff_) return Bad("is not a readable TIFF");
    return ReadLayout();
  }

  const TiffLayout& layout() const { return layout_; }

  Result<Image> Decode() {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckLayout());
    ANCHORSPLAT_RETURN_IF_ERROR(CheckPages());
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(name_, file_.bytes.size(), layout_.bytes()));
    image_ = Image(static_cast<int>(layout_.width), static_cast<int>(layout_.height), layout_.alpha ? 4 : 3);
    ANCHORSPLAT_RETURN_IF_ERROR(TIFFIsTiled(tiff_.get()) != 0 ? ReadTiles() : ReadStrips());
    if (layout_.premultiplied) DivideByAlpha();
    return std::move(image_);
  }

 private:
  Error Bad(const std::string& sentence) const {
    return Error{ErrorCode::kBadFile,
                 Cat(name_, ": ", sentence, file_.complaint.empty() ? "" : Cat(" (", file_.complaint, ")"))};
  }
  Error NotRead(const std::string& what) const {
    return Error{ErrorCode::kBadFile, Cat(name_, ": a TIFF with ", what,
                                          ", which is not supported; save it as grey or RGB with 8 or 16 bits")};
  }

  Status ReadLayout() {
    TIFF* tiff = tiff_.get();
    TiffLayout& l = layout_;
    if (TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &l.width) == 0 ||
        TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &l.height) == 0) {
      return Bad("a TIFF without width and height");
    }
    if (l.width < 1 || l.height < 1 || l.width > kMaxImageSide || l.height > kMaxImageSide ||
        int64_t{l.width} * l.height > kMaxImagePixels) {
      return Error{ErrorCode::kBadFile, Cat(name_, ": has ", l.width, " x ", l.height, " pixels, expected 1 to ",
                                            WithThousands(kMaxImagePixels), " of them")};
    }
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l.bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &l.samples);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &l.format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &l.planar);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &l.compression);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &l.orientation);
    if (TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &l.photometric) == 0) l.photometric = PHOTOMETRIC_MINISBLACK;
    if (l.orientation < 1 || l.orientation > 8) l.orientation = 1;
    return {};
  }

  // Supported layouts; extra samples that are not alpha are dropped, as the format says.
  Status CheckLayout() {
    TiffLayout& l = layout_;
    constexpr int kMostSamples = 8;
    const std::pair<int, const char*> others[] = {
        {PHOTOMETRIC_PALETTE, "a palette"},      {PHOTOMETRIC_MASK, "a mask"},
        {PHOTOMETRIC_SEPARATED, "CMYK colours"}, {PHOTOMETRIC_YCBCR, "YCbCr colours"},
        {PHOTOMETRIC_CIELAB, "Lab colours"},     {PHOTOMETRIC_CFA, "a sensor's raw values"}};
    for (const auto& [photometric, what] : others) {
      if (l.photometric == photometric) return NotRead(what);
    }
    if (l.photometric > PHOTOMETRIC_RGB) return NotRead(Cat("colours of kind ", l.photometric));
    if (l.format == SAMPLEFORMAT_IEEEFP) return NotRead("floating-point values");
    if (l.format != SAMPLEFORMAT_UINT && l.format != SAMPLEFORMAT_VOID) return NotRead("signed or complex values");
    if (l.bits != 8 && l.bits != 16) return NotRead(Cat(l.bits, l.bits == 1 ? " bit" : " bits", " per value"));
    if (l.planar != PLANARCONFIG_CONTIG && l.planar != PLANARCONFIG_SEPARATE)
      return NotRead("an unknown order of planes");
    for (const int lossy : {COMPRESSION_JPEG, COMPRESSION_OJPEG}) {
      if (l.compression == lossy) return NotRead("a JPEG inside");
    }
    if (TIFFIsCODECConfigured(l.compression) == 0) return NotRead(Cat("compression ", l.compression));
    l.colors = l.photometric == PHOTOMETRIC_RGB ? 3 : 1;
    if (l.samples < l.colors || l.samples > kMostSamples) return NotRead(Cat(l.samples, " values per pixel"));
    uint16_t count = 0;
    const uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_EXTRASAMPLES, &count, &kinds) != 0 && count > 0 && l.samples > l.colors) {
      l.premultiplied = kinds[0] == EXTRASAMPLE_ASSOCALPHA;
      l.alpha = l.premultiplied || kinds[0] == EXTRASAMPLE_UNASSALPHA;
    }
    return {};
  }

  // Smaller images and masks belong to the first; another of its size is a separate image.
  Status CheckPages() {
    constexpr int kMost = 64;
    int pages = 1;
    for (int k = 0; k < kMost && TIFFReadDirectory(tiff_.get()) != 0; ++k) {
      uint32_t kind = 0, width = 0, height = 0;
      TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SUBFILETYPE, &kind);
      (void)TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &width);
      (void)TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &height);
      if ((kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0) continue;
      if (width >= layout_.width && height >= layout_.height) ++pages;
    }
    if (pages > 1) {
      return Error{ErrorCode::kBadFile,
                   Cat(name_, ": a TIFF of ", pages, " pages; save the one you need as a separate file")};
    }
    file_.complaint.clear();
    if (TIFFSetDirectory(tiff_.get(), 0) == 0) return Bad("the TIFF is damaged");
    return {};
  }

  // Converts rows `y` to `y + rows` and columns `x` to `x + columns`, clipped to the image; `stride`: bytes per row.
  void Store(const std::vector<uint8_t>& block, size_t stride, int plane, uint32_t x, uint32_t y, uint32_t columns,
             uint32_t rows) {
    const TiffLayout& l = layout_;
    columns = std::min(columns, l.width - x);
    rows = std::min(rows, l.height - y);
    const int first = l.planar == PLANARCONFIG_SEPARATE ? plane : 0;
    for (int sample = first; sample < first + l.together(); ++sample) {
      const bool alpha = sample == l.colors;
      if (sample > l.colors || (alpha && !l.alpha)) continue;
      const int channel = alpha ? 3 : sample;
      for (uint32_t row = 0; row < rows; ++row) {
        const uint8_t* from = block.data() + row * stride;
        float* to = image_.channel(channel) + int64_t{y + row} * l.width + x;
        for (uint32_t column = 0; column < columns; ++column) {
          const size_t index = size_t{column} * static_cast<size_t>(l.together()) + static_cast<size_t>(sample - first);
          uint16_t wide = 0;
          if (l.bits == 16) std::memcpy(&wide, from + 2 * index, 2);
          const float value =
              l.bits == 16 ? static_cast<float>(wide) / 65535.0f : static_cast<float>(from[index]) / 255.0f;
          to[column] = !alpha && l.photometric == PHOTOMETRIC_MINISWHITE ? 1 - value : value;
        }
      }
      if (l.colors == 3 || alpha) continue;
      for (int copy = 1; copy < 3; ++copy) {
        for (uint32_t row = 0; row < rows; ++row) {
          const int64_t at = int64_t{y + row} * l.width + x;
          std::copy_n(image_.channel(0) + at, columns, image_.channel(copy) + at);
        }
      }
    }
  }

  // Size of a block in bytes, if at most `most` and enough for its pixels.
  Result<size_t> BlockSize(tmsize_t size, uint64_t columns, uint64_t rows) const {
    const uint64_t needed = columns * rows * static_cast<uint64_t>(layout_.together()) * (layout_.bits / 8u);
    const uint64_t most = 4 * layout_.bytes() + (uint64_t{1} << 22);
    if (size <= 0 || static_cast<uint64_t>(size) < needed || static_cast<uint64_t>(size) > most) {
      return Bad("strips or tiles have sizes that do not fit the picture");
    }
    return static_cast<size_t>(size);
  }

  int Planes() const { return layout_.planar == PLANARCONFIG_SEPARATE ? layout_.samples : 1; }

  Status ReadStrips() {
    uint32_t rows = 0;
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_ROWSPERSTRIP, &rows);
    rows = std::min(rows, layout_.height);
    if (rows == 0) return Bad("strips without rows");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t size, BlockSize(TIFFStripSize(tiff_.get()), layout_.width, rows));
    std::vector<uint8_t> block(size);
    const size_t stride = size_t{layout_.width} * static_cast<size_t>(layout_.together()) * (layout_.bits / 8u);
    for (int plane = 0; plane < Planes(); ++plane) {
      for (uint32_t y = 0; y < layout_.height; y += rows) {
        const uint32_t strip = TIFFComputeStrip(tiff_.get(), y, static_cast<uint16_t>(plane));
        const auto wanted = static_cast<tmsize_t>(stride * std::min(rows, layout_.height - y));
        if (TIFFReadEncodedStrip(tiff_.get(), strip, block.data(), wanted) != wanted) return Damaged();
        Store(block, stride, plane, 0, y, layout_.width, rows);
      }
    }
    return {};
  }

  Status ReadTiles() {
    uint32_t columns = 0, rows = 0;
    TIFFGetField(tiff_.get(), TIFFTAG_TILEWIDTH, &columns);
    TIFFGetField(tiff_.get(), TIFFTAG_TILELENGTH, &rows);
    if (columns == 0 || rows == 0) return Bad("tiles without pixels");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t size, BlockSize(TIFFTileSize(tiff_.get()), columns, rows));
    std::vector<uint8_t> block(size);
    const size_t stride = size_t{columns} * static_cast<size_t>(layout_.together()) * (layout_.bits / 8u);
    for (int plane = 0; plane < Planes(); ++plane) {
      for (uint64_t y = 0; y < layout_.height; y += rows) {
        for (uint64_t x = 0; x < layout_.width; x += columns) {
          const auto left = static_cast<uint32_t>(x), top = static_cast<uint32_t>(y);
          const uint32_t tile = TIFFComputeTile(tiff_.get(), left, top, 0, static_cast<uint16_t>(plane));
          if (TIFFReadEncodedTile(tiff_.get(), tile, block.data(), static_cast<tmsize_t>(size)) < 0) return Damaged();
          Store(block, stride, plane, left, top, columns, rows);
        }
      }
    }
    return {};
  }

  Error Damaged() const { return Bad("the TIFF is damaged or cut off"); }

  void DivideByAlpha() {
    const float* alpha = image_.channel(3);
    for (int c = 0; c < 3; ++c) {
      float* values = image_.channel(c);
      for (int64_t i = 0; i < image_.plane(); ++i) values[i] = alpha[i] > 0 ? std::min(1.0f, values[i] / alpha[i]) : 0;
    }
  }

  std::string name_;
  TiffBytes file_;
  TiffLayout layout_;
  Image image_;
  std::unique_ptr<TIFF, TiffCloser> tiff_;  // destroyed first: it reads from file_
};

}  // namespace

Result<Image> DecodeTiff(const std::string& name, std::string bytes) {
  TiffPicture picture(name, std::move(bytes));
  ANCHORSPLAT_RETURN_IF_ERROR(picture.Open());
  return picture.Decode();
}

Result<ImageSize> DecodeTiffSize(const std::string& name, std::string bytes) {
  TiffPicture picture(name, std::move(bytes));
  ANCHORSPLAT_RETURN_IF_ERROR(picture.Open());
  const TiffLayout& l = picture.layout();
  return ImageSize{static_cast<int>(l.width), static_cast<int>(l.height), l.orientation};
}

}  // namespace anchorsplat
