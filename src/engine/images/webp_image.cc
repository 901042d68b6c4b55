#include "images/webp_image.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include "core/text.h"
#include "images/orientation.h"

namespace anchorsplat {

namespace {

// Of 0–100 and 0–6; higher values hardly reduce such images but take many times as long.
constexpr float kEffort = 20;
constexpr int kMethod = 1;

Result<WebPBitstreamFeatures> FeaturesOf(const std::string& where, std::string_view bytes) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), &features) != VP8_STATUS_OK) {
    return Error{ErrorCode::kBadFile, Cat(where, ": the WebP picture is damaged or cut off")};
  }
  if (features.has_animation != 0) {
    return Error{ErrorCode::kBadFile, Cat(where, ": an animated WebP; save the picture you need as a separate file")};
  }
  return features;
}

// EXIF orientation from the chunk "EXIF", to which some programs add JPEG's prefix.
int OrientationOf(std::string_view bytes) {
  constexpr size_t kHead = 12, kChunkHead = 8;  // "RIFF", length, "WEBP"; name, length
  for (size_t at = kHead; at + kChunkHead <= bytes.size();) {
    size_t length = 0;
    for (size_t k = 4; k-- > 0;) length = length << 8 | static_cast<unsigned char>(bytes[at + 4 + k]);
    if (length > bytes.size() - at - kChunkHead) return 1;
    if (bytes.substr(at, 4) == "EXIF") {
      std::string_view exif = bytes.substr(at + kChunkHead, length);
      if (exif.starts_with(std::string_view("Exif\0\0", 6))) exif.remove_prefix(6);
      return OrientationOfExif(exif);
    }
    at += kChunkHead + length + length % 2;
  }
  return 1;
}

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
    return Error{ErrorCode::kBadFile, Cat(where, ": byte 0: is not a WebP picture")};
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

Result<Image> DecodeWebpPhotograph(const std::string& where, std::string_view bytes) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const WebPBitstreamFeatures features, FeaturesOf(where, bytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ByteImage decoded, DecodeWebp(where, bytes, 1, kMaxImagePixels));
  Image image(decoded.width, decoded.height, features.has_alpha != 0 ? 4 : 3);
  for (int c = 0; c < image.channels; ++c) {
    float* to = image.channel(c);
    const uint8_t* from = decoded.rgba.data() + c;
    for (int64_t i = 0; i < image.plane(); ++i) to[i] = static_cast<float>(from[4 * i]) / 255.0f;
  }
  return image;
}

Result<ImageSize> DecodeWebpSize(const std::string& where, std::string_view bytes) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const WebPBitstreamFeatures features, FeaturesOf(where, bytes));
  return ImageSize{features.width, features.height, OrientationOf(bytes)};
}

}  // namespace anchorsplat
