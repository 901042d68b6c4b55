#include "images/jpeg_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

// Behind <cstdio>: it needs FILE.
#include <jpeglib.h>

#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

// A smooth picture, so that compression costs little: sample c of pixel (x, y).
int Sample(int x, int y, int c) { return (c == 0 ? 40 + 5 * x : c == 1 ? 60 + 4 * y : 200 - 2 * x - 2 * y) & 0xff; }

std::string Jpeg(int width, int height, int components, bool progressive = false) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* memory = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): libjpeg's type
  jpeg_mem_dest(&info, &memory, &size);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = components;
  info.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 3 ? JCS_RGB : JCS_CMYK;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 95, TRUE);
  if (progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  std::vector<JSAMPLE> row(static_cast<size_t>(width * components));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < components; ++c)
        row[static_cast<size_t>(x * components + c)] = static_cast<JSAMPLE>(Sample(x, y, c));
    }
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&info, &rows, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  const std::string bytes(reinterpret_cast<const char*>(memory), size);
  std::free(memory);
  return bytes;
}

std::filesystem::path Written(const TestFolder& folder, const std::string& bytes) {
  std::filesystem::remove(folder / "a.jpg");  // some file systems flush a file that is emptied and written again
  std::ofstream(folder / "a.jpg", std::ios::binary | std::ios::trunc) << bytes;
  return folder / "a.jpg";
}

TEST(JpegFile, ReadsColourAndGrey) {
  const TestFolder folder;
  for (const bool progressive : {false, true}) {
    for (const int components : {1, 3}) {
      const auto path = Written(folder, Jpeg(29, 21, components, progressive));
      const auto image = ReadImage(path);
      ASSERT_TRUE(image.ok()) << image.error().message;
      ASSERT_EQ(image->width, 29);
      ASSERT_EQ(image->height, 21);
      ASSERT_EQ(image->channels, 3);
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < 21; ++y) {
          for (int x = 0; x < 29; ++x) {
            const int expected = Sample(x, y, components == 1 ? 0 : c);
            EXPECT_NEAR(image->at(c, y, x) * 255, expected, 14) << c << " " << y << " " << x;  // 4:2:0 chroma
          }
        }
      }
      const auto size = ReadImageSize(path);
      ASSERT_TRUE(size.ok());
      EXPECT_EQ(size->width, 29);
      EXPECT_EQ(size->height, 21);
    }
  }
}

// libjpeg marks inks as Adobe's programs do: what is stored is how much of each is left out.
TEST(JpegFile, InksBecomeColours) {
  const TestFolder folder;
  const auto image = ReadImage(Written(folder, Jpeg(29, 21, 4)));
  ASSERT_TRUE(image.ok()) << image.error().message;
  ASSERT_EQ(image->channels, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 21; ++y) {
      for (int x = 0; x < 29; ++x) {
        EXPECT_NEAR(image->at(c, y, x), Sample(x, y, c) * Sample(x, y, 3) / (255.0 * 255.0), 0.06);
      }
    }
  }
}

// The APP1 of a JPEG with one entry, in either order of bytes.
std::string WithExif(const std::string& jpeg, int orientation, bool little) {
  const auto number = [&](int value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * (little ? i : bytes - 1 - i)));
    return text;
  };
  const std::string tiff = (little ? "II" : "MM") + number(42, 2) + number(8, 4) + number(1, 2) + number(0x0112, 2) +
                           number(3, 2) + number(1, 4) + number(orientation, 2) + number(0, 2) + number(0, 4);
  const std::string exif = std::string("Exif\0\0", 6) + tiff;
  const auto length = static_cast<int>(exif.size()) + 2;
  std::string marker = "\xff\xe1";
  marker += static_cast<char>(length >> 8);
  marker += static_cast<char>(length);
  return jpeg.substr(0, 2) + marker + exif + jpeg.substr(2);
}

TEST(JpegFile, SaysItsOrientation) {
  const TestFolder folder;
  EXPECT_EQ(ReadImageSize(Written(folder, Jpeg(29, 21, 3)))->orientation, 1);
  for (const bool little : {false, true}) {
    for (int orientation = 0; orientation <= 9; ++orientation) {
      const auto size = ReadImageSize(Written(folder, WithExif(Jpeg(29, 21, 3), orientation, little)));
      ASSERT_TRUE(size.ok()) << size.error().message;
      EXPECT_EQ(size->width, 29) << "as stored";
      EXPECT_EQ(size->orientation, orientation >= 1 && orientation <= 8 ? orientation : 1);
    }
  }
}

TEST(JpegFile, EveryTruncationIsAnError) {
  const TestFolder folder;
  for (const bool progressive : {false, true}) {
    const std::string whole = Jpeg(24, 16, 3, progressive);
    for (size_t length = 0; length < whole.size(); ++length) {
      const auto image = ReadImage(Written(folder, whole.substr(0, length)));
      ASSERT_FALSE(image.ok()) << length << " of " << whole.size();
      EXPECT_EQ(image.error().code, ErrorCode::kBadFile);
    }
  }
}

TEST(JpegFile, DamagedBytesAreErrorsOrPictures) {
  const TestFolder folder;
  for (const bool progressive : {false, true}) {
    const std::string whole = Jpeg(24, 16, 3, progressive);
    int refused = 0;
    for (size_t at = 0; at < whole.size(); ++at) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ 0xff);
      const auto path = Written(folder, bytes);
      const auto image = ReadImage(path);
      refused += image.ok() ? 0 : 1;
      if (!image.ok()) {
        EXPECT_EQ(image.error().code, ErrorCode::kBadFile);
      }
      const auto size = ReadImageSize(path);
      EXPECT_TRUE(size.ok() || size.error().code == ErrorCode::kBadFile) << "byte " << at;
    }
    EXPECT_GT(refused, 20);
  }
}

TEST(JpegFile, HugePromisesAreRefused) {
  const TestFolder folder;
  std::string bytes = Jpeg(24, 16, 3);
  const size_t frame = bytes.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  bytes.replace(frame + 5, 4, "\xff\x00\xff\x00", 4);  // height, width
  for (const auto& error : {ReadImage(Written(folder, bytes)).error(), ReadImageSize(folder / "a.jpg").error()}) {
    EXPECT_EQ(error.code, ErrorCode::kBadFile);
    EXPECT_NE(error.message.find("65280 x 65280"), std::string::npos) << error.message;
  }
  bytes.replace(frame + 5, 4, "\x30\x00\x30\x00", 4);
  EXPECT_NE(ReadImage(Written(folder, bytes)).error().message.find("cannot have only"), std::string::npos);
}

TEST(JpegFile, WhatIsEncodedComesBackNearly) {
  Image image(37, 21, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) image.at(c, y, x) = static_cast<float>(Sample(x, y, c)) / 255.0f;
    }
  }
  const auto distance = [&](int quality) {
    const auto bytes = EncodeJpeg(image, quality);
    EXPECT_TRUE(bytes.ok()) << bytes.error().message;
    const auto back = DecodeJpegBytes(*bytes, "memory");
    EXPECT_TRUE(back.ok()) << back.error().message;
    double sum = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      sum += std::abs(static_cast<double>(image.pixels[i]) - static_cast<double>(back->pixels[i]));
    }
    return sum / static_cast<double>(image.pixels.size());
  };
  EXPECT_LT(distance(95), 0.02);
  EXPECT_GT(distance(5), 2 * distance(95));
  EXPECT_EQ(EncodeJpeg(image, 0).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(EncodeJpeg(Image(4, 4, 1), 90).error().code, ErrorCode::kBadArgument);
  const std::string bytes = *EncodeJpeg(image, 80);
  EXPECT_EQ(DecodeJpegBytes(std::string_view(bytes).substr(0, bytes.size() / 2), "half").error().code,
            ErrorCode::kBadFile);
}

}  // namespace
}  // namespace anchorsplat
