#include <gtest/gtest.h>

#include "core/parallel.h"
#include "fit/cloud_optimizer.h"
#include "render/rasterizer.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

struct Learnt {
  GaussianCloud cloud;
  CloudOptimizer optimizer;
  CloudGradient gradient;
};

// A few steps towards a grey picture; in one go, or with the coefficients' step within the backward pass.
Learnt Learn(int cloud_degree, int degree, int64_t gaussians, bool within) {
  Learnt l;
  l.cloud = test::RandomCloud(5, {.gaussians = gaussians, .degree = cloud_degree});
  l.optimizer = CloudOptimizer(l.cloud);
  const Camera camera = test::RandomCamera(5, 67, 45);
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient wanted;
  const LearningRates rates;
  for (int step = 0; step < 4; ++step) {
    EXPECT_TRUE(rasterizer.Render(l.cloud, camera, {.sh_degree = degree + step / 2, .gradient = true}, output).ok());
    wanted.color = output.color;
    for (float& x : wanted.color.pixels) x -= 0.5f;
    wanted.box = {3, 2, 60, 40};
    if (within) {
      const CoefficientStep coefficients = l.optimizer.BeginStep(rates, degree + step / 2, l.cloud);
      EXPECT_TRUE(rasterizer.Backward(l.cloud, wanted, l.gradient, &coefficients).ok());
      l.optimizer.FinishStep(rates, 1e-4, l.gradient, l.cloud);
    } else {
      EXPECT_TRUE(rasterizer.Backward(l.cloud, wanted, l.gradient).ok());
      l.optimizer.Step(rates, 1e-4, degree + step / 2, l.gradient, l.cloud);
    }
  }
  return l;
}

TEST(CoefficientStep, SameBitsAsAGradientThatIsWrittenDown) {
  for (const int threads : {1, 3}) {
    SetThreadCount(threads);
    for (int cloud_degree = 0; cloud_degree <= 3; ++cloud_degree) {
      for (int degree = 0; degree <= cloud_degree; ++degree) {
        SCOPED_TRACE(testing::Message() << threads << " threads, degree " << degree << " of " << cloud_degree);
        // More than one chunk, and a last window of rows that is not full.
        const Learnt expected = Learn(cloud_degree, degree, 1237, false), got = Learn(cloud_degree, degree, 1237, true);
        EXPECT_TRUE(got.gradient.sh.empty());
        EXPECT_EQ(got.gradient.means, expected.gradient.means);
        EXPECT_EQ(got.cloud.sh, expected.cloud.sh);
        EXPECT_EQ(got.cloud.means, expected.cloud.means);
        EXPECT_EQ(got.cloud.quats, expected.cloud.quats);
        EXPECT_EQ(got.optimizer.steps(), expected.optimizer.steps());
        for (size_t a = 0; a < expected.optimizer.moments().size(); ++a) {
          EXPECT_EQ(got.optimizer.moments()[a].first, expected.optimizer.moments()[a].first) << a;
          EXPECT_EQ(got.optimizer.moments()[a].second, expected.optimizer.moments()[a].second) << a;
        }
        EXPECT_NE(got.cloud.sh, test::RandomCloud(5, {.gaussians = 1237, .degree = cloud_degree}).sh);
      }
    }
  }
  SetThreadCount(0);
}

TEST(CoefficientStep, RefusesThatOfAnotherCloudOrOfFewerCoefficients) {
  GaussianCloud cloud = test::RandomCloud(6, {.gaussians = 20}), other = cloud;
  CloudOptimizer optimizer(cloud);
  Rasterizer rasterizer;
  RenderOutput output;
  CloudGradient gradient;
  ASSERT_TRUE(rasterizer.Render(cloud, test::RandomCamera(6, 20, 20), {.gradient = true}, output).ok());
  const RenderGradient wanted{output.color, {}, {0, 0, 20, 20}};
  const LearningRates rates;
  const CoefficientStep foreign = optimizer.BeginStep(rates, 3, other), few = optimizer.BeginStep(rates, 2, cloud);
  EXPECT_FALSE(rasterizer.Backward(cloud, wanted, gradient, &foreign).ok());
  EXPECT_FALSE(rasterizer.Backward(cloud, wanted, gradient, &few).ok());
  EXPECT_EQ(cloud.sh, other.sh);
  EXPECT_EQ(optimizer.steps(), 0);
}

}  // namespace
}  // namespace anchorsplat
