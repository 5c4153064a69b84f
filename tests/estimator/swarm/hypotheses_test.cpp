#include "estimator/swarm/hypotheses.hpp"

#include <gtest/gtest.h>

#include <array>
#include <map>

namespace crepes {
namespace {

using std::chrono::milliseconds;

const PairMounting kMounting{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                             Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
const Pose kTruth{{4.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};

/// `count` filters of a robot four meters ahead, which differ in its heading.
OneWayStart headings(int count) {
  OneWayStart start;
  const Vector6d sigma{{0.1, 0.1, 0.1, 0.02, 0.02, 0.02}};
  for (int i = 0; i < count; ++i) {
    Vector6d turn = Vector6d::Zero();
    turn(5) = 0.3 * i / count;
    start.T_B_N.push_back({perturbed(kTruth, turn), sigma.cwiseAbs2().asDiagonal()});
  }
  return start;
}

ImuSample at_rest(Timestamp t) {
  return {.stamp = t,
          .gyro_radps = Eigen::Vector3d::Zero(),
          .accel_mps2 = Eigen::Vector3d(0.0, 0.0, 9.81)};
}

Measurement reading(MeasurementKind kind, Timestamp t) {
  if (kind == MeasurementKind::kRange) return {t, kind, RangeReading{4.0, 0.05}};
  const double side = kind == MeasurementKind::kBearing ? 1.0 : -1.0;
  return {t, kind,
          DirectionReading{side * Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero(), 0.001}};
}

constexpr int kSeconds = 10;

/// How many readings of each kind `count` filters take in the first and in the last of ten seconds,
/// of 200, 200 and 50.
std::array<std::map<MeasurementKind, int>, 2> taken_by(int count) {
  Hypotheses hypotheses(filter_settings({}, {}, {}), kMounting);
  ImuHistory imu;
  EXPECT_TRUE(hypotheses.start(Timestamp{}, headings(count)));
  std::array<std::map<MeasurementKind, int>, kSeconds> taken;
  for (int ms = 0; ms < kSeconds * 1000; ++ms) {
    const Timestamp t{milliseconds{ms}};
    const auto offer = [&](MeasurementKind kind) {
      const Measurement one = reading(kind, t);
      const Fusion fusion = hypotheses.fuse({&one, 1}, imu, imu).fusion;
      if (fusion.verdict != Verdict::kSkipped) ++taken.at(ms / 1000)[kind];
    };
    if (ms % 10 == 0) imu.push(at_rest(t));
    if (ms % 5 == 0) offer(MeasurementKind::kBearing);
    if (ms % 5 == 1) offer(MeasurementKind::kPeerBearing);
    if (ms % 20 == 2) offer(MeasurementKind::kRange);
  }
  return {taken.front(), taken.back()};
}

// A slow computer that has too much to do falls behind, and has more to do for that.
TEST(Hypotheses, TakeFewerReadingsTheMoreFiltersThereAreForLong) {
  const std::map all{std::pair{MeasurementKind::kBearing, 200},
                     std::pair{MeasurementKind::kPeerBearing, 200},
                     std::pair{MeasurementKind::kRange, 50}};
  EXPECT_EQ(taken_by(1)[1], all);
  EXPECT_EQ(taken_by(4)[1], all);
  EXPECT_EQ(taken_by(19)[0], all) << "a start has time";
  for (const int filters : {40, 160}) {
    const auto last = taken_by(filters)[1];
    ASSERT_EQ(last.size(), 3U) << "a kind goes without";
    const int most = 1000 / filters + 1;
    for (const auto& [kind, count] : last) {
      EXPECT_LE(count, most) << name_of(kind) << ", " << filters << " filters";
      EXPECT_GE(count, most / 2) << name_of(kind) << ", " << filters << " filters";
    }
  }
}

}  // namespace
}  // namespace crepes
