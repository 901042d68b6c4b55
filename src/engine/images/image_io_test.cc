#include "images/image_io.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "core/random.h"
#include "images/decode_image.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

void Write(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);  // some file systems flush a file that is emptied and written again
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

Image RandomImage(int width, int height, int channels, uint64_t seed) {
  Image image(width, height, channels);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Below(256)) / 255.0f;
  return image;
}

// A PNG written by libpng itself, in any of the layouts of the format; `rows` as png_write_image wants them.
struct PngLayout {
  int width, height, depth, colour_type;
  bool interlaced = false;
  std::vector<png_color> palette = {};
  std::vector<png_byte> transparency = {};
};
void WritePngWithLibpng(const std::filesystem::path& path, const PngLayout& layout, std::vector<png_byte> samples) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(layout.width), static_cast<png_uint_32>(layout.height), layout.depth,
               layout.colour_type, layout.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!layout.palette.empty()) png_set_PLTE(png, info, layout.palette.data(), static_cast<int>(layout.palette.size()));
  if (!layout.transparency.empty()) {
    png_set_tRNS(png, info, layout.transparency.data(), static_cast<int>(layout.transparency.size()), nullptr);
  }
  png_write_info(png, info);
  std::vector<png_bytep> rows;
  const size_t stride = samples.size() / static_cast<size_t>(layout.height);
  for (int y = 0; y < layout.height; ++y) rows.push_back(samples.data() + stride * static_cast<size_t>(y));
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

TEST(Png, RoundTripsEightBitValues) {
  const TestFolder folder;
  for (const int channels : {3, 4}) {
    const Image image = RandomImage(37, 23, channels, static_cast<uint64_t>(channels));
    const auto path = folder / (std::to_string(channels) + ".png");
    ASSERT_TRUE(WritePng(path, image).ok());
    const auto read = ReadImage(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->width, 37);
    EXPECT_EQ(read->height, 23);
    EXPECT_EQ(read->channels, channels);
    EXPECT_EQ(read->pixels, image.pixels);
    const auto size = ReadImageSize(path);
    ASSERT_TRUE(size.ok());
    EXPECT_EQ(size->width, 37);
    EXPECT_EQ(size->height, 23);
  }
}

TEST(Png, RoundsAndClamps) {
  const TestFolder folder;
  Image image(7, 1, 1);
  image.pixels = {-3.0f, 0.49f / 255, 0.51f / 255, 0.5f, 254.6f / 255, 9.0f, std::nanf("")};
  ASSERT_TRUE(WritePng(folder / "a.png", image).ok());
  const auto read = ReadImage(folder / "a.png");
  ASSERT_TRUE(read.ok());
  const float expected[] = {0, 0, 1, 128, 255, 255, 0};
  ASSERT_EQ(read->channels, 3);
  for (int c = 0; c < 3; ++c) {
    for (int x = 0; x < 7; ++x) EXPECT_EQ(read->at(c, 0, x), expected[x] / 255.0f) << c << " " << x;
  }
}

TEST(Png, SixteenBitsAreBigEndian) {
  const TestFolder folder;
  WritePngWithLibpng(folder / "a.png", {2, 1, 16, PNG_COLOR_TYPE_GRAY}, {0x12, 0x34, 0xff, 0x00});
  const auto read = ReadImage(folder / "a.png");
  ASSERT_TRUE(read.ok());
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(read->at(c, 0, 0), 0x1234 / 65535.0f);
    EXPECT_EQ(read->at(c, 0, 1), 0xff00 / 65535.0f);
  }
}

TEST(Png, KeepsAlpha) {
  const TestFolder folder;
  WritePngWithLibpng(folder / "rgba.png", {1, 2, 8, PNG_COLOR_TYPE_RGBA}, {255, 0, 51, 102, 0, 204, 0, 0});
  const auto rgba = ReadImage(folder / "rgba.png");
  ASSERT_TRUE(rgba.ok());
  ASSERT_EQ(rgba->channels, 4);
  EXPECT_EQ(rgba->at(3, 0, 0), 0.4f);
  EXPECT_EQ(rgba->at(3, 1, 0), 0.0f);
  const Image over = CompositeOver(*rgba, {0.0f, 1.0f, 1.0f});
  ASSERT_EQ(over.channels, 3);
  EXPECT_FLOAT_EQ(over.at(0, 0, 0), 0.4f);
  EXPECT_FLOAT_EQ(over.at(1, 0, 0), 0.6f);
  EXPECT_FLOAT_EQ(over.at(2, 0, 0), 0.2f * 0.4f + 0.6f);
  EXPECT_FLOAT_EQ(over.at(1, 1, 0), 1.0f);  // transparent green shows the background only

  WritePngWithLibpng(folder / "grey-alpha.png", {1, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA}, {51, 255});
  const auto grey = ReadImage(folder / "grey-alpha.png");
  ASSERT_TRUE(grey.ok());
  ASSERT_EQ(grey->channels, 4);
  EXPECT_EQ(grey->at(2, 0, 0), 0.2f);
  EXPECT_EQ(grey->at(3, 0, 0), 1.0f);
  EXPECT_EQ(CompositeOver(over, {1, 1, 1}).pixels, over.pixels);
}

TEST(Png, ExpandsPalettesAndBits) {
  const TestFolder folder;
  const std::vector<png_color> palette = {{255, 0, 0}, {0, 51, 0}, {1, 2, 3}, {0, 0, 255}};
  WritePngWithLibpng(folder / "p.png", {4, 1, 2, PNG_COLOR_TYPE_PALETTE, false, palette}, {0b00011011});
  auto read = ReadImage(folder / "p.png");
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->channels, 3);
  EXPECT_EQ(read->at(0, 0, 0), 1.0f);
  EXPECT_EQ(read->at(1, 0, 1), 0.2f);
  EXPECT_EQ(read->at(2, 0, 3), 1.0f);
  WritePngWithLibpng(folder / "t.png", {4, 1, 2, PNG_COLOR_TYPE_PALETTE, false, palette, {0, 51}}, {0b00011011});
  read = ReadImage(folder / "t.png");
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->channels, 4);
  EXPECT_EQ(read->at(3, 0, 0), 0.0f);
  EXPECT_EQ(read->at(3, 0, 1), 0.2f);
  EXPECT_EQ(read->at(3, 0, 2), 1.0f);
  WritePngWithLibpng(folder / "g.png", {8, 1, 1, PNG_COLOR_TYPE_GRAY}, {0b10110000});
  read = ReadImage(folder / "g.png");
  ASSERT_TRUE(read.ok());
  const float bits[] = {1, 0, 1, 1, 0, 0, 0, 0};
  for (int x = 0; x < 8; ++x) EXPECT_EQ(read->at(1, 0, x), bits[x]);
}

TEST(Png, InterlacedIsTheSamePicture) {
  const TestFolder folder;
  Random random(4);
  std::vector<png_byte> samples(19 * 13 * 3);
  for (png_byte& x : samples) x = static_cast<png_byte>(random.Below(256));
  WritePngWithLibpng(folder / "a.png", {19, 13, 8, PNG_COLOR_TYPE_RGB, false}, samples);
  WritePngWithLibpng(folder / "b.png", {19, 13, 8, PNG_COLOR_TYPE_RGB, true}, samples);
  const auto a = ReadImage(folder / "a.png"), b = ReadImage(folder / "b.png");
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->pixels, b->pixels);
  EXPECT_EQ(b->at(2, 12, 18), static_cast<float>(samples.back()) / 255.0f);
}

TEST(Png, EveryTruncationIsAnError) {
  const TestFolder folder;
  ASSERT_TRUE(WritePng(folder / "whole.png", RandomImage(9, 7, 3, 6)).ok());
  const std::string whole = FileBytes(folder / "whole.png");
  for (size_t length = 0; length < whole.size(); ++length) {
    Write(folder / "cut.png", whole.substr(0, length));
    const auto read = ReadImage(folder / "cut.png");
    ASSERT_FALSE(read.ok()) << length << " of " << whole.size();
    EXPECT_EQ(read.error().code, ErrorCode::kBadFile);
    EXPECT_NE(read.error().message.find("cut.png"), std::string::npos) << read.error().message;
  }
}

// One byte changed anywhere, under the sanitizers.
TEST(Png, DamagedBytesAreErrorsOrHarmless) {
  const TestFolder folder;
  ASSERT_TRUE(WritePng(folder / "whole.png", RandomImage(9, 7, 3, 8)).ok());
  const std::string whole = FileBytes(folder / "whole.png");
  // Every chunk of ours is critical and has a checksum. That of the last one, which is empty, newer libpngs (1.6.48)
  // do not look at.
  const size_t checked = whole.size() - sizeof(uint32_t);
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x41);
    Write(folder / "bad.png", bytes);
    const bool read = ReadImage(folder / "bad.png").ok();
    EXPECT_TRUE(!read || at >= checked) << "byte " << at;
    const auto size = ReadImageSize(folder / "bad.png");
    EXPECT_TRUE(size.ok() || size.error().code == ErrorCode::kBadFile) << "byte " << at;
  }
}

uint32_t Crc(const std::string& bytes) {
  uint32_t crc = ~0u;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return ~crc;
}

std::string BigEndian(uint32_t x) {
  return {static_cast<char>(x >> 24), static_cast<char>(x >> 16), static_cast<char>(x >> 8), static_cast<char>(x)};
}

TEST(Png, HugePromisesAreRefusedBeforeMemoryIsTaken) {
  const TestFolder folder;
  const uint32_t sizes[][2] = {{20000, 20000}, {16000, 16000}, {1u << 20, 255}, {0x7fffffff, 0x7fffffff}, {0, 4}};
  for (const auto& size : sizes) {
    const std::string header = "IHDR" + BigEndian(size[0]) + BigEndian(size[1]) + std::string("\x10\x06\0\0\0", 5);
    Write(folder / "huge.png", "\x89PNG\r\n\x1a\n" + BigEndian(13) + header + BigEndian(Crc(header)) + BigEndian(0) +
                                   "IDAT" + BigEndian(Crc("IDAT")));
    const auto read = ReadImage(folder / "huge.png");
    ASSERT_FALSE(read.ok()) << size[0];
    EXPECT_EQ(read.error().code, ErrorCode::kBadFile);
    EXPECT_FALSE(ReadImageSize(folder / "huge.png").ok());
  }
}

TEST(Png, RefusesImagesThatAreNone) {
  const TestFolder folder;
  for (const Image& image : {Image(), Image(0, 5, 3), Image(5, 5, 2), Image(5, 5, 5)}) {
    const Status status = WritePng(folder / "a.png", image);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
  }
  Image image(5, 5, 3);
  image.pixels.pop_back();
  EXPECT_FALSE(WritePng(folder / "a.png", image).ok());
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(Png, OverwritesOnlyWhenTold) {
  const TestFolder folder;
  const Image image = RandomImage(3, 3, 3, 9);
  ASSERT_TRUE(WritePng(folder / "a.png", image).ok());
  const Status again = WritePng(folder / "a.png", image);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kExists);
  EXPECT_TRUE(WritePng(folder / "a.png", image, {.overwrite = true}).ok());
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(Png, ManyThreadsMayRead) {
  const TestFolder folder;
  std::vector<Image> images;
  for (int i = 0; i < 4; ++i) {
    images.push_back(RandomImage(50 + i, 40, 3, static_cast<uint64_t>(10 + i)));
    ASSERT_TRUE(WritePng(folder / (std::to_string(i) + ".png"), images.back()).ok());
  }
  std::vector<std::thread> threads;
  std::vector<int> right(4, 0);
  for (size_t i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 20; ++k) {
        const auto read = ReadImage(folder / (std::to_string(i) + ".png"));
        right[i] += read.ok() && read->pixels == images[i].pixels ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, std::vector<int>(4, 20));
}

TEST(DecodeImage, IsWhatTheFileSays) {
  const TestFolder folder;
  for (const int channels : {1, 3, 4}) {
    const auto path = folder / (std::to_string(channels) + ".png");
    ASSERT_TRUE(WritePng(path, RandomImage(13, 7, channels, 5)).ok());
    const std::string bytes = FileBytes(path);
    const auto decoded = DecodeImage("upload", bytes), read = ReadImage(path);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    EXPECT_EQ(decoded->channels, read->channels);
    EXPECT_EQ(decoded->pixels, read->pixels);
    const auto half = DecodeImage("upload", std::string_view(bytes).substr(0, bytes.size() / 2));
    ASSERT_FALSE(half.ok());
    EXPECT_EQ(half.error().code, ErrorCode::kBadFile);
    EXPECT_TRUE(half.error().message.starts_with("upload: ")) << half.error().message;
  }
  for (const std::string& nothing : {std::string(), std::string("\xff\xd8\xff"), std::string(100, 'x')}) {
    const auto decoded = DecodeImage("upload", nothing);
    ASSERT_FALSE(decoded.ok());
    EXPECT_EQ(decoded.error().code, ErrorCode::kBadFile);
  }
}

TEST(ReadImage, OtherFilesAreErrors) {
  const TestFolder folder;
  EXPECT_EQ(ReadImage(folder / "none.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ReadImage(folder.path()).error().code, ErrorCode::kIo);
  EXPECT_EQ(ReadImage("/dev/null").error().code, ErrorCode::kIo);
  for (const char* text : {"", "x", "GIF89a", "\x89PNG", "\xff\xd8"}) {
    Write(folder / "a.png", text);
    EXPECT_EQ(ReadImage(folder / "a.png").error().code, ErrorCode::kBadFile) << text;
    EXPECT_EQ(ReadImageSize(folder / "a.png").error().code, ErrorCode::kBadFile) << text;
  }
  Write(folder / "a.png", std::string("\0\0\0\x18"
                                      "ftypheic\0\0\0\0",
                                      16));
  EXPECT_NE(ReadImage(folder / "a.png").error().message.find("is a HEIC picture, which is not supported; convert"),
            std::string::npos);
}

}  // namespace
}  // namespace anchorsplat
