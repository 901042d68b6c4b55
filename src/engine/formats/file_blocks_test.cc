#include "formats/file_blocks.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "formats/both_ways_for_test.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "formats/registry.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

// Every format that is written and can be looked at block by block: what is wrong with Gaussians is seen as it is when
// all of them are read. The tests of the readers compare what they read likewise.
TEST(FileBlocks, ShowWhatReadingGives) {
  const TestFolder folder;
  int formats = 0;
  for (const SplatFormat& format : Formats()) {
    if (format.blocks == nullptr || format.write == nullptr) continue;
    ++formats;
    const std::filesystem::path path = folder / ("a" + std::string(format.extensions.front()));
    for (int degree = 0; degree <= kMaxShDegree; ++degree) {
      for (const int64_t n : {int64_t{2}, int64_t{700}, 5 * kCloudBlockRows + 3}) {
        GaussianCloud cloud = CloudWithNonFinite(n, degree);
        cloud.comments = {"a comment", "credit: Mug by Ann, CC BY 4.0"};
        if (degree == 1) cloud.render_mode = RenderMode::kAntialiased;
        SCOPED_TRACE(testing::Message() << format.name << ", " << n << " Gaussians of degree " << degree);
        ASSERT_TRUE(format.write(path, cloud, {.overwrite = true}).ok());
        const auto file = InputFile::Open(path);
        ASSERT_TRUE(file.ok());
        EXPECT_TRUE(ReadBothWays(format.read, format.blocks, *file).ok());
        EXPECT_NE(*format.blocks(*file, {}), nullptr);
        const ReadLimits few = {.max_gaussians = n - 1};
        EXPECT_FALSE(ReadBothWays(format.read, format.blocks, *file, few).ok());
      }
    }
  }
  EXPECT_GE(formats, 6);
}

TEST(FileBlocks, FindWhatIsNotFiniteWhereverItLies) {
  const float inf = std::numeric_limits<float>::infinity();
  for (size_t count = 0; count < 50; ++count) {
    std::vector<float> values(count + 1, std::numeric_limits<float>::max());
    const auto bytes = [&] { return reinterpret_cast<const uint8_t*>(values.data()); };
    EXPECT_FALSE(HasNonFinite(bytes(), count));
    for (const float bad : {inf, -inf, std::nanf("")}) {
      values[count] = bad;
      EXPECT_FALSE(HasNonFinite(bytes(), count)) << "it lies behind them";
      EXPECT_TRUE(HasNonFinite(bytes(), count + 1));
    }
  }
}

// Records larger than what is read at once, and any number of them.
TEST(FileBlocks, ReadRowsOfAnySize) {
  std::string content;
  for (size_t k = 0; k < 1'000'000; ++k) content += static_cast<char>(k * 7 % 251);
  const InputFile file = InputFile::View("a", content);
  for (const size_t record : {size_t{1}, size_t{37}, size_t{200'000}}) {
    const auto last = static_cast<int64_t>((content.size() - 5) / record);
    std::string seen;
    Buffer<uint8_t> room;
    ASSERT_TRUE(ReadRows(file, 5, record, 1, last, room, [&](const uint8_t* bytes, int64_t count, int64_t to) {
                  EXPECT_EQ(static_cast<size_t>(to) * record, seen.size());
                  seen.append(reinterpret_cast<const char*>(bytes), static_cast<size_t>(count) * record);
                }).ok());
    EXPECT_EQ(seen, content.substr(5 + record, static_cast<size_t>(last - 1) * record));
  }
  Buffer<uint8_t> room;
  EXPECT_FALSE(ReadRows(file, 5, 10, 0, 100'000, room, [](const uint8_t*, int64_t, int64_t) {}).ok());
}

}  // namespace
}  // namespace anchorsplat
