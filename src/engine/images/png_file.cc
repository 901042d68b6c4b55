#include "images/png_file.h"

#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <new>
#include <vector>

#include "core/text.h"
#include "images/orientation.h"

namespace anchorsplat {

namespace {

// libpng reports errors by longjmp, so no object with a destructor may be created after setjmp: everything lives in one
// of the two structs below, owned by the caller.
struct PngErrors {
  std::jmp_buf jump;
  char message[160] = "";
};

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  auto* errors = static_cast<PngErrors*>(png_get_error_ptr(png));
  std::snprintf(errors->message, sizeof errors->message, "%s", message);
  std::longjmp(errors->jump, 1);
}

void OnWarning(png_structp, png_const_charp) {}  // about unused chunks such as text and profiles

struct PngReader {
  std::FILE* file = nullptr;
  uint64_t file_bytes = 0;
  bool truncated = false;
  PngErrors errors;
  png_structp png = nullptr;
  png_infop info = nullptr;
  Image image;
  std::vector<png_byte> rows;  // one row; all of them if the file is interlaced

  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void ReadBytes(png_structp png, png_bytep to, size_t count) {
  auto* reader = static_cast<PngReader*>(png_get_io_ptr(png));
  if (std::fread(to, 1, count, reader->file) != count) {
    reader->truncated = true;
    png_error(png, "file ends early");
  }
}

// False on error, stored in reader.errors. Sets up the output layout: rgb or rgba, 8 or 16 bits.
bool ReadHeader(PngReader& reader) {
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader.errors, OnError, OnWarning);
  if (reader.png == nullptr) return false;
  if (setjmp(reader.errors.jump)) return false;  // NOLINT(cert-err52-cpp): libpng's way
  reader.info = png_create_info_struct(reader.png);
  if (reader.info == nullptr) png_error(reader.png, "out of memory");
  png_set_read_fn(reader.png, &reader, ReadBytes);
  png_set_user_limits(reader.png, kMaxImageSide, kMaxImageSide);
  png_set_crc_action(reader.png, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
  png_read_info(reader.png, reader.info);
  return true;
}

bool SetUpLayout(PngReader& reader) {
  if (setjmp(reader.errors.jump)) return false;  // NOLINT(cert-err52-cpp)
  png_set_expand(reader.png);                    // palette to rgb, 1–4 bits to 8, transparent colour to alpha
  png_set_gray_to_rgb(reader.png);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(reader.png);  // 16-bit files are big endian
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

template <typename Sample>
void StoreRow(const png_byte* row, int y, float scale, Image& image) {
  const int channels = image.channels;
  for (int c = 0; c < channels; ++c) {
    float* out = image.channel(c) + int64_t{y} * image.width;
    for (int x = 0; x < image.width; ++x) {
      Sample sample;
      std::memcpy(&sample, row + (static_cast<size_t>(x) * channels + c) * sizeof(Sample), sizeof sample);
      out[x] = static_cast<float>(sample) / scale;
    }
  }
}

bool ReadPixels(PngReader& reader, size_t stride, int passes, bool wide) {
  if (setjmp(reader.errors.jump)) return false;  // NOLINT(cert-err52-cpp)
  for (int pass = 0; pass < passes; ++pass) {
    for (int y = 0; y < reader.image.height; ++y) {
      png_byte* row = reader.rows.data() + (passes > 1 ? stride * static_cast<size_t>(y) : 0);
      png_read_row(reader.png, row, nullptr);
      if (pass + 1 < passes) continue;
      if (wide) {
        StoreRow<uint16_t>(row, y, 65535.0f, reader.image);
      } else {
        StoreRow<uint8_t>(row, y, 255.0f, reader.image);
      }
    }
  }
  png_read_end(reader.png, nullptr);  // detects truncation after the pixels
  return true;
}

Error PngError(const PngReader& reader, const std::string& name) {
  if (reader.truncated) {
    return Error{ErrorCode::kBadFile,
                 Cat(name, ": byte ", WithThousands(static_cast<int64_t>(reader.file_bytes)), ": the PNG ends early")};
  }
  return Error{ErrorCode::kBadFile, Cat(name, ": byte ", WithThousands(std::max(0L, std::ftell(reader.file))),
                                        ": damaged PNG: ", reader.errors.message)};
}

Status CheckSize(const PngReader& reader, const std::string& name) {
  const int64_t width = png_get_image_width(reader.png, reader.info);
  const int64_t height = png_get_image_height(reader.png, reader.info);
  if (width > kMaxImageSide || height > kMaxImageSide || width * height > kMaxImagePixels) {
    return Error{ErrorCode::kBadFile,
                 Cat(name, ": ", width, " x ", height, ", more than ", WithThousands(kMaxImagePixels), " pixels")};
  }
  // Deflate compresses by at most 1032: a file that claims more is truncated.
  const uint64_t packed = png_get_rowbytes(reader.png, reader.info) * static_cast<uint64_t>(height);
  if (packed / 1032 > reader.file_bytes) {
    return Error{ErrorCode::kBadFile, Cat(name, ": a PNG of ", width, " x ", height, " cannot have only ",
                                          WithThousands(static_cast<int64_t>(reader.file_bytes)), " bytes")};
  }
  return {};
}

struct PngWriter {
  PngErrors errors;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string bytes;
  std::vector<png_byte> row;

  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

void AppendBytes(png_structp png, png_bytep from, size_t count) {
  auto* writer = static_cast<PngWriter*>(png_get_io_ptr(png));
  try {
    writer->bytes.append(reinterpret_cast<const char*>(from), count);
    return;
  } catch (const std::bad_alloc&) {
    // Nothing here: the longjmp below must not leave a handler unfinished.
  }
  png_error(png, "out of memory");
}

void IgnoreFlush(png_structp) {}

// NaN becomes 0, as all comparisons with it are false.
png_byte Quantized(float value) {
  return value > 0 ? (value < 1 ? static_cast<png_byte>(value * 255.0f + 0.5f) : png_byte{255}) : png_byte{0};
}

// Text chunk with the name of the program, and our value for renderings.
constexpr std::string_view kProgram = "Software", kRendering = "anchorsplat render", kComment = "Comment";

png_text Text(std::string_view key, std::string_view value) {
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = const_cast<png_charp>(key.data());  // libpng does not write to it
  text.text = const_cast<png_charp>(value.data());
  text.text_length = value.size();
  return text;
}

bool WritePixels(PngWriter& writer, const Image& image, bool rendering, const std::string& comment) {
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer.errors, OnError, OnWarning);
  if (writer.png == nullptr) return false;
  if (setjmp(writer.errors.jump)) return false;  // NOLINT(cert-err52-cpp)
  writer.info = png_create_info_struct(writer.png);
  if (writer.info == nullptr) png_error(writer.png, "out of memory");
  png_set_write_fn(writer.png, &writer, AppendBytes, IgnoreFlush);
  png_set_user_limits(writer.png, kMaxImageSide, kMaxImageSide);
  const int type = image.channels == 1   ? PNG_COLOR_TYPE_GRAY
                   : image.channels == 3 ? PNG_COLOR_TYPE_RGB
                                         : PNG_COLOR_TYPE_RGBA;
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
               8, type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (rendering) {
    const png_text text = Text(kProgram, kRendering);
    png_set_text(writer.png, writer.info, &text, 1);
  }
  if (!comment.empty()) {
    const png_text text = Text(kComment, comment);
    png_set_text(writer.png, writer.info, &text, 1);
  }
  // A third of the default's time; renderings are 6 to 19 % larger.
  png_set_compression_level(writer.png, 3);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
  png_write_info(writer.png, writer.info);
  const int channels = image.channels;
  for (int y = 0; y < image.height; ++y) {
    for (int c = 0; c < channels; ++c) {
      const float* in = image.channel(c) + int64_t{y} * image.width;
      png_byte* out = writer.row.data() + c;
      for (int x = 0; x < image.width; ++x) out[static_cast<ptrdiff_t>(x) * channels] = Quantized(in[x]);
    }
    png_write_row(writer.png, writer.row.data());
  }
  png_write_end(writer.png, nullptr);
  return true;
}

}  // namespace

Result<ImageSize> DecodePngSize(std::FILE* file, const std::string& name, uint64_t bytes) {
  PngReader reader;
  reader.file = file;
  reader.file_bytes = bytes;
  if (!ReadHeader(reader)) return PngError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSize(reader, name));
  ImageSize size{static_cast<int>(png_get_image_width(reader.png, reader.info)),
                 static_cast<int>(png_get_image_height(reader.png, reader.info))};
#ifdef PNG_eXIf_SUPPORTED
  png_bytep exif = nullptr;
  png_uint_32 exif_bytes = 0;
  if (png_get_eXIf_1(reader.png, reader.info, &exif_bytes, &exif) != 0 && exif != nullptr) {
    size.orientation = OrientationOfExif({reinterpret_cast<const char*>(exif), exif_bytes});
  }
#endif
  return size;
}

Result<Image> DecodePng(std::FILE* file, const std::string& name, uint64_t bytes) {
  PngReader reader;
  reader.file = file;
  reader.file_bytes = bytes;
  if (!ReadHeader(reader)) return PngError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSize(reader, name));
  if (!SetUpLayout(reader)) return PngError(reader, name);
  const int channels = png_get_channels(reader.png, reader.info);
  const int depth = png_get_bit_depth(reader.png, reader.info);
  if ((channels != 3 && channels != 4) || (depth != 8 && depth != 16)) {
    return Error{ErrorCode::kBadFile, Cat(name, ": PNG with ", channels, " channels of ", depth, " bits")};
  }
  const size_t stride = png_get_rowbytes(reader.png, reader.info);
  const bool interlaced = png_get_interlace_type(reader.png, reader.info) != PNG_INTERLACE_NONE;
  const int height = static_cast<int>(png_get_image_height(reader.png, reader.info));
  try {
    reader.image = Image(static_cast<int>(png_get_image_width(reader.png, reader.info)), height, channels);
    reader.rows.resize(interlaced ? stride * static_cast<size_t>(height) : stride);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(name, ": does not fit into memory")};
  }
  if (!ReadPixels(reader, stride, interlaced ? PNG_INTERLACE_ADAM7_PASSES : 1, depth == 16)) {
    return PngError(reader, name);
  }
  return std::move(reader.image);
}

Result<std::string> EncodePng(const Image& image, bool rendering, const std::string& comment) {
  if (image.channels != 1 && image.channels != 3 && image.channels != 4) {
    return Error{ErrorCode::kBadArgument, Cat("a PNG has 1, 3 or 4 channels, not ", image.channels)};
  }
  if (image.width < 1 || image.height < 1 || image.width > kMaxImageSide || image.height > kMaxImageSide ||
      image.plane() > kMaxImagePixels ||
      image.pixels.size() != static_cast<size_t>(image.plane()) * static_cast<size_t>(image.channels)) {
    return Error{ErrorCode::kBadArgument, Cat("an image of ", image.width, " x ", image.height, " x ", image.channels,
                                              " with ", image.pixels.size(), " values cannot be written")};
  }
  PngWriter writer;
  writer.row.resize(static_cast<size_t>(image.width) * static_cast<size_t>(image.channels));
  if (!WritePixels(writer, image, rendering, comment))
    return Error{ErrorCode::kIo, Cat("PNG encoder: ", writer.errors.message)};
  return std::move(writer.bytes);
}

bool IsMarkedAsRendering(std::string_view head) {
  const std::string mark = Cat("tEXt", kProgram, '\0', kRendering);
  // Search before the pixels, which may contain any bytes.
  return head.starts_with("\x89PNG") && head.substr(0, head.find("IDAT")).find(mark) != std::string_view::npos;
}

}  // namespace anchorsplat
