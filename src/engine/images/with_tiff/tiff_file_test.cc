#include "images/tiff_file.h"

#include <gtest/gtest.h>
#include <tiffio.h>

#include <vector>

#include "images/image_io.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

struct TiffOptions {
  uint16_t bits = 8, samples = 3, photometric = PHOTOMETRIC_RGB, compression = COMPRESSION_NONE;
  uint16_t planar = PLANARCONFIG_CONTIG, orientation = 1;
  int extra = -1;  // what the last sample is
  uint32_t tile = 0, rows = 3;
  const char* mode = "w";
  int pages = 1;
};

constexpr uint32_t kWidth = 21, kHeight = 10;

// Value of a sample, 0 to 255: no two neighbours are alike.
uint8_t ValueAt(uint32_t x, uint32_t y, int sample) {
  return static_cast<uint8_t>(31 * x + 57 * y + 91 * static_cast<uint32_t>(sample) + 5);
}

std::string WriteTiff(const std::filesystem::path& path, const TiffOptions& o) {
  TIFF* tiff = TIFFOpen(path.c_str(), o.mode);
  for (int page = 0; page < o.pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kWidth);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kHeight);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, o.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, o.samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, o.photometric);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, o.compression);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, o.planar);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, o.orientation);
    if (o.extra >= 0) {
      const auto extra = static_cast<uint16_t>(o.extra);
      TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
    }
    const uint32_t columns = o.tile > 0 ? o.tile : kWidth, rows = o.tile > 0 ? o.tile : o.rows;
    if (o.tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, o.tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, o.tile);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, o.rows);
    }
    const int planes = o.planar == PLANARCONFIG_SEPARATE ? o.samples : 1, together = o.samples / planes;
    uint32_t block = 0;
    for (int plane = 0; plane < planes; ++plane) {
      for (uint32_t top = 0; top < kHeight; top += rows) {
        for (uint32_t left = 0; left < kWidth; left += columns) {
          std::string bytes;
          for (uint32_t y = top; y < (o.tile > 0 ? top + rows : std::min(top + rows, kHeight)); ++y) {
            for (uint32_t x = left; x < left + columns; ++x) {
              for (int s = 0; s < together; ++s) {
                const char value = static_cast<char>(ValueAt(x, y, planes > 1 ? plane : s));
                bytes += o.bits == 16 ? std::string(2, value) : std::string(1, value);
              }
            }
          }
          if (o.tile > 0) {
            TIFFWriteEncodedTile(tiff, block++, bytes.data(), std::ssize(bytes));
          } else {
            TIFFWriteEncodedStrip(tiff, block++, bytes.data(), std::ssize(bytes));
          }
        }
      }
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return FileBytes(path);
}

TEST(Tiff, LayoutsAndCompressionsGiveTheSamePicture) {
  const TestFolder folder;
  const auto path = folder / "a.tif";
  for (const uint16_t bits : {8, 16}) {
    for (const uint16_t compression :
         {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
      for (const uint16_t planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
        for (const uint32_t tile : {0, 16}) {
          for (const char* mode : {"wl", "wb", "w8"}) {
            for (const bool alpha : {false, true}) {
              TiffOptions o{.bits = bits, .compression = compression, .planar = planar, .tile = tile, .mode = mode};
              if (alpha) o.samples = 4, o.extra = EXTRASAMPLE_UNASSALPHA;
              WriteTiff(path, o);
              const auto image = ReadImage(path);
              ASSERT_TRUE(image.ok()) << image.error().message;
              ASSERT_EQ(image->channels, alpha ? 4 : 3);
              ASSERT_EQ(image->width, static_cast<int>(kWidth));
              for (int c = 0; c < image->channels; ++c) {
                for (uint32_t y = 0; y < kHeight; ++y) {
                  for (uint32_t x = 0; x < kWidth; ++x) {
                    ASSERT_EQ(image->at(c, static_cast<int>(y), static_cast<int>(x)),
                              static_cast<float>(ValueAt(x, y, c)) / 255.0f)
                        << bits << " " << compression << " " << planar << " " << tile << " " << mode;
                  }
                }
              }
            }
          }
        }
      }
    }
  }
  WriteTiff(path, {.orientation = 6});
  const auto size = ReadImageSize(path);
  ASSERT_TRUE(size.ok()) << size.error().message;
  EXPECT_EQ(size->height, static_cast<int>(kHeight));
  EXPECT_EQ(size->orientation, 6);
}

TEST(Tiff, GreyAndPremultipliedAlpha) {
  const TestFolder folder;
  const auto path = folder / "a.tif";
  WriteTiff(path, {.samples = 1, .photometric = PHOTOMETRIC_MINISBLACK});
  const Image grey = *ReadImage(path);
  EXPECT_EQ(grey.channels, 3);
  EXPECT_EQ(grey.at(2, 4, 3), static_cast<float>(ValueAt(3, 4, 0)) / 255);
  WriteTiff(path, {.samples = 1, .photometric = PHOTOMETRIC_MINISWHITE});
  EXPECT_EQ(ReadImage(path)->at(1, 4, 3), 1 - static_cast<float>(ValueAt(3, 4, 0)) / 255);
  WriteTiff(path, {.samples = 2, .photometric = PHOTOMETRIC_MINISBLACK, .extra = EXTRASAMPLE_ASSOCALPHA});
  const Image image = *ReadImage(path);
  EXPECT_EQ(image.channels, 4);
  const float alpha = static_cast<float>(ValueAt(0, 0, 1)) / 255;
  EXPECT_EQ(image.at(3, 0, 0), alpha);
  EXPECT_FLOAT_EQ(image.at(0, 0, 0), static_cast<float>(ValueAt(0, 0, 0)) / 255 / alpha);
  // Extra values that are no alpha are none.
  WriteTiff(path, {.samples = 4, .extra = EXTRASAMPLE_UNSPECIFIED});
  EXPECT_EQ(ReadImage(path)->channels, 3);
}

TEST(Tiff, WhatIsNotReadIsNamed) {
  const TestFolder folder;
  const auto path = folder / "a.tif";
  const std::pair<TiffOptions, const char*> cases[] = {
      {{.samples = 4, .photometric = PHOTOMETRIC_SEPARATED}, "CMYK"},
      {{.photometric = PHOTOMETRIC_CIELAB}, "Lab"},
      {{.pages = 3}, "3 pages"},
  };
  for (const auto& [options, expected] : cases) {
    WriteTiff(path, options);
    const auto image = ReadImage(path);
    ASSERT_FALSE(image.ok()) << expected;
    EXPECT_EQ(image.error().code, ErrorCode::kBadFile);
    EXPECT_NE(image.error().message.find(expected), std::string::npos) << image.error().message;
  }
}

TEST(Tiff, DamagedFilesAreErrorsOrPictures) {
  const TestFolder folder;
  for (const uint32_t tile : {0, 16}) {
    const std::string whole = WriteTiff(folder / "a.tif", {.compression = COMPRESSION_LZW, .tile = tile});
    for (size_t n = 0; n < whole.size(); n += 1 + whole.size() / 300) {
      const auto cut = DecodeTiff("cut", whole.substr(0, n));
      EXPECT_TRUE(cut.ok() || cut.error().code == ErrorCode::kBadFile) << n;
      std::string changed = whole;
      for (const int value : {0, 1, 0x7f, 0xff}) {
        changed[n] = static_cast<char>(value);
        const auto image = DecodeTiff("changed", changed);
        EXPECT_TRUE(image.ok() || image.error().code == ErrorCode::kBadFile) << n << " " << value;
        const auto size = DecodeTiffSize("changed", changed);
        EXPECT_TRUE(size.ok() || size.error().code == ErrorCode::kBadFile) << n << " " << value;
      }
    }
  }
}

}  // namespace
}  // namespace anchorsplat
