#include "estimator/vision/hidden_lights.hpp"

#include <gtest/gtest.h>

namespace crepes::hidden_lights_test {
namespace {

using namespace std::chrono_literals;

constexpr Timestamp kHidden{100s};

HiddenLight light_at(const Eigen::Vector3d& u_B, Timestamp last_seen = kHidden) {
  return {.u_B = u_B.normalized(),
          .rate_B = Eigen::Vector3d::Zero(),
          .last_seen = last_seen,
          .evidence = {}};
}

/// Evidence to recognize.
HiddenLight marked(HiddenLight light, double doubt) {
  light.evidence.doubt = doubt;
  return light;
}

TEST(HiddenLights, AreExpectedWhereTheGyroAndTheirOwnMotionCarryThem) {
  std::vector<BlinkEvidence> unused;
  HiddenLights lights;
  HiddenLight light = marked(light_at({1.0, 0.0, 0.0}), 7.0);
  light.rate_B = {0.0, 0.0, 0.2};
  lights.add(light, unused);
  lights.rotate_frame(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())));
  const Eigen::Vector3d carried(std::cos(1.0), std::sin(1.0), 0.2);

  EXPECT_FALSE(lights.extract_match(Eigen::Vector3d::UnitX(), kHidden + 1s));
  EXPECT_FALSE(lights.extract_match({std::cos(1.0), std::sin(1.0), -0.2}, kHidden + 1s))
      << "against its way";
  const auto taken = lights.extract_match(carried.normalized(), kHidden + 1s);

  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->evidence->doubt, 7.0);
  EXPECT_FALSE(lights.extract_match(carried.normalized(), kHidden + 1s)) << "it is hidden no more";
}

TEST(HiddenLights, AreStrangersTheMoreTheLongerAndFartherAway) {
  const auto stranger = [](double off, Duration after) {
    std::vector<BlinkEvidence> unused;
    HiddenLights lights;
    lights.add(light_at({1.0, 0.0, 0.0}), unused);
    return lights.extract_match(Eigen::Vector3d(1.0, off, 0.0).normalized(), kHidden + after)
        ->stranger;
  };

  EXPECT_GE(stranger(0.0, 100ms), 1e-3) << "whatever hides one may show another";
  EXPECT_LT(stranger(0.0, 100ms), 2e-3);
  EXPECT_GT(stranger(0.15, 1s), 2.0 * stranger(0.0, 1s));
  EXPECT_GT(stranger(0.0, 2800ms), 2.0 * stranger(0.0, 1s));
}

TEST(HiddenLights, AreNotContinuedWhereTwoAreExpectedAlike) {
  std::vector<BlinkEvidence> unused;
  HiddenLights lights;
  lights.add(marked(light_at({1.0, 0.05, 0.0}), 1.0), unused);
  lights.add(marked(light_at({1.0, -0.05, 0.0}), 2.0), unused);

  EXPECT_FALSE(lights.extract_match(Eigen::Vector3d::UnitX(), kHidden + 1s)) << "it may be either";
  const auto nearer =
      lights.extract_match(Eigen::Vector3d(1.0, 0.15, 0.0).normalized(), kHidden + 1s);

  ASSERT_TRUE(nearer);
  EXPECT_EQ(nearer->evidence->doubt, 1.0);
  EXPECT_GT(nearer->stranger, 0.05) << "for it may be the other";
}

TEST(HiddenLights, AreForgottenAfterAWhileAndBounded) {
  std::vector<BlinkEvidence> unused;
  HiddenLights lights;
  for (std::size_t i = 0; i <= HiddenLights::kCapacity; ++i)
    lights.add(marked(light_at({1.0, 0.0, 0.0}, kHidden + i * 1ms), 1.0), unused);
  EXPECT_EQ(unused.size(), 1U);

  lights.drop_old(kHidden + HiddenLights::kLongest + 10ms, unused);
  EXPECT_EQ(unused.size(), 10U);
  lights.drop_old(kHidden + 1h, unused);

  EXPECT_EQ(unused.size(), HiddenLights::kCapacity + 1);
  EXPECT_EQ(unused.front().doubt, 0.0) << "nothing is left of it";
  EXPECT_FALSE(lights.extract_match(Eigen::Vector3d::UnitX(), kHidden + 1h));
}

}  // namespace
}  // namespace crepes::hidden_lights_test
