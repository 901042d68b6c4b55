#include "images/jpeg_file.h"

// jpeglib.h wants FILE and size_t declared before it.
#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "core/text.h"
#include "images/orientation.h"

namespace anchorsplat {

namespace {

// A progressive file may repeat scans endlessly, each a pass over the image; encoders write about ten.
constexpr int kMaxScans = 200;

// libjpeg reports errors by longjmp, like libpng: objects with destructors live outside of setjmp.
struct JpegReader {
  jpeg_decompress_struct info{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX] = "";
  Image image;
  std::vector<JSAMPLE> row;

  JpegReader() { info.err = jpeg_std_error(&errors); }
  ~JpegReader() { jpeg_destroy_decompress(&info); }
};

[[noreturn]] void Fail(j_common_ptr info) {
  auto* reader = static_cast<JpegReader*>(info->client_data);
  info->err->format_message(info, reader->message);
  std::longjmp(reader->jump, 1);
}

// libjpeg only warns of damaged data and fills the rest with grey; here an incomplete image is an error.
void OnMessage(j_common_ptr info, int level) {
  if (level >= 0) return;  // traces
  const int code = info->err->msg_code;
  if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM) return;  // bytes between markers: all pixels are intact
  Fail(info);
}

void OnProgress(j_common_ptr info) {
  auto* reader = static_cast<JpegReader*>(info->client_data);
  if (reader->info.input_scan_number <= kMaxScans) return;
  std::snprintf(reader->message, sizeof reader->message, "more than %d scans", kMaxScans);
  std::longjmp(reader->jump, 1);
}

bool ReadHeader(JpegReader& reader, std::FILE* file, bool keep_exif = false) {
  reader.errors.error_exit = Fail;
  reader.errors.emit_message = OnMessage;
  reader.progress.progress_monitor = OnProgress;
  reader.info.client_data = &reader;
  if (setjmp(reader.jump)) return false;  // NOLINT(cert-err52-cpp): libjpeg's way
  jpeg_create_decompress(&reader.info);
  reader.info.progress = &reader.progress;
  jpeg_stdio_src(&reader.info, file);
  if (keep_exif) jpeg_save_markers(&reader.info, JPEG_APP0 + 1, 0xFFFF);
  jpeg_read_header(&reader.info, TRUE);
  return true;
}

// CMYK without a profile. Adobe's programs store inverted ink values.
void StoreCmyk(const JSAMPLE* row, int64_t y, bool inverted, Image& image) {
  for (int c = 0; c < 3; ++c) {
    float* out = image.channel(c) + y * image.width;
    for (int x = 0; x < image.width; ++x) {
      const int ink = row[int64_t{x} * 4 + c], black = row[int64_t{x} * 4 + 3];
      out[x] = static_cast<float>(inverted ? ink * black : (255 - ink) * (255 - black)) / (255.0f * 255.0f);
    }
  }
}

int OrientationOf(const jpeg_decompress_struct& info) {
  constexpr std::string_view kExif("Exif\0\0", 6);
  for (const jpeg_marker_struct* marker = info.marker_list; marker != nullptr; marker = marker->next) {
    const std::string_view data(reinterpret_cast<const char*>(marker->data), marker->data_length);
    if (data.starts_with(kExif)) return OrientationOfExif(data.substr(kExif.size()));
  }
  return 1;
}

bool ReadPixels(JpegReader& reader) {
  if (setjmp(reader.jump)) return false;  // NOLINT(cert-err52-cpp)
  jpeg_start_decompress(&reader.info);
  Image& image = reader.image;
  const int samples = reader.info.output_components;
  while (reader.info.output_scanline < reader.info.output_height) {
    const int64_t y = reader.info.output_scanline;
    JSAMPROW row = reader.row.data();
    jpeg_read_scanlines(&reader.info, &row, 1);
    if (samples == 4) {
      StoreCmyk(row, y, reader.info.saw_Adobe_marker != 0, image);
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      float* out = image.channel(c) + y * image.width;
      const JSAMPLE* in = row + (samples == 1 ? 0 : c);
      for (int x = 0; x < image.width; ++x) out[x] = static_cast<float>(in[int64_t{x} * samples]) / 255.0f;
    }
  }
  jpeg_finish_decompress(&reader.info);
  return true;
}

Error JpegError(const JpegReader& reader, const std::string& name) {
  return Error{ErrorCode::kBadFile, Cat(name, ": damaged JPEG: ", reader.message)};
}

Status CheckHeader(const JpegReader& reader, const std::string& name, uint64_t bytes) {
  const jpeg_decompress_struct& info = reader.info;
  const int64_t pixels = int64_t{info.image_width} * int64_t{info.image_height};
  if (pixels > kMaxImagePixels) {
    return Error{ErrorCode::kBadFile, Cat(name, ": ", info.image_width, " x ", info.image_height, ", more than ",
                                          WithThousands(kMaxImagePixels), " pixels")};
  }
  // With Huffman codes, a block of 64 pixels takes at least one bit; arithmetic coding has no such bound.
  if (!info.arith_code && static_cast<uint64_t>(pixels) / 1024 > bytes) {
    return Error{ErrorCode::kBadFile, Cat(name, ": a JPEG of ", info.image_width, " x ", info.image_height,
                                          " cannot have only ", WithThousands(static_cast<int64_t>(bytes)), " bytes")};
  }
  return {};
}

}  // namespace

Result<ImageSize> DecodeJpegSize(std::FILE* file, const std::string& name, uint64_t bytes) {
  JpegReader reader;
  if (!ReadHeader(reader, file, /*keep_exif=*/true)) return JpegError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckHeader(reader, name, bytes));
  return ImageSize{static_cast<int>(reader.info.image_width), static_cast<int>(reader.info.image_height),
                   OrientationOf(reader.info)};
}

Result<Image> DecodeJpeg(std::FILE* file, const std::string& name, uint64_t bytes) {
  JpegReader reader;
  if (!ReadHeader(reader, file)) return JpegError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckHeader(reader, name, bytes));
  const bool grey = reader.info.jpeg_color_space == JCS_GRAYSCALE;
  const bool inks = reader.info.jpeg_color_space == JCS_CMYK || reader.info.jpeg_color_space == JCS_YCCK;
  reader.info.out_color_space = grey ? JCS_GRAYSCALE : inks ? JCS_CMYK : JCS_RGB;
  const int width = static_cast<int>(reader.info.image_width), height = static_cast<int>(reader.info.image_height);
  try {
    reader.image = Image(width, height, 3);
    reader.row.resize(static_cast<size_t>(width) * (grey ? 1 : inks ? 4 : 3));
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(name, ": does not fit into memory")};
  }
  if (!ReadPixels(reader)) return JpegError(reader, name);
  return std::move(reader.image);
}

Result<Image> DecodeJpegBytes(std::string_view bytes, const std::string& name) {
  // Only read from, despite its signature.
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb"),
                                                       std::fclose);
  if (file == nullptr) return Error{ErrorCode::kIo, Cat(name, ": cannot be read from memory")};
  return DecodeJpeg(file.get(), name, bytes.size());
}

namespace {

struct JpegWriter {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX] = "";
  unsigned char* bytes = nullptr;
  unsigned long size = 0;       // NOLINT(google-runtime-int): libjpeg's type
  std::vector<JSAMPLE> pixels;  // [H,W,3]

  JpegWriter() { info.err = jpeg_std_error(&errors); }
  ~JpegWriter() {
    jpeg_destroy_compress(&info);
    std::free(bytes);  // NOLINT(cppcoreguidelines-no-malloc): libjpeg's own
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;
};

[[noreturn]] void FailToWrite(j_common_ptr info) {
  auto* writer = static_cast<JpegWriter*>(info->client_data);
  info->err->format_message(info, writer->message);
  std::longjmp(writer->jump, 1);
}

bool WritePixels(JpegWriter& writer, const Image& image, int quality) {
  writer.errors.error_exit = FailToWrite;
  writer.info.client_data = &writer;
  if (setjmp(writer.jump)) return false;  // NOLINT(cert-err52-cpp): libjpeg's way
  jpeg_create_compress(&writer.info);
  jpeg_mem_dest(&writer.info, &writer.bytes, &writer.size);
  writer.info.image_width = static_cast<JDIMENSION>(image.width);
  writer.info.image_height = static_cast<JDIMENSION>(image.height);
  writer.info.input_components = 3;
  writer.info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&writer.info);
  jpeg_set_quality(&writer.info, quality, TRUE);
  jpeg_start_compress(&writer.info, TRUE);
  while (writer.info.next_scanline < writer.info.image_height) {
    JSAMPROW row = writer.pixels.data() + size_t{3} * static_cast<size_t>(image.width) * writer.info.next_scanline;
    jpeg_write_scanlines(&writer.info, &row, 1);
  }
  jpeg_finish_compress(&writer.info);
  return true;
}

}  // namespace

Result<std::string> EncodeJpeg(const Image& image, int quality) {
  if (image.channels != 3 || image.plane() == 0 || std::max(image.width, image.height) > 65500 || quality < 1 ||
      quality > 100) {
    return Error{ErrorCode::kBadArgument, Cat("no JPEG of quality ", quality, " of ", image.channels, " channels of ",
                                              image.width, " x ", image.height, " pixels")};
  }
  JpegWriter writer;
  writer.pixels.resize(image.pixels.size());
  for (int64_t i = 0; i < image.plane(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const float value = std::clamp(image.channel(c)[i], 0.0f, 1.0f) * 255.0f;
      writer.pixels[static_cast<size_t>(3 * i + c)] = static_cast<JSAMPLE>(std::lround(value));
    }
  }
  if (!WritePixels(writer, image, quality)) {
    return Error{ErrorCode::kIo, Cat("cannot write a JPEG: ", writer.message)};
  }
  return std::string(reinterpret_cast<const char*>(writer.bytes), writer.size);
}

}  // namespace anchorsplat
