#include "estimator/swarm/neighbor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/support/simulated_pair.hpp"

namespace crepes::neighbor_test {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr RobotId kSelf{1};
constexpr RobotId kOther{2};

MemberConfig member(RobotId id, const Mounting& mounting) {
  MemberConfig config;
  config.id = id;
  config.name = "robot" + std::to_string(id.value);
  config.p_body_led = mounting.led;
  config.p_body_uwb = mounting.antenna;
  return config;
}

/// What reaches this robot; a test takes ingredients away.
struct Ingredients {
  bool reports = true;
  bool own_imu = true;
  bool peer_imu = true;
  bool own_tilt = true;
  bool peer_tilt = true;
  bool bearings = true;
  bool peer_bearings = true;
  bool ranges = true;
  int second_camera = -1;       ///< sees it as well: 0 at the same instants, 1 between them
  Duration imu_memory = 160ms;  ///< how much of the past a report contains
  double heading_rad = 0.0;  ///< own bearings turned so far about the vertical: a mirror in a wall
};

FilterSettings settings(Profile profile) {
  EstimatorSettings settings;
  settings.filters.profile = profile;
  return filter_settings(settings);
}

/// Robot 1's view of robot 2, fed from a simulated pair every 10 ms.
class View {
 public:
  explicit View(Profile profile = Profile::kTight, Duration report_delay = 20ms)
      : report_delay_(report_delay),
        neighbor_(member(kSelf, pair_.mounting_B), member(kOther, pair_.mounting_N),
                  settings(profile)) {}

  void run_until(Timestamp end, const Ingredients& with = {}) {
    for (; now_ <= end; now_ += 10ms) {
      pair_.sample_imus(now_);
      const auto step = now_.time_since_epoch() / 10ms;
      if (with.own_imu && !pair_.imu_B.empty()) self_.imu.push(pair_.imu_B.newest());
      if (with.own_tilt) self_.tilt = tilt(true, now_);
      if (with.bearings && step % 2 == 0) neighbor_.add(own_bearing(with.heading_rad));
      if (step % 2 == with.second_camera) neighbor_.add(second_bearing());
      if (with.ranges && step % 4 == 1) neighbor_.add(range());
      if (with.reports && step % 2 == 1) neighbor_.add_report(report(with), self_);
      neighbor_.tick(now_, self_);
    }
  }

  /// Ticks once a second and nothing else.
  void coast_until(Timestamp end) {
    for (; now_ <= end; now_ += 1s) neighbor_.tick(now_, self_);
  }

  /// What the other makes of us at this instant, off by a few centimeters and `attitude_rad` about
  /// each axis.
  void add_estimate_of_us(double attitude_rad) {
    ReceivedReport received = report({});
    const RelativeMotion motion = pair_.truth(received.report.stamp).motion;
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(0.05), Eigen::Vector3d::Constant(attitude_rad);
    const Matrix6d P = sigma.cwiseAbs2().asDiagonal();
    received.report.estimates = {{received.report.stamp,
                                  kSelf,
                                  {perturbed(motion.T_B_N.inverse(), sigma), P},
                                  -(motion.T_B_N.q.conjugate() * motion.v_B_N)}};
    neighbor_.add_report(received, self_);
  }

  [[nodiscard]] Vector6d error() const {
    return pose_difference(neighbor_.output().pose()->T_B_N.pose,
                           pair_.truth(neighbor_.output().pose()->stamp).motion.T_B_N);
  }
  [[nodiscard]] Neighbor& neighbor() { return neighbor_; }
  [[nodiscard]] NoPoseReason reason() const { return neighbor_.status().reason; }
  [[nodiscard]] std::uint64_t count(MeasurementKind kind, Verdict verdict) const {
    return neighbor_.status()
        .measurements[static_cast<std::size_t>(kind)][static_cast<std::size_t>(verdict)];
  }
  [[nodiscard]] RobotState& self() { return self_; }
  void set_report_delay(Duration delay) { report_delay_ = delay; }

  [[nodiscard]] ReceivedReport report(const Ingredients& with) {
    const Timestamp stamp = now_ - report_delay_;
    ReceivedReport received;
    received.report.sender = kOther;
    received.report.stamp = stamp;
    if (with.peer_tilt) received.report.tilt = tilt(false, stamp);
    for (std::size_t i = 0; with.peer_imu && i < pair_.imu_N.size(); ++i) {
      const ImuSample& sample = pair_.imu_N[i];
      if (sample.stamp <= stamp && sample.stamp > stamp - with.imu_memory) {
        received.report.imu.push_back(sample);
      }
    }
    if (with.peer_bearings && stamp > Timestamp{}) {
      const DirectionReading u = pair_.peer_bearing(stamp);
      received.report.bearings.push_back({stamp, kSelf, u.u, u.camera, u.sigma_rad});
    }
    return received;
  }

 private:
  [[nodiscard]] Tilt tilt(bool own, Timestamp stamp) {
    const MutualSighting z = pair_.sighting(stamp);
    return {stamp, own ? z.B.up : z.N.up, 0.01};
  }
  [[nodiscard]] Bearing own_bearing(double heading_rad) {
    const DirectionReading u = pair_.bearing(now_);
    const Eigen::AngleAxisd turn(heading_rad, pair_.sighting(now_).B.up);
    return {now_, kOther, turn * u.u, u.camera, u.sigma_rad};
  }
  [[nodiscard]] Bearing second_bearing() {
    const Eigen::Vector3d p_B_C = pair_.mounting_B.camera - Eigen::Vector3d(0.1, 0.0, 0.0);
    const DirectionReading u = pair_.bearing(now_, p_B_C, {0.0, 0.002, -0.003});
    return {now_, kOther, u.u, u.camera, u.sigma_rad};
  }
  [[nodiscard]] UwbRange range() { return {now_, kOther, pair_.range(now_).range_m, -80.0, -79.0}; }

  SimulatedPair pair_{1};
  Duration report_delay_;
  RobotState self_;
  Neighbor neighbor_;
  Timestamp now_{10ms};
};

TEST(Neighbor, IsLocatedWithinTwoSeconds) {
  View view;

  view.run_until(Timestamp{2s});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_EQ(view.reason(), NoPoseReason::kNone);
  EXPECT_EQ(view.neighbor().output().pose()->mode, PoseMode::kDirect);
  EXPECT_LT(view.error().head<3>().norm(), 0.35);  // mostly the range's bias of 0.1 m, one sigma
  EXPECT_LT(view.error().tail<3>().norm(), 0.06);
  EXPECT_LE(Timestamp{2s} - view.neighbor().output().pose()->stamp, Duration{20ms});
}

TEST(Neighbor, IsLocatedUnderThePapersProfileToo) {
  View view(Profile::kPaper);

  view.run_until(Timestamp{3s});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_LT(view.error().head<3>().norm(), 0.4);
  EXPECT_LT(view.error().tail<3>().norm(), 0.1);
}

struct Missing {
  const char* name;
  Ingredients with;
  NoPoseReason reason;
};

class WithoutAnIngredient : public testing::TestWithParam<Missing> {};

TEST_P(WithoutAnIngredient, ThereIsNoPoseAndAReason) {
  View view;

  view.run_until(Timestamp{3s}, GetParam().with);

  EXPECT_FALSE(view.neighbor().output().pose());
  EXPECT_EQ(view.reason(), GetParam().reason) << name_of(view.reason());
}

INSTANTIATE_TEST_SUITE_P(
    Neighbor, WithoutAnIngredient,
    testing::Values(Missing{"Reports", {.reports = false}, NoPoseReason::kNeverHeard},
                    Missing{"OwnImu", {.own_imu = false}, NoPoseReason::kNoOwnImu},
                    Missing{"PeerImu", {.peer_imu = false}, NoPoseReason::kNoPeerImu},
                    Missing{"OwnTilt", {.own_tilt = false}, NoPoseReason::kTiltUnknown},
                    Missing{"Bearings", {.bearings = false}, NoPoseReason::kNotSeen},
                    Missing{"Ranges", {.ranges = false}, NoPoseReason::kNoRange}),
    [](const auto& test) { return test.param.name; });

// Raw poses that waited for the lag start filters, and the paper's need no confirmation.
TEST(Neighbor, HasNoPoseFromWhenAnImuIsRefused) {
  for (const Profile profile : {Profile::kTight, Profile::kPaper}) {
    View view(profile);
    view.run_until(Timestamp{3s});
    ASSERT_TRUE(view.neighbor().output().published());

    view.neighbor().refuse_imu_until(Timestamp{4s});
    for (Timestamp t{3010ms}; t < Timestamp{3300ms}; t += 10ms) {
      view.run_until(t);
      EXPECT_FALSE(view.neighbor().output().published()) << to_seconds(t.time_since_epoch());
      EXPECT_EQ(view.reason(), NoPoseReason::kNoPeerImu);
    }
  }
}

TEST(Neighbor, IsSilentAfterTwoSecondsWithoutAReport) {
  View view;
  view.run_until(Timestamp{2s});

  view.run_until(Timestamp{60s}, {.reports = false, .bearings = false, .ranges = false});

  EXPECT_FALSE(view.neighbor().output().pose());
  EXPECT_EQ(view.reason(), NoPoseReason::kSilent);
}

TEST(Neighbor, LocatedInAMirrorIsFoundWithinASecondOfBeingSeenItself) {
  View view;
  view.run_until(Timestamp{1500ms}, {.heading_rad = 0.8});
  ASSERT_TRUE(view.neighbor().output().pose());
  ASSERT_GT(view.error().head<3>().norm(), 2.0);  // its own sightings of us and ranges agree

  view.run_until(Timestamp{2500ms});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_LT(view.error().head<3>().norm(), 0.35);
  EXPECT_LT(view.error().tail<3>().norm(), 0.06);
}

// One of the two is wrong, and for a third of a second nothing shows which.
TEST(Neighbor, IsNotPublishedWhileAllThatOneOfTheTwoSeesContradictsIt) {
  View view;
  view.run_until(Timestamp{3s});
  ASSERT_TRUE(view.neighbor().output().published());

  view.run_until(Timestamp{3s} + 340ms, {.heading_rad = 0.5});

  EXPECT_FALSE(view.neighbor().output().published());
}

TEST(Neighbor, IsLocatedInTimeAlthoughItDoesNotSeeUs) {
  View view;

  view.run_until(Timestamp{8s}, {.peer_bearings = false});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_LT(view.error().head<3>().norm(), 0.35);  // the range's bias
  EXPECT_LT(view.error().tail<3>().norm(), 0.15);
  EXPECT_EQ(view.neighbor().output().pose()->reset_counter, 1U);
}

TEST(Neighbor, IsLocatedByWhatItSeesOfUsWhereWeDoNotSeeIt) {
  View view;

  view.run_until(Timestamp{13s}, {.bearings = false});

  ASSERT_TRUE(view.neighbor().output().pose());
  const GaussianPose& said = view.neighbor().output().pose()->T_B_N;
  const Vector6d e = view.error();
  EXPECT_LT(e.dot(said.covariance.inverse() * e), 22.5);  // one in a thousand
  EXPECT_LT(e.tail<3>().norm(), 0.15);
}

TEST(Neighbor, IsLocatedAtOnceByItsOwnEstimateOfUsWhereWeDoNotSeeIt) {
  View view;
  view.run_until(Timestamp{2s} + 600ms, {.bearings = false});
  ASSERT_EQ(view.reason(), NoPoseReason::kNotSeen);

  view.add_estimate_of_us(0.03);
  view.run_until(Timestamp{2s} + 800ms, {.bearings = false});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_LT(view.error().head<3>().norm(), 0.35);
  EXPECT_LT(view.error().tail<3>().norm(), 0.1);
}

TEST(Neighbor, IsNotLocatedByAnEstimateThatHardlyKnowsHowWeAreTurned) {
  View view;
  view.run_until(Timestamp{2s} + 600ms, {.bearings = false});

  view.add_estimate_of_us(0.1);
  view.run_until(Timestamp{2s} + 800ms, {.bearings = false});

  EXPECT_FALSE(view.neighbor().output().pose());
}

TEST(Neighbor, IsPredictedForAWhileAndSaysSo) {
  View view;
  view.run_until(Timestamp{3s});
  const double sigma_before = view.neighbor().output().pose()->T_B_N.covariance.trace();

  view.run_until(Timestamp{3800ms}, {.bearings = false, .peer_bearings = false, .ranges = false});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_EQ(view.neighbor().output().pose()->mode, PoseMode::kPredicted);
  EXPECT_GT(view.neighbor().output().pose()->age_s, 0.5);
  EXPECT_GT(view.neighbor().output().pose()->T_B_N.covariance.trace(), sigma_before);
  EXPECT_FALSE(view.neighbor().output().estimate());  // nothing for the graph
}

TEST(Neighbor, HalfAnHourWithoutAReadingCostsNoMoreThanASecond) {
  View view;
  view.run_until(Timestamp{2s});

  // Were every look ahead to start at the last reading, this alone would run into the timeout.
  view.coast_until(Timestamp{30min});
  EXPECT_FALSE(view.neighbor().output().pose());
  view.run_until(Timestamp{30min + 3s});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_EQ(view.neighbor().output().pose()->reset_counter, 2U);
  EXPECT_LT(view.error().head<3>().norm(), 0.35);
}

TEST(Neighbor, ATiltFromLongAgoCostsNothingAndIsNotBelieved) {
  View view;
  view.run_until(Timestamp{1s});
  view.self().tilt->stamp = Timestamp{-(24h * 365 * 50)};  // fifty years of gyroscope

  EXPECT_FALSE(view.self().tilt_at(Timestamp{1s}));
  EXPECT_TRUE(view.self().tilt_at(view.self().tilt->stamp + 100ms));
}

TEST(Neighbor, RefusesRangesThatNoModuleCanMeanAndCountsThem) {
  View view;
  view.run_until(Timestamp{1s});
  const auto gated = view.count(MeasurementKind::kRange, Verdict::kGated);
  const double nan = std::numeric_limits<double>::quiet_NaN();

  view.neighbor().add(UwbRange{Timestamp{1s}, kOther, nan, -80.0, -79.0});
  view.neighbor().add(UwbRange{Timestamp{1s}, kOther, -1.0, -80.0, -79.0});
  view.neighbor().add(UwbRange{Timestamp{1s}, kOther, 1e6, -80.0, -79.0});
  view.neighbor().add(UwbRange{Timestamp{1s}, kOther, 3.0, -95.0, -79.0});  // no line of sight

  EXPECT_EQ(view.count(MeasurementKind::kRange, Verdict::kGated), gated + 4);
}

TEST(Neighbor, BelievesNoRangeWhileManyComeLateAlthoughItIsSeen) {
  View view;
  view.run_until(Timestamp{1s});
  const auto gated = view.count(MeasurementKind::kRange, Verdict::kGated);
  const auto add = [&](Duration t, double first_path_dbm) {
    view.neighbor().add(UwbRange{Timestamp{1s} + t, kOther, 3.0, first_path_dbm, -79.0});
  };

  for (int i = 1; i <= 8; ++i) add(i * 20ms, -95.0);
  add(180ms, -80.0);
  EXPECT_EQ(view.count(MeasurementKind::kRange, Verdict::kGated), gated + 9);

  add(2180ms, -80.0);  // where ranges are rare, the next one is believed
  EXPECT_EQ(view.count(MeasurementKind::kRange, Verdict::kGated), gated + 9);
}

TEST(Neighbor, SurvivesAReportFullOfNotANumber) {
  View view;
  view.run_until(Timestamp{2s});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ReceivedReport bad = view.report({});
  bad.report.bearings[0].u_B.setConstant(nan);
  bad.report.ranges.push_back({bad.report.stamp, kSelf, nan, nan, nan});
  bad.report.imu.push_back(
      {bad.report.stamp + 1ms, Eigen::Vector3d::Constant(nan), Eigen::Vector3d::Constant(nan)});

  view.neighbor().add_report(bad, view.self());
  view.run_until(Timestamp{4s});

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_LT(view.error().norm(), 0.35);
  EXPECT_GT(view.count(MeasurementKind::kPeerBearing, Verdict::kGated) +
                view.count(MeasurementKind::kPeerBearing, Verdict::kDegenerate),
            0U);
}

TEST(Neighbor, CountsTheBearingsOfASecondCameraAsSkippedWhileTheFirstSees) {
  for (const int when : {0, 1}) {
    View view;
    view.run_until(Timestamp{2s});
    const auto fused = view.count(MeasurementKind::kBearing, Verdict::kFused);
    const auto gated = view.count(MeasurementKind::kBearing, Verdict::kGated);
    EXPECT_EQ(view.count(MeasurementKind::kBearing, Verdict::kSkipped), 0U);

    view.run_until(Timestamp{4s}, {.second_camera = when});

    ASSERT_TRUE(view.neighbor().output().pose());
    EXPECT_EQ(view.count(MeasurementKind::kBearing, Verdict::kFused), fused + 100);
    EXPECT_NEAR(view.count(MeasurementKind::kBearing, Verdict::kSkipped), 100 - 5, 1);  // lag
    EXPECT_EQ(view.count(MeasurementKind::kBearing, Verdict::kGated), gated);
  }
}

TEST(Neighbor, CountsWhatComesTooLate) {
  View view;
  view.run_until(Timestamp{2s});

  view.neighbor().add(UwbRange{Timestamp{1500ms}, kOther, 3.0, -80.0, -79.0});

  EXPECT_EQ(view.count(MeasurementKind::kRange, Verdict::kLate), 1U);
}

TEST(Neighbor, IsReachedByTheGraphWhenItIsNotSeen) {
  const Ingredients unseen{.bearings = false, .peer_bearings = false, .ranges = false};
  View view;
  view.run_until(Timestamp{1s}, unseen);
  GraphPose pose;
  pose.neighbor = kOther;
  pose.T_B_N = {{{4.0, 1.0, 0.0}, Eigen::Quaterniond::Identity()}, 0.01 * Matrix6d::Identity()};

  view.neighbor().add(StampedGraphPose{Timestamp{1s}, pose});
  view.run_until(Timestamp{1100ms}, unseen);

  ASSERT_TRUE(view.neighbor().output().pose());
  EXPECT_EQ(view.neighbor().output().pose()->mode, PoseMode::kGraph);
  EXPECT_TRUE(view.neighbor().output().pose()->sources.graph);
  EXPECT_FALSE(view.neighbor().output().estimate());  // the graph does not hear its own echo
}

// New settings forget what the last look ahead found, equal ones as well.
TEST(Neighbor, LooksAheadFromTheLastLookAsFromTheStart) {
  for (const Profile profile : {Profile::kTight, Profile::kPaper}) {
    View view(profile);
    View fresh(profile);
    std::mt19937 random(1);
    double most = 0.0;
    for (Timestamp t{10ms}; t <= Timestamp{4s}; t += 10ms) {
      // One packet in three is lost, the others overtake each other.
      const Duration delay = 10ms * std::uniform_int_distribution(1, 7)(random);
      const Ingredients with{
          .reports = random() % 3 != 0, .peer_bearings = random() % 2 == 0, .imu_memory = 30ms};
      for (View* each : {&view, &fresh}) each->set_report_delay(delay);
      fresh.neighbor().reconfigure(settings(profile));
      for (View* each : {&view, &fresh}) each->run_until(t, with);

      const auto& pose = view.neighbor().output().pose();
      ASSERT_EQ(pose.has_value(), fresh.neighbor().output().pose().has_value());
      if (pose) most = std::max(most, (view.error() - fresh.error()).norm());
    }
    ASSERT_TRUE(view.neighbor().output().pose());
    EXPECT_LT(most, 1e-4);
  }
}

}  // namespace
}  // namespace crepes::neighbor_test
