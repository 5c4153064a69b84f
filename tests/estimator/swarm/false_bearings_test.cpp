#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "estimator/swarm/neighbor.hpp"
#include "tests/support/simulated_pair.hpp"

namespace crepes::false_bearings_test {
namespace {

using namespace std::chrono_literals;
using test::RandomGeometry;
using test::SimulatedPair;

constexpr RobotId kSelf{1};
constexpr RobotId kOther{2};

/// Bearings of one frame in which at most one is true.
struct Frame {
  std::vector<Bearing> bearings;
  std::size_t true_one = std::numeric_limits<std::size_t>::max();
};

enum class Nuisance {
  kCrowd,    ///< in every frame one true bearing among ten that point just anywhere
  kFlicker,  ///< one bearing a frame, true in one frame of ten
  kFloor,    ///< the mirror image in a floor half a meter below, in two frames of three
};

/// Robot 1's view of robot 2 while false bearings of both come in.
class Dazzled {
 public:
  Dazzled(std::uint64_t seed, Nuisance nuisance)
      : pair_(seed, {.bearing = 0.001}), random_(seed), nuisance_(nuisance) {
    neighbor_.outcomes().keep_records();
  }

  void run_until(Timestamp end) {
    for (; now_ <= end; now_ += 5ms, ++frames_) {
      pair_.sample_imus(now_);
      if (!pair_.imu_B.empty()) self_.imu.push(pair_.imu_B.newest());
      const MutualSighting z = pair_.sighting(now_);
      self_.tilt = Tilt{now_, z.B.up, 0.1};
      const Frame own = frame(kOther, pair_.bearing(now_), z.B.up, MeasurementKind::kBearing);
      for (const Bearing& bearing : own.bearings) neighbor_.add(bearing);
      const Frame peers =
          frame(kSelf, pair_.peer_bearing(now_), z.N.up, MeasurementKind::kPeerBearing);
      report_.bearings.insert(report_.bearings.end(), peers.bearings.begin(), peers.bearings.end());
      if (frames_ % 4 == 0) {
        neighbor_.add(UwbRange{now_, kOther, pair_.range(now_).range_m, -80.0, -79.0});
        send_report(z.N.up);
        neighbor_.tick(now_, self_);
      }
      if (!neighbor_.output().pose() && !first_pose_) continue;
      if (!first_pose_) first_pose_ = now_;
      judge(neighbor_.outcomes().drain_records());
    }
  }

  [[nodiscard]] double precision() const {
    return static_cast<double>(true_fused_) / static_cast<double>(fused_);
  }
  [[nodiscard]] double recall() const {
    return static_cast<double>(true_fused_) / static_cast<double>(true_);
  }
  [[nodiscard]] std::optional<Timestamp> first_pose() const { return first_pose_; }
  [[nodiscard]] Vector6d error() const {
    return pose_difference(neighbor_.output().pose()->T_B_N.pose,
                           pair_.truth(neighbor_.output().pose()->stamp).motion.T_B_N);
  }
  [[nodiscard]] const std::optional<NeighborPose>& pose() const {
    return neighbor_.output().pose();
  }

 private:
  static MemberConfig member(RobotId id, const Mounting& mounting) {
    MemberConfig config;
    config.id = id;
    config.p_body_led = mounting.led;
    config.p_body_uwb = mounting.antenna;
    return config;
  }

  Frame frame(RobotId seen, const DirectionReading& truth, const Eigen::Vector3d& up,
              MeasurementKind kind) {
    Frame frame;
    const auto add = [&](const Eigen::Vector3d& u) {
      frame.bearings.push_back({now_, seen, u, truth.camera, truth.sigma_rad});
    };
    const bool floor = nuisance_ == Nuisance::kFloor;
    const int count = nuisance_ == Nuisance::kFlicker ? 1 : floor ? 2 : 10;
    const int place = random_.index(floor ? 2 : 10);
    for (int i = 0; i < count; ++i) {
      if (i == place) {
        frame.true_one = frame.bearings.size();
        add(truth.u);
      } else if (!floor) {
        add(random_.direction());
      } else if (random_.index(3) != 0) {
        add((pair_.truth(now_).motion.T_B_N.p.norm() * truth.u - up).normalized());
      }
    }
    truth_[{kind, now_}] = frame.true_one;
    return frame;
  }

  void send_report(const Eigen::Vector3d& up_N) {
    report_.sender = kOther;
    report_.stamp = now_;
    report_.tilt = {now_, up_N, 0.1};
    if (!pair_.imu_N.empty()) {
      for (std::size_t i = pair_.imu_N.size() - std::min<std::size_t>(4, pair_.imu_N.size());
           i < pair_.imu_N.size(); ++i)
        report_.imu.push_back(pair_.imu_N[i]);
    }
    neighbor_.add_report({report_, 0.0}, self_);
    report_ = {};
  }

  // Records of one frame come in the order of its bearings.
  void judge(const Records& records) {
    for (const MeasurementRecord& record : records.measurements) {
      const auto frame = truth_.find({record.kind, record.stamp});
      if (frame == truth_.end() || record.fusion.verdict == Verdict::kNoState) continue;
      const bool is_true = judged_[{record.kind, record.stamp}]++ == frame->second;
      const bool is_fused = record.fusion.verdict == Verdict::kFused;
      true_ += is_true ? 1 : 0;
      fused_ += is_fused ? 1 : 0;
      true_fused_ += is_true && is_fused ? 1 : 0;
    }
  }

  using Key = std::pair<MeasurementKind, Timestamp>;

  SimulatedPair pair_;
  RandomGeometry random_;
  Nuisance nuisance_;
  RobotState self_;
  Neighbor neighbor_{member(kSelf, pair_.mounting_B), member(kOther, pair_.mounting_N),
                     filter_settings({})};
  Report report_;
  Timestamp now_{5ms};
  int frames_ = 0;
  std::optional<Timestamp> first_pose_;
  std::map<Key, std::size_t> truth_;
  std::map<Key, std::size_t> judged_;
  int true_ = 0;
  int fused_ = 0;
  int true_fused_ = 0;
};

class Among : public testing::TestWithParam<Nuisance> {};

TEST_P(Among, FalseBearingsTheTrueOnesAreFound) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Dazzled view(seed, GetParam());

    view.run_until(Timestamp{3s});

    ASSERT_TRUE(view.pose()) << "seed " << seed;
    EXPECT_LT(*view.first_pose(), Timestamp{1500ms}) << "seed " << seed;
    EXPECT_GE(view.precision(), 0.97) << "seed " << seed;
    EXPECT_GE(view.recall(), 0.95) << "seed " << seed;
    EXPECT_LT(view.error().head<3>().norm(), 0.35) << "seed " << seed;
    EXPECT_LT(view.error().tail<3>().norm(), 0.1) << "seed " << seed;
    std::printf("seed %d: first pose %.2f s, precision %.4f, recall %.4f\n", static_cast<int>(seed),
                to_seconds(view.first_pose()->time_since_epoch()), view.precision(), view.recall());
  }
}

INSTANTIATE_TEST_SUITE_P(Nuisances, Among,
                         testing::Values(Nuisance::kCrowd, Nuisance::kFlicker, Nuisance::kFloor));

}  // namespace
}  // namespace crepes::false_bearings_test
