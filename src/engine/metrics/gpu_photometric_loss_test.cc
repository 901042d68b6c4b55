#include "metrics/gpu_photometric_loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random.h"
#include "gpu/gpu_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

class GpuPhotometricLossTest : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    ASSERT_NE(device_, nullptr);
  }

  // A picture on the GPU, channels one after the other or, for other strides, as (r, g, b, 0) of every pixel.
  GpuPicture Put(const Image& image, bool interleaved = false) {
    const auto plane = static_cast<uint32_t>(image.plane());
    const GpuPicture placed = interleaved ? GpuPicture{nullptr, 4, 1} : GpuPicture{nullptr, 1, plane};
    std::vector<float> values((interleaved ? 4u : 3u) * size_t{plane});
    for (uint32_t c = 0; c < 3; ++c) {
      for (uint32_t i = 0; i < plane; ++i) {
        values[i * placed.pixel_stride + c * placed.channel_stride] = image.pixels[c * plane + i];
      }
    }
    held_.push_back(device_->Allocate(values.size() * sizeof(float), "a picture").value());
    device_->Write(*held_.back(), 0, std::as_bytes(std::span(values)));
    return {held_.back().get(), placed.pixel_stride, placed.channel_stride};
  }
  Image Get(const GpuPicture& picture, int width, int height) {
    Image image(width, height, 3);
    std::vector<float> values(picture.buffer->bytes() / sizeof(float));
    const GpuRead read = {picture.buffer, 0, std::as_writable_bytes(std::span(values))};
    EXPECT_TRUE(device_->Read({&read, 1}).ok());
    for (int64_t c = 0; c < 3; ++c) {
      for (int64_t i = 0; i < image.plane(); ++i) {
        image.pixels[static_cast<size_t>(c * image.plane() + i)] =
            values[static_cast<size_t>(i * picture.pixel_stride + c * picture.channel_stride)];
      }
    }
    return image;
  }

  std::shared_ptr<GpuDevice> device_;
  std::vector<GpuMemory> held_;
};

struct Pictures {
  Image rendered, wanted;
};

// Smooth, alike, and partly equal.
Pictures MakePictures(int width, int height, double disturbance) {
  Pictures out{Image(width, height, 3), Image(width, height, 3)};
  Random random(7);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double value = 0.5 + 0.4 * std::sin(0.3 * x + c) * std::cos(0.2 * y) + 0.05 * random.Normal();
        const auto at = static_cast<size_t>((c * height + y) * width + x);
        out.wanted.pixels[at] = static_cast<float>(std::clamp(value, 0.0, 1.0));
        const double off = x < width / 4 ? 0 : disturbance * random.Normal();
        out.rendered.pixels[at] = static_cast<float>(out.wanted.pixels[at] + off);
      }
    }
  }
  return out;
}

double RelativeDifference(const Image& a, const Image& b) {
  double off = 0, size = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    off += std::pow(double{a.pixels[i]} - b.pixels[i], 2);
    size += std::pow(double{b.pixels[i]}, 2);
  }
  return std::sqrt(off / size);
}

Image WholeGradient(const Pictures& p, const PhotometricLossOptions& options, PhotometricLossValue& value) {
  Image written;
  PixelBox box;
  value = PhotometricLoss(p.rendered, p.wanted, options, written, box).value();
  Image gradient(p.rendered.width, p.rendered.height, 3);
  std::fill(gradient.pixels.begin(), gradient.pixels.end(), 0.0f);
  for (int c = 0; c < 3; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) gradient.at(c, y, x) = written.at(c, y, x);
    }
  }
  return gradient;
}

TEST_F(GpuPhotometricLossTest, IsThatOfTheCpu) {
  GpuPhotometricLoss loss(device_);
  const struct {
    int width, height;
    double disturbance, ssim_weight;
    SsimPadding padding;
  } cases[] = {{64, 48, 0.1, 0.2, SsimPadding::kValid},  {37, 29, 0.1, 0.2, SsimPadding::kSame},
               {64, 64, 0.001, 1, SsimPadding::kValid},  {11, 11, 0.3, 0.5, SsimPadding::kValid},
               {16, 17, 0.2, 0, SsimPadding::kValid},    {5, 3, 0.2, 0.7, SsimPadding::kSame},
               {70, 33, 0.01, 0.2, SsimPadding::kValid}, {1, 1, 0.2, 0, SsimPadding::kSame}};
  for (const auto& c : cases) {
    SCOPED_TRACE(testing::Message() << c.width << " x " << c.height << ", weight " << c.ssim_weight);
    const Pictures pictures = MakePictures(c.width, c.height, c.disturbance);
    const PhotometricLossOptions options = {c.ssim_weight, c.padding};
    PhotometricLossValue expected;
    const Image gradient = WholeGradient(pictures, options, expected);
    for (const bool interleaved : {false, true}) {
      const GpuPicture out = Put(Image(c.width, c.height, 3), interleaved);
      ASSERT_TRUE(
          loss.Compare(c.width, c.height, Put(pictures.rendered, interleaved), Put(pictures.wanted), options, out)
              .ok());
      const auto value = loss.Value();
      ASSERT_TRUE(value.ok());
      EXPECT_NEAR(value->loss.loss, expected.loss, 1e-5 * expected.loss);
      EXPECT_NEAR(value->loss.l1, expected.l1, 1e-5 * expected.l1);
      EXPECT_NEAR(1 - value->loss.ssim, 1 - expected.ssim, 1e-5 * (1 - expected.ssim));
      EXPECT_NEAR(-10 * std::log10(value->mean_square), Psnr(pictures.rendered, pictures.wanted).value(), 1e-4);
      EXPECT_LT(RelativeDifference(Get(out, c.width, c.height), gradient), 1e-5);
    }
  }
}

TEST_F(GpuPhotometricLossTest, OfEqualPicturesIsNothing) {
  GpuPhotometricLoss loss(device_);
  const Pictures pictures = MakePictures(40, 40, 0);
  const GpuPicture out = Put(pictures.wanted);
  ASSERT_TRUE(loss.Compare(40, 40, Put(pictures.wanted), Put(pictures.wanted), {}, out).ok());
  EXPECT_EQ(loss.Value()->loss.loss, 0);
  for (const float g : Get(out, 40, 40).pixels) EXPECT_EQ(g, 0);
}

TEST_F(GpuPhotometricLossTest, AsksNothingWhereTheTargetSaysSo) {
  GpuPhotometricLoss loss(device_);
  Pictures pictures = MakePictures(48, 40, 0.2);
  Pictures filled = pictures;
  for (int c = 0; c < 3; ++c) {
    for (int y = 10; y < 30; ++y) {
      for (int x = 15; x < 40; ++x) {
        pictures.wanted.at(c, y, x) = kIgnoredPixel;
        filled.wanted.at(c, y, x) = filled.rendered.at(c, y, x);
      }
    }
  }
  PhotometricLossValue expected;
  const Image gradient = WholeGradient(filled, {}, expected);
  const GpuPicture out = Put(Image(48, 40, 3));
  ASSERT_TRUE(loss.Compare(48, 40, Put(pictures.rendered), Put(pictures.wanted), {}, out).ok());
  EXPECT_NEAR(loss.Value()->loss.loss, expected.loss, 1e-5 * expected.loss);
  EXPECT_LT(RelativeDifference(Get(out, 48, 40), gradient), 1e-5);
}

TEST_F(GpuPhotometricLossTest, HasTheSameBitsAgain) {
  const Pictures pictures = MakePictures(64, 64, 0.1);
  Image first;
  double first_loss = 0;
  for (int run = 0; run < 3; ++run) {
    GpuPhotometricLoss loss(device_);
    const GpuPicture out = Put(Image(64, 64, 3));
    ASSERT_TRUE(loss.Compare(64, 64, Put(pictures.rendered), Put(pictures.wanted), {}, out).ok());
    const Image gradient = Get(out, 64, 64);
    const double value = loss.Value()->loss.loss;
    if (run == 0) first = gradient, first_loss = value;
    EXPECT_EQ(gradient.pixels, first.pixels);
    EXPECT_EQ(value, first_loss);
  }
}

TEST_F(GpuPhotometricLossTest, RefusesWhatTheCpuRefuses) {
  GpuPhotometricLoss loss(device_);
  const GpuPicture picture = Put(Image(8, 8, 3));
  EXPECT_FALSE(loss.Compare(8, 8, picture, picture, {}, picture).ok());  // no room for a window
  EXPECT_FALSE(loss.Compare(0, 8, picture, picture, {.ssim_weight = 0}, picture).ok());
  EXPECT_FALSE(loss.Compare(8, 8, picture, picture, {.ssim_weight = 2}, picture).ok());
  EXPECT_FALSE(loss.Compare(1 << 14, 1 << 14, picture, picture, {}, picture).ok());
}

}  // namespace
}  // namespace anchorsplat
