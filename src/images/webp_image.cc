#include "images/webp_image.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include "core/text.h"

namespace anchorsplat {

namespace {

// Of 0–100 and 0–6: more makes such pictures hardly smaller, but takes many times as long.
constexpr float kEffort = 20;
constexpr int kMethod = 1;

}  // namespace

Result<std::string> EncodeWebp(ByteImage image) {
  WebPConfig config;
  WebPPicture picture;
  if (WebPConfigInit(&config) == 0 || WebPPictureInit(&picture) == 0) {
    return Error{ErrorCode::kIo, "cannot compress pictures: the WebP library is of another version"};
  }
  config.lossless = 1;
  config.exact = 1;
  config.quality = kEffort;
  config.method = kMethod;
  picture.use_argb = 1;
  picture.width = image.width;
  picture.height = image.height;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool imported = WebPPictureImportRGBA(&picture, image.rgba.data(), 4 * image.width) != 0;
  image.rgba = Buffer<uint8_t>();
  const bool encoded = imported && WebPEncode(&config, &picture) != 0;
  const int code = static_cast<int>(picture.error_code);
  WebPPictureFree(&picture);
  std::string bytes(reinterpret_cast<const char*>(writer.mem), encoded ? writer.size : 0);
  WebPMemoryWriterClear(&writer);
  if (!encoded) {
    return Error{ErrorCode::kIo, Cat("cannot compress a picture of ", image.width, " x ", image.height,
                                     " pixels (WebP error ", code, ")")};
  }
  return bytes;
}

Result<ByteImage> DecodeWebp(const std::string& where, std::string_view bytes, int64_t min_pixels, int64_t max_pixels) {
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  ByteImage image;
  if (WebPGetInfo(data, bytes.size(), &image.width, &image.height) == 0) {
    return Error{ErrorCode::kBadFile, Cat(where, ": byte 0: is no WebP picture")};
  }
  if (image.pixels() < min_pixels || image.pixels() > max_pixels) {
    return Error{ErrorCode::kBadFile, Cat(where, ": has ", image.width, " x ", image.height, " pixels, expected ",
                                          WithThousands(min_pixels), " to ", WithThousands(max_pixels), " of them")};
  }
  image.rgba.resize(static_cast<size_t>(4 * image.pixels()));
  if (WebPDecodeRGBAInto(data, bytes.size(), image.rgba.data(), image.rgba.size(), 4 * image.width) == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(where, ": the WebP picture is damaged or cut off")};
  }
  return image;
}

}  // namespace anchorsplat
