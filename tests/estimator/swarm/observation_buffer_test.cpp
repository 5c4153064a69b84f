#include "estimator/swarm/observation_buffer.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulated_pair.hpp"

namespace crepes::observation_buffer_test {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr Timestamp kNow{1s};

/// A pair at 1 s, its log and both robots' states; a test leaves something out.
class Sighted : public testing::Test {
 protected:
  Sighted()
      : pair_(1, {.gyro = 0, .accel = 0, .bearing = 0, .range = 0, .tilt = 0, .priors = {}}),
        buffer_(member(1, pair_.mounting_B), member(2, pair_.mounting_N), 0.003, 0.1) {
    pair_.sample_imus(Timestamp{2s});
    const MutualSighting z = pair_.sighting(kNow);
    self_ = {pair_.imu_B, Tilt{kNow, z.B.up, 0.01}};
    neighbor_ = {pair_.imu_N, Tilt{kNow, z.N.up, 0.01}};
    see_once(own(kNow - 60ms), peer(kNow - 60ms));
  }

  /// What was seen before counts for what is seen now.
  void see_once(const Bearing& own, const Bearing& peer) {
    buffer_.add_own_bearing(own);
    buffer_.add_peer_bearing(peer);
  }

  static MemberConfig member(std::uint16_t id, const Mounting& mounting) {
    MemberConfig config;
    config.id = RobotId{id};
    config.p_body_led = mounting.led;
    config.p_body_uwb = mounting.antenna;
    return config;
  }
  Bearing own(Timestamp t) {
    const DirectionReading u = pair_.bearing(t);
    return {t, RobotId{2}, u.u, u.camera, 0.003};
  }
  Bearing peer(Timestamp t) {
    const DirectionReading u = pair_.peer_bearing(t);
    return {t, RobotId{1}, u.u, u.camera, 0.003};
  }
  void add_range(Timestamp t) { buffer_.add_range(t, pair_.range(t).range_m); }
  using Starts = std::variant<std::vector<MutualInitialization>, NoPoseReason>;
  static std::size_t count(const Starts& starts) {
    const auto* some = std::get_if<std::vector<MutualInitialization>>(&starts);
    return some == nullptr ? 0 : some->size();
  }
  static const MutualInitialization& first(const Starts& starts) {
    return std::get<std::vector<MutualInitialization>>(starts).front();
  }
  [[nodiscard]] NoPoseReason reason(const Bearing& peer_bearing) const {
    const auto result = buffer_.mutual_initializations(peer_bearing, self_, neighbor_);
    const auto* why = std::get_if<NoPoseReason>(&result);
    return why == nullptr ? NoPoseReason::kNone : *why;
  }

  SimulatedPair pair_;
  ObservationBuffer buffer_;
  RobotState self_;
  RobotState neighbor_;
};

TEST_F(Sighted, JoinsReadingsOfOneInstantToTheTruePose) {
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow);

  const auto result = buffer_.mutual_initializations(peer(kNow), self_, neighbor_);

  ASSERT_EQ(count(result), 1U);
  const Pose truth = pair_.truth(kNow).motion.T_B_N;
  EXPECT_LT(pose_difference(truth, first(result).raw.T_B_N).norm(), 1e-9);
}

// Antennas are some centimeters from camera and ring, in directions that are not known yet.
TEST_F(Sighted, TakesTheDistanceByTheRingWhereThereIsNoRange) {
  Bearing bearing = own(kNow);
  bearing.distance_m =
      (pair_.truth(kNow).motion.T_B_N * pair_.mounting_N.led - bearing.p_B_C).norm();
  bearing.distance_sigma_m = 0.2;
  buffer_.add_own_bearing(bearing);

  const auto result = buffer_.mutual_initializations(peer(kNow), self_, neighbor_);

  ASSERT_EQ(count(result), 1U);
  const RawPose& raw = first(result).raw;
  EXPECT_LT((pair_.truth(kNow).motion.T_B_N.p - raw.T_B_N.p).norm(), 0.2);
  EXPECT_GT(std::sqrt(raw.gaussian().covariance.topLeftCorner<3, 3>().trace()), 0.2);
}

// As a mirror image whose LEDs are not told apart.
TEST_F(Sighted, ABearingWithoutADistanceDoesNotSpoilOneThatHasIt) {
  for (const bool is_before : {true, false}) {
    buffer_ =
        ObservationBuffer(member(1, pair_.mounting_B), member(2, pair_.mounting_N), 0.003, 0.1);
    see_once(own(kNow - 60ms), peer(kNow - 60ms));
    Bearing sized = own(kNow);
    sized.distance_m = 4.0;
    sized.distance_sigma_m = 0.2;
    if (is_before) buffer_.add_own_bearing(own(kNow));
    buffer_.add_own_bearing(sized);
    if (!is_before) buffer_.add_own_bearing(own(kNow));
    EXPECT_EQ(count(buffer_.mutual_initializations(peer(kNow), self_, neighbor_)), 1U);
  }
}

TEST_F(Sighted, TurnsABearingOfANearbyInstantByTheGyroscope) {
  buffer_.add_own_bearing(own(kNow - 15ms));
  add_range(kNow);

  const auto result = buffer_.mutual_initializations(peer(kNow), self_, neighbor_);

  ASSERT_EQ(count(result), 1U);
  // What is left is the line of sight's own turn, 15 ms at up to 0.6 rad/s here.
  const Pose truth = pair_.truth(kNow).motion.T_B_N;
  EXPECT_LT(pose_difference(truth, first(result).raw.T_B_N).head<3>().norm(), 0.05);
}

TEST_F(Sighted, OffersAStartForEveryPlaceWhereItWasSeen) {
  Bearing mirrored = own(kNow);
  mirrored.u_B = so3_exp(0.2 * self_.tilt->up_B) * mirrored.u_B;
  Bearing before = mirrored;
  before.stamp -= 10ms;
  buffer_.add_own_bearing(before);
  buffer_.add_own_bearing(own(kNow - 10ms));
  buffer_.add_own_bearing(mirrored);
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow);

  const auto result = buffer_.mutual_initializations(peer(kNow), self_, neighbor_);

  ASSERT_EQ(count(result), 2U);  // the nearest frame's
  EXPECT_LT((first(result).bearing.u - mirrored.u_B).norm(), 1e-9);
}

TEST_F(Sighted, TakesNothingForARobotThatWasSeenOnlyOnce) {
  Bearing glint = own(kNow);
  glint.u_B = so3_exp(0.2 * self_.tilt->up_B) * glint.u_B;
  buffer_.add_own_bearing(glint);
  add_range(kNow);
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNotSeen);

  buffer_.add_own_bearing(own(kNow));
  Bearing peers_glint = peer(kNow);
  peers_glint.u_B = so3_exp(0.2 * neighbor_.tilt->up_B) * peers_glint.u_B;
  EXPECT_EQ(reason(peers_glint), NoPoseReason::kDoesNotSeeUs);
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNone);
}

TEST_F(Sighted, BelievesAPeerWhoseBearingsAreFarApart) {
  const Timestamp later = kNow + 200ms;
  buffer_.add_own_bearing(own(later - 5ms));
  buffer_.add_own_bearing(own(later));
  add_range(later);

  EXPECT_EQ(reason(peer(later)), NoPoseReason::kNone);  // 0.26 s after the one before
  Bearing glint = peer(later);
  glint.u_B = so3_exp(0.4 * neighbor_.tilt->up_B) * glint.u_B;
  EXPECT_EQ(reason(glint), NoPoseReason::kDoesNotSeeUs);

  // One that is near decides alone.
  Bearing between = peer(later - 50ms);
  between.u_B = so3_exp(0.4 * neighbor_.tilt->up_B) * between.u_B;
  buffer_.add_peer_bearing(between);
  EXPECT_EQ(reason(peer(later)), NoPoseReason::kDoesNotSeeUs);
}

TEST_F(Sighted, SaysWhatIsMissing) {
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNotSeen);

  buffer_.add_own_bearing(own(kNow - 50ms));
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNotSeen);

  buffer_.add_own_bearing(own(kNow));
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNoRange);

  add_range(kNow - 100ms);
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNoRange);

  add_range(kNow);
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNone);

  neighbor_.tilt.reset();
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kTiltUnknown);
}

TEST_F(Sighted, ATiltIsNotCarriedAcrossMissingSamples) {
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow);
  neighbor_.tilt->stamp = kNow - 300ms;
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kNone);

  neighbor_.imu = {};
  for (std::size_t i = 0; i < pair_.imu_N.size(); ++i) {
    const ImuSample& sample = pair_.imu_N[i];
    if (sample.stamp < kNow - 250ms || sample.stamp > kNow - 100ms) neighbor_.imu.push(sample);
  }
  EXPECT_EQ(reason(peer(kNow)), NoPoseReason::kTiltUnknown);
}

TEST_F(Sighted, AnOutlierAmongRangesDoesNotPass) {
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow - 20ms);
  buffer_.add_range(kNow, 40.0);
  add_range(kNow + 20ms);

  const auto result = buffer_.mutual_initializations(peer(kNow), self_, neighbor_);

  ASSERT_EQ(count(result), 1U);
  EXPECT_LT(first(result).raw.T_B_N.p.norm(), 10.0);
}

TEST_F(Sighted, ItsCovarianceIsPositiveDefinite) {
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow);

  const RawPose raw = first(buffer_.mutual_initializations(peer(kNow), self_, neighbor_)).raw;

  EXPECT_EQ(raw.covariance.llt().info(), Eigen::Success);
}

TEST_F(Sighted, ARobotWithoutAnImuStartsNothingFromWhatItSees) {
  buffer_.add_own_bearing(own(kNow));
  add_range(kNow);
  EXPECT_TRUE(buffer_.one_way_initialization(FilterAxes::kOurs, self_, neighbor_));

  EXPECT_FALSE(buffer_.one_way_initialization(FilterAxes::kOurs, {}, neighbor_));
}

}  // namespace
}  // namespace crepes::observation_buffer_test
