#include "estimator/vision/light_direction.hpp"

#include <gtest/gtest.h>

#include <random>

#include "estimator/core/so3.hpp"

namespace crepes::light_direction_test {
namespace {

constexpr double kPxRad = 0.003;
constexpr double kLeastPx = 0.2;
constexpr double kFrame = 0.005;  // s

/// A light that circles the z axis, and spots of it that scatter.
class Light {
 public:
  Light(double rate_radps, std::uint32_t seed) : rate_radps_(rate_radps), random_(seed) {}

  [[nodiscard]] Eigen::Vector3d u_B() const {
    return so3_exp(rate_radps_ * t_s_ * Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitX();
  }
  Eigen::Vector3d spot(double scatter_px) {
    std::normal_distribution<double> noise(0.0, scatter_px * kPxRad);
    const Eigen::Vector3d u = u_B();
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(u);
    return (u + noise(random_) * across + noise(random_) * Eigen::Vector3d::UnitZ()).normalized();
  }
  void next() { t_s_ += kFrame; }

 private:
  double rate_radps_;
  double t_s_ = 0.0;
  std::mt19937 random_;
};

/// After so many spots.
LightDirection followed(Light& light, double scatter_px, int spots) {
  auto direction = LightDirection::at(light.spot(scatter_px), kPxRad, kLeastPx);
  for (int hits = 1; hits < spots; ++hits) {
    light.next();
    direction.predict(Eigen::Quaterniond::Identity(), kFrame);
    direction.correct(light.spot(scatter_px), kPxRad, kLeastPx, hits);
  }
  return direction;
}

TEST(LightDirection, ItsErrorIsWithinItsCovariance) {
  for (const double scatter_px : {0.2, 0.6}) {
    double nees = 0.0;
    constexpr int kSeeds = 300;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      Light light(0.5, seed);
      const LightDirection direction = followed(light, scatter_px, 200);
      nees += 0.5 * (direction.u_B - light.u_B()).squaredNorm() / direction.variance / kSeeds;
    }
    EXPECT_GT(nees, 0.3) << scatter_px;
    EXPECT_LT(nees, 1.15) << scatter_px;
  }
}

TEST(LightDirection, FollowsItsRate) {
  Light light(0.5, 1);
  const LightDirection direction = followed(light, 0.2, 200);
  EXPECT_LT((direction.rate_B - 0.5 * Eigen::Vector3d::UnitZ().cross(light.u_B())).norm(),
            5.0 * std::sqrt(direction.rate_variance));
}

TEST(LightDirection, MeasuresTheScatterOfItsSpotsButNeverLessThanConfigured) {
  for (const auto& [scatter_px, sigma_px] : {std::pair{0.05, 0.2}, {0.4, 0.4}, {1.0, 1.0}}) {
    double sum = 0.0;
    constexpr int kSeeds = 50;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      Light light(0.5, seed);
      sum += followed(light, scatter_px, 300).sigma_px(kLeastPx) / kSeeds;
    }
    EXPECT_NEAR(sum, sigma_px, 0.15 * sigma_px) << scatter_px;
  }
}

// It may be another light's.
TEST(LightDirection, OneSpotFarAwaySaysLittleOfTheScatter) {
  Light light(0.5, 1);
  LightDirection direction = followed(light, 0.2, 300);
  const double before_px = direction.sigma_px(kLeastPx);
  direction.correct((light.u_B() + 100.0 * kPxRad * Eigen::Vector3d::UnitZ()).normalized(), kPxRad,
                    kLeastPx, 300);
  EXPECT_LT(direction.sigma_px(kLeastPx), 1.1 * before_px);
}

TEST(LightDirection, TurnsWithTheBody) {
  Light light(0.5, 1);
  const LightDirection here = followed(light, 0.2, 50);
  const Eigen::Quaterniond R = so3_exp({0.3, -0.2, 0.5});
  LightDirection turned = here;
  LightDirection straight = here;
  turned.predict(R, kFrame);
  straight.predict(Eigen::Quaterniond::Identity(), kFrame);
  EXPECT_LT((turned.u_B - R * straight.u_B).norm(), 1e-12);
  EXPECT_LT((turned.rate_B - R * straight.rate_B).norm(), 1e-12);
  EXPECT_EQ(turned.variance, straight.variance);
}

}  // namespace
}  // namespace crepes::light_direction_test
