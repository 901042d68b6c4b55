#include "gpu/with_webgpu/shader_error.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

constexpr std::string_view kText = "a\n  b = c;  \nd";

TEST(ShaderError, QuotesTheLineThatNagaPointsTo) {
  const std::string message =
      "Validation Error\n\nCaused by:\n  In wgpuDeviceCreateShaderModule\n\nShader 'f' parsing error: no definition\n\n"
      "error: no definition in scope for identifier: `c`\n  \u250c\u2500 wgsl:2:7\n  \u2502\n2 \u2502   b = c;\n";
  EXPECT_EQ(ShaderError(message, kText), "no definition in scope for identifier: `c` in line 2, 'b = c;'");
}

TEST(ShaderError, QuotesTheLineThatTintPointsTo) {
  EXPECT_EQ(ShaderError("Error while parsing WGSL: :2:7 error: unresolved value 'c'\n  b = c;\n      ^\n", kText),
            "unresolved value 'c' in line 2, 'b = c;'");
}

TEST(ShaderError, WithoutAPlaceItIsWhatWasSaidLast) {
  EXPECT_EQ(ShaderError("Validation Error\n\nCaused by:\n  Unable to find entry point 'f'\n\n", kText),
            "Unable to find entry point 'f'");
  EXPECT_EQ(ShaderError("", kText), "");
  EXPECT_EQ(ShaderError("error: odd\n wgsl:9:1", kText), "odd in line 9, ''");
}

}  // namespace
}  // namespace anchorsplat
