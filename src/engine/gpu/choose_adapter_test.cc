#include "gpu/choose_adapter.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace anchorsplat {
namespace {

using Type = GpuAdapter::Type;
using Kind = DeviceChoice::Kind;

struct Given {
  Type type;
  const char* backend = "Vulkan";
  const char* unusable = "";
};

std::vector<GpuAdapter> Adapters(const std::vector<Given>& given) {
  std::vector<GpuAdapter> adapters;
  for (const Given& one : given) {
    GpuAdapter adapter;
    adapter.number = static_cast<int>(adapters.size());
    adapter.type = one.type;
    adapter.backend = one.backend;
    adapter.unusable = one.unusable;
    adapters.push_back(adapter);
  }
  return adapters;
}

std::optional<size_t> Chosen(const std::vector<Given>& given, Kind kind, int number = 0) {
  const Result<size_t> index = ChooseAdapter(Adapters(given), {kind, number});
  return index.ok() ? std::optional(*index) : std::nullopt;
}

TEST(ChooseAdapter, RealCardsComeBeforeTheCpu) {
  EXPECT_EQ(Chosen({{Type::kCpu}, {Type::kUnknown}, {Type::kIntegrated}, {Type::kDiscrete}}, Kind::kGpu), 3u);
  EXPECT_EQ(Chosen({{Type::kCpu}, {Type::kUnknown}, {Type::kIntegrated}}, Kind::kGpu), 2u);
  EXPECT_EQ(Chosen({{Type::kCpu}, {Type::kUnknown}}, Kind::kGpu), 1u);
  EXPECT_EQ(Chosen({{Type::kCpu}, {Type::kCpu}}, Kind::kGpu), 0u);
}

TEST(ChooseAdapter, OpenGlIsTheLastResortOfItsKind) {
  EXPECT_EQ(Chosen({{Type::kDiscrete, "OpenGL"}, {Type::kDiscrete}}, Kind::kGpu), 1u);
  EXPECT_EQ(Chosen({{Type::kDiscrete}, {Type::kDiscrete, "OpenGL"}}, Kind::kGpu), 0u);
  EXPECT_EQ(Chosen({{Type::kDiscrete, "OpenGL ES"}, {Type::kCpu}}, Kind::kGpu), 0u);
}

TEST(ChooseAdapter, AutoNeverTakesTheCpu) {
  EXPECT_EQ(Chosen({{Type::kCpu}, {Type::kIntegrated}}, Kind::kAuto), 1u);
  EXPECT_EQ(Chosen({{Type::kCpu}}, Kind::kAuto), std::nullopt);
  EXPECT_EQ(ChooseAdapter(Adapters({{Type::kCpu}}), {Kind::kAuto}).error().message,
            "only software adapters were found: --device gpu uses them, auto does not");
}

TEST(ChooseAdapter, WhatCannotBeUsedIsNotTaken) {
  EXPECT_EQ(Chosen({{Type::kDiscrete, "unknown", "it is a null adapter"}, {Type::kCpu}}, Kind::kGpu), 1u);
  EXPECT_EQ(Chosen({{Type::kDiscrete, "unknown", "it is a null adapter"}}, Kind::kGpu), std::nullopt);
  const Result<size_t> named =
      ChooseAdapter(Adapters({{Type::kDiscrete, "unknown", "it is a null adapter"}}), {Kind::kNumber, 0});
  ASSERT_FALSE(named.ok());
  EXPECT_EQ(named.error().message, "device 0 cannot be used: it is a null adapter");
}

TEST(ChooseAdapter, NumbersAreTakenAtTheirWord) {
  EXPECT_EQ(Chosen({{Type::kDiscrete}, {Type::kCpu}}, Kind::kNumber, 1), 1u);
  const Result<size_t> beyond = ChooseAdapter(Adapters({{Type::kDiscrete}, {Type::kCpu}}), {Kind::kNumber, 2});
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(beyond.error().message,
            "there is no device 2: the adapters here are numbered from 0 to 1 (anchorsplat doctor lists them)");
}

TEST(ChooseAdapter, NoneIsASentence) {
  const Result<size_t> none = ChooseAdapter({}, {Kind::kNumber, 0});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat
