#include "scene/texture_decoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#include "core/text.h"
#include "images/jpeg_file.h"
#include "images/png_file.h"
#include "images/webp_image.h"
#include "io/file_bytes.h"
#include "scene/sgi_image.h"

// Only for the two formats that need it; for the others there are better maintained readers.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#define STBI_NO_HDR
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace anchorsplat {

namespace {

using DecodeFile = Result<Image> (*)(std::FILE*, const std::string&, uint64_t);

Result<Texture> FromFloats(const std::string& name, const Image& image) {
  Texture texture;
  texture.width = image.width;
  texture.height = image.height;
  const auto pixels = static_cast<size_t>(image.plane());
  texture.rgba.assign(pixels * 4, 255);
  for (int c = 0; c < std::min(4, std::max(3, image.channels)); ++c) {
    const float* in = image.channel(image.channels < 3 ? 0 : c);
    uint8_t* out = texture.rgba.data() + c;
    for (size_t i = 0; i < pixels; ++i) {
      out[4 * i] = static_cast<uint8_t>(std::lround(std::clamp(in[i], 0.0f, 1.0f) * 255));
    }
  }
  texture.name = name;
  return texture;
}

Result<Texture> ThroughFile(const std::string& name, const std::string& bytes, int64_t max_pixels,
                            Result<ImageSize> (*decode_size)(std::FILE*, const std::string&, uint64_t),
                            DecodeFile decode) {
  // fmemopen does not write when opened for reading.
  const FileHandle file(fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb"));
  if (file == nullptr) return Error{ErrorCode::kIo, Cat(name, ": cannot be opened in memory")};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, decode_size(file.get(), name, bytes.size()));
  if (int64_t{size.width} * size.height > max_pixels) {
    return Error{ErrorCode::kBadFile, Cat(name, ": ", size.width, " x ", size.height, " pixels are too many")};
  }
  std::rewind(file.get());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, decode(file.get(), name, bytes.size()));
  return FromFloats(name, image);
}

Result<Texture> ThroughStb(const std::string& name, const std::string& bytes, int64_t max_pixels) {
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(std::min<size_t>(bytes.size(), 0x7fffffff));
  int width = 0, height = 0, channels = 0;
  if (stbi_info_from_memory(data, size, &width, &height, &channels) == 0 || width < 1 || height < 1) {
    return Error{ErrorCode::kBadFile, Cat(name, ": cannot be decoded (", stbi_failure_reason(), ")")};
  }
  // Run-length encoding packs at most 128 pixels into two bytes; more is a decompression bomb.
  const int64_t pixels = int64_t{width} * height;
  if (pixels > max_pixels || pixels > 128 * int64_t{size}) {
    return Error{ErrorCode::kBadFile, Cat(name, ": ", width, " x ", height, " pixels are too many")};
  }
  const std::unique_ptr<stbi_uc, void (*)(void*)> rgba(stbi_load_from_memory(data, size, &width, &height, &channels, 4),
                                                       stbi_image_free);
  if (rgba == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(name, ": cannot be decoded (", stbi_failure_reason(), ")")};
  }
  Texture texture;
  texture.name = name;
  texture.width = width;
  texture.height = height;
  texture.rgba.assign(rgba.get(), rgba.get() + pixels * 4);
  return texture;
}

Result<Texture> Decode(const std::string& name, const std::string& bytes, int64_t max_pixels) {
  const std::string_view view = bytes;
  if (view.starts_with("\x89PNG\r\n\x1a\n")) {
    return ThroughFile(name, bytes, max_pixels, DecodePngSize, DecodePng);
  }
  if (view.starts_with("\xff\xd8\xff")) return ThroughFile(name, bytes, max_pixels, DecodeJpegSize, DecodeJpeg);
  if (view.starts_with("RIFF") && view.size() > 12 && view.substr(8, 4) == "WEBP") {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage image, DecodeWebp(name, view, 1, max_pixels));
    Texture texture;
    texture.name = name;
    texture.width = image.width;
    texture.height = image.height;
    texture.rgba.assign(image.rgba.data(), image.rgba.data() + image.pixels() * 4);
    return texture;
  }
  if (IsSgi(view)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(SgiImage image, DecodeSgi(name, view, max_pixels));
    Texture texture;
    texture.name = name;
    texture.width = image.width;
    texture.height = image.height;
    texture.rgba = std::move(image.rgba);
    return texture;
  }
  const std::string end = name.size() < 4 ? "" : name.substr(name.size() - 4);
  if (view.starts_with("BM") || end == ".tga" || end == ".TGA") return ThroughStb(name, bytes, max_pixels);
  return Error{ErrorCode::kBadFile, Cat(name, ": is not PNG, JPEG, WebP, SGI, BMP or Targa")};
}

}  // namespace

Result<Texture> DecodeTexture(const std::string& name, const std::string& bytes, int64_t max_pixels) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Texture texture, Decode(Printable(name), bytes, max_pixels));
  texture.name = name;
  for (size_t i = 3; i < texture.rgba.size() && !texture.has_alpha; i += 4) texture.has_alpha = texture.rgba[i] < 255;
  return texture;
}

}  // namespace anchorsplat
