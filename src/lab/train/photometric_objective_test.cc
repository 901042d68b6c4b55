#include "train/photometric_objective.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

// An object of noise on black in the middle of a picture.
TrueView NoisyTruth(uint64_t seed, int width, int height) {
  TrueView truth;
  truth.picture = Image(width, height, 3);
  Random random(seed);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool inside = x > width / 4 && x < 3 * width / 4 && y > height / 4 && y < 3 * height / 4;
        truth.picture.at(c, y, x) = inside ? static_cast<float>(random.Uniform(0.2, 0.8)) : 0.0f;
      }
    }
  }
  return truth;
}

torch::Tensor NearTo(const TrueView& truth, uint64_t seed) {
  torch::Tensor picture = torch::zeros({3, truth.picture.height, truth.picture.width});
  Random random(seed);
  for (int64_t i = 0; i < picture.numel(); ++i) {
    const float value = truth.picture.pixels[static_cast<size_t>(i)];
    picture.mutable_data_ptr<float>()[i] = value == 0 ? 0 : value + static_cast<float>(random.Uniform(-0.1, 0.1));
  }
  return picture;
}

// The formulas of the header, pixel by pixel.
TEST(PhotometricObjective, TermsAreThoseOfTheFormulas) {
  const TrueView truth = NoisyTruth(1, 40, 30);
  torch::Tensor picture = NearTo(truth, 2);
  picture[0][2][3] = 0.25;   // of the render alone: foreground, too
  picture[1][15][20] = 1.7;  // counts as 1
  const auto sum = PhotometricObjective(std::vector{picture}, std::vector{truth}, {.l1 = 2, .mse = 3, .log_mse = 0.5});
  double l1 = 0, squares = 0, foreground = 0;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      bool any = false;
      for (int c = 0; c < 3; ++c) {
        const double r = std::min(1.0f, picture[c][y][x].item<float>()), t = truth.picture.at(c, y, x);
        any = any || r > 0 || t > 0.004;
        l1 += std::fabs(r - t);
        squares += (r - t) * (r - t);
      }
      foreground += any ? 1 : 0;
    }
  }
  const PhotometricTerms& terms = sum.terms[0];
  EXPECT_EQ(static_cast<double>(terms.foreground), foreground);
  EXPECT_NEAR(terms.l1, l1 / foreground, 1e-6);
  EXPECT_NEAR(terms.mse, squares / (3 * foreground), 1e-7);
  EXPECT_NEAR(terms.log_mse, std::log(squares / 3600 + 1e-7), 1e-5);
  EXPECT_NEAR(terms.psnr, -10 * std::log10(squares / 3600), 1e-4);
  EXPECT_NEAR(sum.loss.item<double>(), 2 * terms.l1 + 3 * terms.mse + 0.5 * terms.log_mse, 1e-5);
}

TEST(PhotometricObjective, GradientMatchesDifferenceQuotients) {
  const std::vector<TrueView> truth = {NoisyTruth(3, 32, 28), NoisyTruth(4, 26, 32)};
  const LossConfig weights{.l1 = 1, .ssim = 0.7, .mse = 2, .log_mse = 0.1};
  std::vector<torch::Tensor> pictures = {NearTo(truth[0], 5), NearTo(truth[1], 6)};
  for (torch::Tensor& picture : pictures) picture.requires_grad_(true);
  (PhotometricObjective(pictures, truth, weights).loss * 3).backward();
  const torch::NoGradGuard no_gradient;
  Random random(7);
  int checked = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const size_t v = static_cast<size_t>(random.Below(2));
    torch::Tensor flat = pictures[v].view({-1});
    const int64_t i = random.Below(flat.numel());
    const float value = flat[i].item<float>();
    if (value == 0) continue;  // at a kink of |d|, and of the foreground
    const double h = 2e-3;
    if (std::fabs(value - truth[v].picture.pixels[static_cast<size_t>(i)]) < 2 * h) continue;
    flat[i] = value + h;
    const double above = PhotometricObjective(pictures, truth, weights).loss.item<double>();
    flat[i] = value - h;
    const double below = PhotometricObjective(pictures, truth, weights).loss.item<double>();
    flat[i] = value;
    const double quotient = 3 * (above - below) / (2 * h);
    EXPECT_NEAR(pictures[v].grad().view({-1})[i].item<double>(), quotient, 0.02 * std::fabs(quotient) + 5e-4);
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

TEST(PhotometricObjective, PicturesWithoutForegroundCountForNothing) {
  TrueView black;
  black.picture = Image(20, 20, 3);
  std::fill(black.picture.pixels.begin(), black.picture.pixels.end(), 0.0f);
  const TrueView truth = NoisyTruth(1, 20, 20);
  std::vector<torch::Tensor> pictures = {torch::zeros({3, 20, 20}, torch::requires_grad()),
                                         NearTo(truth, 2).requires_grad_(true)};
  const auto both = PhotometricObjective(pictures, std::vector{black, truth}, {});
  const auto alone = PhotometricObjective(std::span(pictures).subspan(1), std::vector{truth}, {});
  EXPECT_EQ(both.loss.item<float>(), alone.loss.item<float>());
  both.loss.backward();
  EXPECT_EQ(pictures[0].grad().abs().max().item<float>(), 0);
  EXPECT_GT(pictures[1].grad().abs().max().item<float>(), 0);
  EXPECT_EQ(PhotometricObjective(std::span(pictures).first(1), std::vector{black}, {}).loss.item<float>(), 0);
}

TEST(PhotometricObjective, NotANumberIsNotHidden) {
  const TrueView truth = NoisyTruth(1, 20, 20);
  torch::Tensor picture = NearTo(truth, 2);
  picture[0][10][10] = std::nanf("");
  const auto sum = PhotometricObjective(std::vector{picture}, std::vector{truth}, {.ssim = 1});
  EXPECT_TRUE(std::isnan(sum.loss.item<float>()));
  EXPECT_THROW(PhotometricObjective(std::vector{picture}, std::vector{NoisyTruth(1, 20, 21)}, {}),
               std::invalid_argument);
}

TEST(PhotometricObjective, BitsDoNotDependOnThreads) {
  const std::vector<TrueView> truth = {NoisyTruth(3, 150, 140), NoisyTruth(4, 130, 150)};
  const auto gradient = [&](int threads) {
    SetThreadCount(threads);
    std::vector<torch::Tensor> pictures = {NearTo(truth[0], 5).requires_grad_(true), NearTo(truth[1], 6)};
    PhotometricObjective(pictures, truth, {.ssim = 0.5}).loss.backward();
    SetThreadCount(0);
    return pictures[0].grad();
  };
  EXPECT_TRUE(gradient(1).equal(gradient(3)));
}

// Whatever the truth has where it says nothing.
TEST(PhotometricObjective, IgnoredPixelsHaveNeitherLossNorGradient) {
  TrueView truth = NoisyTruth(3, 40, 30);
  truth.ignored.resize(40 * 30);
  for (size_t i = 0; i < truth.ignored.size(); ++i) truth.ignored[i] = i % 40 < 20 ? 1 : 0;
  TrueView other = truth;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 20; ++x) other.picture.at(1, y, x) = 0.9f;
  }
  const LossConfig weights = {.l1 = 1, .ssim = 0.5, .mse = 1};
  const auto evaluate = [&](const TrueView& view) {
    torch::Tensor picture = torch::full({3, 30, 40}, 0.5f).requires_grad_();
    const auto sum = PhotometricObjective(std::vector{picture}, std::vector{view}, weights);
    sum.loss.backward();
    return std::pair(sum.loss.item<double>(), picture.grad());
  };
  const auto [loss, gradient] = evaluate(truth);
  const auto [same, same_gradient] = evaluate(other);
  EXPECT_EQ(loss, same);
  EXPECT_TRUE(torch::equal(gradient, same_gradient));
  // L1 and squares reach no pixel of the hidden half, SSIM no farther than its window does.
  EXPECT_EQ(gradient.narrow(2, 0, 10).abs().max().item<float>(), 0);
  EXPECT_GT(gradient.narrow(2, 20, 20).abs().max().item<float>(), 0);
}

}  // namespace
}  // namespace anchorsplat
