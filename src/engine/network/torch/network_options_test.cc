#include "network/torch/network_options.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

TEST(OptionReader, TakesWhatIsGivenAndLeavesDefaults) {
  OptionReader reader({{"copies", 4.0}, {"prior", true}, {"widths", std::vector<double>{8, 16}}, {"unit", "cube"}});
  int64_t copies = 1, depth = 7;
  bool prior = false;
  double rate = 0.25;
  std::vector<int64_t> widths;
  std::string unit = "scale";
  reader.Integer("copies", 1, 64, copies);
  reader.Integer("depth", 1, 64, depth);
  reader.Flag("prior", prior);
  reader.Number("rate", 0, 1, rate);
  reader.Integers("widths", 1, 100, widths);
  reader.Text("unit", {"scale", "cube"}, unit);
  EXPECT_TRUE(reader.Finish().ok());
  EXPECT_EQ(copies, 4);
  EXPECT_EQ(depth, 7);
  EXPECT_TRUE(prior);
  EXPECT_EQ(rate, 0.25);
  EXPECT_EQ(widths, (std::vector<int64_t>{8, 16}));
  EXPECT_EQ(unit, "cube");
}

TEST(OptionReader, ComplainsByName) {
  const auto complaint = [](const NetworkOptions& options) {
    OptionReader reader(options);
    int copies = 1;
    std::vector<int64_t> widths;
    std::string unit;
    reader.Integer("copies", 1, 64, copies);
    reader.Integers("widths", 1, 100, widths);
    reader.Text("unit", {"scale", "cube"}, unit);
    const Status status = reader.Finish();
    return status.ok() ? std::string("none") : status.error().message;
  };
  EXPECT_EQ(complaint({{"copies", 0.0}}), "copies: expected a whole number from 1 to 64");
  EXPECT_EQ(complaint({{"copies", 1.5}}), "copies: expected a whole number from 1 to 64");
  EXPECT_EQ(complaint({{"copies", 1e300}}), "copies: expected a whole number from 1 to 64");
  EXPECT_EQ(complaint({{"copies", "4"}}), "copies: expected a whole number");
  EXPECT_EQ(complaint({{"widths", std::vector<double>{8, 0}}}),
            "widths: expected a list of whole numbers from 1 to 100");
  EXPECT_EQ(complaint({{"unit", "metre"}}), "unit: expected one of \"scale\", \"cube\"");
  EXPECT_EQ(complaint({{"epsilon", 1.0}}), "epsilon: unknown option");
}

}  // namespace
}  // namespace anchorsplat
