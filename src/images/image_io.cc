#include "images/image_io.h"

#include <cstdio>
#include <cstring>
#include <string>

#include "core/text.h"
#include "images/decode_image.h"
#include "images/jpeg_file.h"
#include "images/png_file.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

enum class PictureKind { kPng, kJpeg };

// By the first bytes; leaves the file at its beginning.
Result<PictureKind> DetectKind(const OpenedFile& file, const std::string& name) {
  unsigned char head[8] = {};
  const size_t count = std::fread(head, 1, sizeof head, file.handle.get());
  std::rewind(file.handle.get());
  if (count == 8 && std::memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) return PictureKind::kPng;
  if (count >= 3 && std::memcmp(head, "\xff\xd8\xff", 3) == 0) return PictureKind::kJpeg;
  return Error{ErrorCode::kBadFile, Cat(name, ": byte 0: neither a PNG nor a JPEG")};
}

Result<Image> Decode(const OpenedFile& file, const std::string& name) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureKind kind, DetectKind(file, name));
  return (kind == PictureKind::kPng ? DecodePng : DecodeJpeg)(file.handle.get(), name, file.size);
}

}  // namespace

Result<Image> ReadImage(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedFile file, OpenForReading(path));
  return Decode(file, path.string());
}

Result<Image> DecodeImage(const std::string& name, std::string_view bytes) {
  OpenedFile file;
  file.size = bytes.size();
  // Opened for reading only, so that nobody writes through the pointer. No bytes make no file everywhere.
  if (!bytes.empty()) file.handle.reset(::fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb"));
  if (!file.handle) return Error{ErrorCode::kBadFile, Cat(name, ": byte 0: neither a PNG nor a JPEG")};
  return Decode(file, name);
}

Result<ImageSize> ReadImageSize(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedFile file, OpenForReading(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureKind kind, DetectKind(file, path.string()));
  return (kind == PictureKind::kPng ? DecodePngSize : DecodeJpegSize)(file.handle.get(), path.string(), file.size);
}

Status WritePng(const std::filesystem::path& path, const Image& image, const WriteOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  auto bytes = EncodePng(image);
  if (!bytes.ok()) return Error{bytes.error().code, Cat(path.string(), ": ", bytes.error().message)};
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(*bytes));
  return file.Commit();
}

Image CompositeOver(const Image& image, const std::array<float, 3>& background) {
  if (image.channels != 4) return image;
  Image out(image.width, image.height, 3);
  const float* alpha = image.channel(3);
  for (int c = 0; c < 3; ++c) {
    const float behind = background[static_cast<size_t>(c)];
    const float* in = image.channel(c);
    float* to = out.channel(c);
    for (int64_t i = 0; i < image.plane(); ++i) to[i] = in[i] * alpha[i] + behind * (1 - alpha[i]);
  }
  return out;
}

}  // namespace anchorsplat
