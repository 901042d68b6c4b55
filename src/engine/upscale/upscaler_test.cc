#include "upscale/upscaler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>

#include "core/parallel.h"
#include "core/simd_targets_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

Image RandomImage(int width, int height) {
  Random random(11);
  Image out(width, height, 3);
  for (float& value : out.pixels) value = static_cast<float>(random.Uniform());
  return out;
}

// The picture, continued by `beyond` pixels, as the first layer sees it.
PlainMap PlainInput(const SmallUpscaler& network, const Image& image, int beyond) {
  PlainMap out(3, image.height + 2 * beyond, image.width + 2 * beyond);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        const float value =
            image.at(c, std::clamp(y - beyond, 0, image.height - 1), std::clamp(x - beyond, 0, image.width - 1));
        out.at(c, y, x) = (double{value} - double{network.tensors.at("input.mean").values[static_cast<size_t>(c)]}) *
                          double{network.tensors.at("input.scale").values[0]};
      }
    }
  }
  return out;
}

PlainMap Convolved(const SmallUpscaler& network, const std::string& name, const PlainMap& in) {
  return PlainConvolution(in, network.tensors.at(name + ".weight"), network.tensors.at(name + ".bias"));
}

// Section 3 of the paper, with the three branches of each convolution as the one that they collapse to.
PlainMap PlainSpan(const SmallUpscaler& network, const Image& image) {
  const PlainMap features = Convolved(network, "conv_1", PlainInput(network, image, 0));
  PlainMap x = features, of_first = features, once = features;
  for (int b = 1; b <= 6; ++b) {
    once = PlainSilu(Convolved(network, Cat("block_", b, ".c1_r"), x));
    const PlainMap twice = PlainSilu(Convolved(network, Cat("block_", b, ".c2_r"), once));
    x = PlainGate(Convolved(network, Cat("block_", b, ".c3_r"), twice), x);
    if (b == 1) of_first = x;
  }
  const PlainMap second = Convolved(network, "conv_2", x);
  const PlainMap all = Convolved(network, "conv_cat", PlainConcatenation({&features, &second, &of_first, &once}));
  return PlainShuffle(Convolved(network, "upsampler", all), std::stoi(network.metadata.at("scale")));
}

PlainMap PlainChain(const SmallUpscaler& network, PlainMap x, int count) {
  for (int k = 0; k < count; ++k) {
    x = PlainSlope(Convolved(network, Cat("conv.", k), x), network.tensors.at(Cat("conv.", k, ".slope")));
  }
  return x;
}

PlainMap PlainUpconv7(const SmallUpscaler& network, const Image& image) {
  return PlainTransposedConvolution(PlainChain(network, PlainInput(network, image, 7), 6),
                                    network.tensors.at("up.weight"), network.tensors.at("up.bias"));
}

PlainMap PlainSrmd(const SmallUpscaler& network, const Image& image) {
  // Beyond what is cut off afterwards the maps of constants end, too.
  PlainMap x = PlainInput(network, image, 14);
  for (const float constant : network.tensors.at("constants").values) {
    PlainMap map(1, x.height, x.width);
    for (double& value : map.values) value = constant;
    x = PlainConcatenation({&x, &map});
  }
  return PlainShuffle(Convolved(network, "conv.11", PlainChain(network, std::move(x), 11)), 2);
}

struct NetworkCase {
  const char* name;
  SmallUpscaler network;
  PlainMap (*plain)(const SmallUpscaler&, const Image&);
  int cut;  // pixels of the plain result beyond the picture
};

std::vector<NetworkCase> Cases() {
  return {{"span", SpanForTest(5, 3), PlainSpan, 0},
          {"wide span", SpanForTest(33, 4), PlainSpan, 0},
          {"upconv_7", Upconv7ForTest(), PlainUpconv7, 14},
          {"srmd", SrmdForTest(), PlainSrmd, 28}};
}

TEST(Upscaler, IsWhatThePapersSay) {
  ForEachSimdTarget([] {
    for (const NetworkCase& c : Cases()) {
      SCOPED_TRACE(c.name);
      const Image image = RandomImage(9, 6);
      Upscaler upscaler = OpenedForTest(c.network);
      const auto out = upscaler.Enlarge(image);
      ASSERT_TRUE(out.ok()) << out.error().message;
      const int scale = upscaler.info().scale;
      ASSERT_EQ(out->width, 9 * scale);
      ASSERT_EQ(out->height, 6 * scale);
      const PlainMap plain = c.plain(c.network, image);
      for (int k = 0; k < 3; ++k) {
        for (int y = 0; y < out->height; ++y) {
          for (int x = 0; x < out->width; ++x) {
            ASSERT_NEAR(out->at(k, y, x), plain.get(k, y + c.cut, x + c.cut), 2e-5) << k << " " << y << " " << x;
          }
        }
      }
    }
  });
}

TEST(Upscaler, TilesAndThreadsChangeNoBit) {
  const Image image = RandomImage(61, 37);
  for (const NetworkCase& c : Cases()) {
    SCOPED_TRACE(c.name);
    Upscaler upscaler = OpenedForTest(c.network);
    SetThreadCount(1);
    const auto whole = upscaler.Enlarge(image, 1000);
    ASSERT_TRUE(whole.ok());
    for (const int threads : {1, 3}) {
      SetThreadCount(threads);
      for (const int tile : {0, 13, 25, 61}) {
        const auto tiled = upscaler.Enlarge(image, tile);
        ASSERT_TRUE(tiled.ok());
        EXPECT_EQ(tiled->pixels, whole->pixels) << tile << " wide, " << threads << " threads";
      }
    }
  }
  SetThreadCount(0);
}

TEST(Upscaler, PicturesOfAnySize) {
  for (const NetworkCase& c : Cases()) {
    Upscaler upscaler = OpenedForTest(c.network);
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{300, 1}, std::pair{1, 3}, std::pair{2, 40}}) {
      const auto out = upscaler.Enlarge(RandomImage(width, height));
      ASSERT_TRUE(out.ok());
      EXPECT_EQ(out->width, width * upscaler.info().scale);
    }
  }
}

TEST(Upscaler, RefusesPicturesThatItCannotEnlarge) {
  Upscaler upscaler = OpenedForTest(SpanForTest());
  EXPECT_EQ(upscaler.Enlarge(Image(4, 4, 1)).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(upscaler.Enlarge(Image()).error().code, ErrorCode::kBadArgument);
  Image huge;
  huge.width = huge.height = 1 << 14;
  huge.channels = 3;
  EXPECT_THAT(upscaler.Enlarge(huge).error().message, HasSubstr("too large"));
}

TEST(Upscaler, SaysWhenNumbersOverflow) {
  SmallUpscaler network = SpanForTest();
  for (float& value : network.tensors["upsampler.weight"].values) value = 3e38f;
  Upscaler upscaler = OpenedForTest(network);
  EXPECT_THAT(upscaler.Enlarge(RandomImage(5, 5)).error().message, HasSubstr("overflow"));
}

TEST(Upscaler, SaysWhereItIsFrom) {
  const Upscaler upscaler = OpenedForTest(SpanForTest());
  EXPECT_EQ(upscaler.info().architecture, "span-1");
  EXPECT_EQ(upscaler.info().scale, 3);
  EXPECT_EQ(upscaler.info().source, "a test");
  EXPECT_EQ(upscaler.info().licence, "Apache-2.0");
}

// What is wrong with a file after `change`.
std::string Refusal(SmallUpscaler network, const std::function<void(SmallUpscaler&)>& change) {
  const TestFolder folder;
  change(network);
  EXPECT_TRUE(network.Write(folder / "bad.safetensors").ok());
  const auto out = Upscaler::Read(folder / "bad.safetensors");
  if (out.ok()) return "was read";
  EXPECT_EQ(out.error().code, ErrorCode::kBadFile);
  EXPECT_THAT(out.error().message, HasSubstr("bad.safetensors"));
  return out.error().message;
}

TEST(Upscaler, RefusesOtherMetadata) {
  const auto with = [](const char* key, const char* value) {
    return Refusal(SpanForTest(), [&](SmallUpscaler& n) { n.metadata[key] = value; });
  };
  EXPECT_THAT(with("format", "anchorsplat-upscaler-2"), HasSubstr("\"anchorsplat-upscaler-2\""));
  EXPECT_THAT(Refusal(SpanForTest(), [](SmallUpscaler& n) { n.metadata.clear(); }), HasSubstr("is no upscaler"));
  EXPECT_THAT(with("architecture", "span-2"), HasSubstr("span-1, upconv_7-1 and srmd-1"));
  EXPECT_THAT(with("color_space", "linear"), HasSubstr("only sRGB"));
  EXPECT_THAT(with("input_range", "0-255"), HasSubstr("only 0-1"));
  for (const char* scale : {"", "1", "5", "04", "-2", "4000000000", "2.0"}) {
    EXPECT_THAT(with("scale", scale), HasSubstr("there are 2, 3 and 4")) << scale;
  }
  EXPECT_THAT(with("scale", "4"), HasSubstr("upsampler.weight"));
  EXPECT_THAT(Refusal(Upconv7ForTest(), [](SmallUpscaler& n) { n.metadata["scale"] = "4"; }), HasSubstr("scale 2"));
}

TEST(Upscaler, RefusesOtherTensors) {
  for (const NetworkCase& c : Cases()) {
    for (const auto& [name, tensor] : c.network.tensors) {
      SCOPED_TRACE(Cat(c.name, " ", name));
      EXPECT_THAT(Refusal(c.network, [&](SmallUpscaler& n) { n.tensors.erase(name); }), HasSubstr(name));
      EXPECT_NE(Refusal(c.network,
                        [&](SmallUpscaler& n) {
                          PlainTensor& changed = n.tensors[name];
                          changed.shape.push_back(2);
                          changed.values.insert(changed.values.end(), changed.values.begin(), changed.values.end());
                        }),
                "was read");
      EXPECT_THAT(
          Refusal(c.network,
                  [&](SmallUpscaler& n) { n.tensors[name].values.back() = std::numeric_limits<float>::infinity(); }),
          HasSubstr(name));
    }
  }
}

// A shape of many channels and none of their numbers: nothing of that size is allocated.
TEST(Upscaler, RefusesShapesOfNothing) {
  const auto shaped = [](SmallUpscaler network, const std::string& name, std::vector<int64_t> shape) {
    return Refusal(std::move(network), [&](SmallUpscaler& n) { n.tensors[name] = {shape, {}}; });
  };
  const int64_t many = int64_t{1} << 40;
  EXPECT_THAT(shaped(SpanForTest(), "conv_1.weight", {many, 0, 3, 3}), HasSubstr("1 to 1024 channels"));
  EXPECT_THAT(shaped(SpanForTest(), "conv_1.weight", {0, 3, 3, 3}), HasSubstr("1 to 1024 channels"));
  EXPECT_THAT(shaped(Upconv7ForTest(), "conv.0.weight", {1 << 20, 0, 3, 3}), HasSubstr("1 to 1024 channels"));
  EXPECT_THAT(shaped(SrmdForTest(), "constants", {0}), HasSubstr("conv.0.weight"));
}

TEST(Upscaler, SurvivesDamagedFiles) {
  const TestFolder folder;
  ASSERT_TRUE(SpanForTest(2, 2).Write(folder / "whole").ok());
  const std::string whole = FileBytes(folder / "whole");
  Random random(12);
  for (int k = 0; k < 300; ++k) {
    std::string bytes = whole;
    if (k % 3 == 0) bytes.resize(static_cast<size_t>(random.Below(std::ssize(bytes))));
    if (!bytes.empty()) {
      bytes[static_cast<size_t>(random.Below(std::min<int64_t>(std::ssize(bytes), 4000)))] ^=
          static_cast<char>(1 << random.Below(8));
    }
    const std::filesystem::path path = folder / "damaged";
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    auto out = Upscaler::Read(path);
    if (out.ok()) (void)out->Enlarge(RandomImage(4, 3));
  }
}

}  // namespace
}  // namespace anchorsplat
