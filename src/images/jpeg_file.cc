#include "images/jpeg_file.h"

// jpeglib.h wants FILE and size_t declared before it.
#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <csetjmp>
#include <new>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

// A progressive file may repeat its scans without end, each costing a pass over the picture; encoders write about ten.
constexpr int kMaxScans = 200;

// libjpeg jumps like libpng: everything with a destructor is owned from outside of setjmp.
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

// libjpeg calls damaged data a warning and fills the rest with grey; a picture that is partly made up is an error here.
void OnMessage(j_common_ptr info, int level) {
  if (level >= 0) return;  // traces
  const int code = info->err->msg_code;
  if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM) return;  // bytes between markers: pixels are all there
  Fail(info);
}

void OnProgress(j_common_ptr info) {
  auto* reader = static_cast<JpegReader*>(info->client_data);
  if (reader->info.input_scan_number <= kMaxScans) return;
  std::snprintf(reader->message, sizeof reader->message, "more than %d scans", kMaxScans);
  std::longjmp(reader->jump, 1);
}

bool ReadHeader(JpegReader& reader, std::FILE* file) {
  reader.errors.error_exit = Fail;
  reader.errors.emit_message = OnMessage;
  reader.progress.progress_monitor = OnProgress;
  reader.info.client_data = &reader;
  if (setjmp(reader.jump)) return false;  // NOLINT(cert-err52-cpp): libjpeg's way
  jpeg_create_decompress(&reader.info);
  reader.info.progress = &reader.progress;
  jpeg_stdio_src(&reader.info, file);
  jpeg_read_header(&reader.info, TRUE);
  return true;
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
  // With Huffman codes a block of 64 pixels takes a bit at the very least; arithmetic coding has no such bound.
  if (!info.arith_code && static_cast<uint64_t>(pixels) / 1024 > bytes) {
    return Error{ErrorCode::kBadFile, Cat(name, ": a JPEG of ", info.image_width, " x ", info.image_height,
                                          " cannot have only ", WithThousands(static_cast<int64_t>(bytes)), " bytes")};
  }
  if (info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK) {
    return Error{ErrorCode::kBadFile, Cat(name, ": CMYK JPEG; convert it to RGB first")};
  }
  return {};
}

}  // namespace

Result<ImageSize> DecodeJpegSize(std::FILE* file, const std::string& name, uint64_t bytes) {
  JpegReader reader;
  if (!ReadHeader(reader, file)) return JpegError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckHeader(reader, name, bytes));
  return ImageSize{static_cast<int>(reader.info.image_width), static_cast<int>(reader.info.image_height)};
}

Result<Image> DecodeJpeg(std::FILE* file, const std::string& name, uint64_t bytes) {
  JpegReader reader;
  if (!ReadHeader(reader, file)) return JpegError(reader, name);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckHeader(reader, name, bytes));
  const bool grey = reader.info.jpeg_color_space == JCS_GRAYSCALE;
  reader.info.out_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
  const int width = static_cast<int>(reader.info.image_width), height = static_cast<int>(reader.info.image_height);
  try {
    reader.image = Image(width, height, 3);
    reader.row.resize(static_cast<size_t>(width) * (grey ? 1 : 3));
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(name, ": does not fit into memory")};
  }
  if (!ReadPixels(reader)) return JpegError(reader, name);
  return std::move(reader.image);
}

}  // namespace anchorsplat
