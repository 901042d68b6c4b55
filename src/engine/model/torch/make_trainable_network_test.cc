#include "model/torch/make_trainable_network.h"

#include <gtest/gtest.h>

#include <vector>

namespace anchorsplat {
namespace {

TEST(MakeTrainableNetwork, ThePublishedNetworkHasAllItsParametersInGroups) {
  const auto network = MakeTrainableNetwork("anchorsplat", {{"encoder_channels", std::vector<double>{16, 24}},
                                                            {"encoder_blocks", std::vector<double>{1, 1}},
                                                            {"decoder_channels", std::vector<double>{16}},
                                                            {"decoder_blocks", std::vector<double>{1}},
                                                            {"copies", 3.0}});
  ASSERT_TRUE(network.ok()) << network.error().message;
  EXPECT_EQ((*network)->copies(), 3);
  int64_t grouped = 0, all = 0;
  for (const auto& [name, parameters] : (*network)->Groups()) {
    for (const torch::Tensor& parameter : parameters) grouped += parameter.numel();
  }
  for (const torch::Tensor& parameter : (*network)->parameters()) all += parameter.numel();
  EXPECT_EQ(grouped, all);
  const auto wrong = MakeTrainableNetwork("anchorsplat", {{"encoder_channels", std::vector<double>{}}});
  EXPECT_FALSE(wrong.ok());
  EXPECT_FALSE(MakeTrainableNetwork("mlp", {}).ok());
}

}  // namespace
}  // namespace anchorsplat
