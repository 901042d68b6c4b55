#include "images/image_io.h"

#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "core/text.h"
#include "images/decode_image.h"
#include "images/jpeg_file.h"
#include "images/png_file.h"
#include "images/tiff_file.h"
#include "images/webp_image.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

enum class PictureKind { kPng, kJpeg, kWebp, kTiff };

// Names the type of a file that is not a supported image, from its first bytes, for common mistakes; empty: unknown.
std::string OtherKind(std::string_view head) {
  if (head.size() >= 12 && head.substr(4, 4) == "ftyp") {
    const std::string_view brand = head.substr(8, 4);
    if (brand == "avif" || brand == "avis") return "an AVIF";
    for (const char* heic : {"heic", "heix", "heim", "heis", "hevc", "hevx", "mif1", "msf1"}) {
      if (brand == heic) return "a HEIC";
    }
  }
  const std::pair<std::string_view, const char*> kinds[] = {{"GIF8", "a GIF"},
                                                            {"BM", "a BMP"},
                                                            {"\x76\x2f\x31\x01", "an OpenEXR"},
                                                            {"#?RADIANCE", "a Radiance HDR"},
                                                            {"\xff\x0a", "a JPEG XL"},
                                                            {std::string_view("\0\0\0\x0cJXL ", 8), "a JPEG XL"},
                                                            {std::string_view("\0\0\0\x0cjP  ", 8), "a JPEG 2000"}};
  for (const auto& [begin, kind] : kinds) {
    if (head.starts_with(begin)) return kind;
  }
  return "";
}

// Detects the type by the first bytes; leaves the file at its beginning.
Result<PictureKind> DetectKind(const OpenedFile& file, const std::string& name) {
  char bytes[16] = {};
  const std::string_view head(bytes, std::fread(bytes, 1, sizeof bytes, file.handle.get()));
  std::rewind(file.handle.get());
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return PictureKind::kPng;
  if (head.starts_with("\xff\xd8\xff")) return PictureKind::kJpeg;
  if (head.starts_with("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return PictureKind::kWebp;
  for (const std::string_view tiff : {std::string_view("II*\0", 4), std::string_view("MM\0*", 4),
                                      std::string_view("II+\0", 4), std::string_view("MM\0+", 4)}) {
    if (head.starts_with(tiff)) return PictureKind::kTiff;
  }
  if (const std::string other = OtherKind(head); !other.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(name, ": is ", other, " picture, which is not supported; convert it to JPEG or PNG")};
  }
  return Error{ErrorCode::kBadFile, Cat(name, ": byte 0: not a PNG, JPEG, WebP or TIFF")};
}

Result<std::string> AllOf(const OpenedFile& file, const std::string& name) {
  std::string bytes(file.size, '\0');
  if (std::fread(bytes.data(), 1, bytes.size(), file.handle.get()) != bytes.size()) {
    return Error{ErrorCode::kIo, Cat(name, ": cannot be read completely")};
  }
  return bytes;
}

Result<Image> Decode(const OpenedFile& file, const std::string& name) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureKind kind, DetectKind(file, name));
  if (kind == PictureKind::kPng) return DecodePng(file.handle.get(), name, file.size);
  if (kind == PictureKind::kJpeg) return DecodeJpeg(file.handle.get(), name, file.size);
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string bytes, AllOf(file, name));
  return kind == PictureKind::kWebp ? DecodeWebpPhotograph(name, bytes) : DecodeTiff(name, std::move(bytes));
}

}  // namespace

Result<Image> ReadImage(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedFile file, OpenForReading(path));
  return Decode(file, path.string());
}

Result<Image> DecodeImage(const std::string& name, std::string_view bytes) {
  OpenedFile file;
  file.size = bytes.size();
  // Read-only, so the pointer is never written through. Zero bytes are not a file on every system.
  if (!bytes.empty()) file.handle.reset(::fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb"));
  if (!file.handle) return Error{ErrorCode::kBadFile, Cat(name, ": byte 0: not a PNG, JPEG, WebP or TIFF")};
  return Decode(file, name);
}

Result<ImageSize> ReadImageSize(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedFile file, OpenForReading(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureKind kind, DetectKind(file, path.string()));
  const std::string name = path.string();
  if (kind == PictureKind::kPng) return DecodePngSize(file.handle.get(), name, file.size);
  if (kind == PictureKind::kJpeg) return DecodeJpegSize(file.handle.get(), name, file.size);
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string bytes, AllOf(file, name));
  return kind == PictureKind::kWebp ? DecodeWebpSize(name, bytes) : DecodeTiffSize(name, std::move(bytes));
}

Status WritePng(const std::filesystem::path& path, const Image& image, const WriteOptions& options,
                const std::string& comment) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  auto bytes = EncodePng(image, false, comment);
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
