/// What a message carries, how exactly, and what it leaves out to keep to its size.
#include "net/mesh/peer_message.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <ranges>
#include <set>
#include <vector>

#include "estimator/core/pose.hpp"
#include "net/mesh/mesh_counters.hpp"
#include "net/mesh/wire_codes.hpp"
#include "tests/net/mesh/full_peer_message.hpp"

namespace crepes::peer_message_test {
namespace {

using std::chrono::milliseconds;
using test::full_message;
using test::kSent;
using test::random_vector;

TEST(PeerMessage, CarriesTheReportsOfFourRobotsWithRedundancy) {
  const OutgoingPeerMessage message = full_message(3);

  const auto encoded = encode_peer_message(message);
  const auto decoded = decode_peer_message(encoded.bytes);

  ASSERT_TRUE(decoded.has_value()) << name_of(counter_of(decoded.error()));
  EXPECT_LE(encoded.bytes.size(), kMaxPeerMessage);
  EXPECT_EQ(encoded.refused, 0U);
  const PeerReport& report = decoded->report;
  EXPECT_EQ(report.sender, RobotId{1});
  EXPECT_EQ(decoded->session, 77U);
  EXPECT_EQ(to_ns(decoded->sent), to_ns(kSent));
  EXPECT_EQ(decoded->echoes.size(), 3U);
  EXPECT_EQ(report.imu.size(), 20U);
  EXPECT_EQ(report.estimates.size(), 1U);
  EXPECT_EQ(report.bearings.size(), 18U);  // six of each neighbor
  EXPECT_EQ(report.ranges.size(), 18U);
}

TEST(PeerMessage, LeavesOutTheOldestCopiesFirst) {
  const OutgoingPeerMessage message = full_message(3);
  const auto decoded =
      decode_peer_message(encode_peer_message(message, {.bytes = 500, .copies = 6}).bytes);

  ASSERT_TRUE(decoded.has_value());
  std::set<RobotId> seen;
  std::size_t newest = 0;
  for (const auto& bearing : decoded->report.bearings) {
    seen.insert(bearing.neighbor);
    newest += to_ns(bearing.stamp) > to_ns(kSent - milliseconds{1}) ? 1 : 0;
  }
  EXPECT_EQ(seen.size(), 3U);
  EXPECT_EQ(newest, 3U);
  EXPECT_LT(decoded->report.bearings.size(), 18U);
}

TEST(PeerMessage, ThinsOutEvenlyWhatADatagramHasOfSeveralReports) {
  constexpr int kNeighbors = 8;
  OutgoingPeerMessage message = full_message(kNeighbors);
  message.report.bearings.clear();
  message.report.ranges.clear();
  message.report.imu.resize(4);
  const auto ago = [](int reports) { return kSent - milliseconds{40 * reports + 3}; };
  for (int i = 0; i < 13; ++i) {
    for (int n = 0; n < kNeighbors; ++n) {
      const RobotId neighbor{static_cast<std::uint16_t>(n + 2)};
      message.report.bearings.push_back(
          {ago(i), neighbor, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero(), 1e-3});
      message.report.ranges.push_back({ago(i), neighbor, 3.0, -80.0, -79.0});
    }
  }
  const auto ages_of = [&](std::size_t bytes) {
    const auto decoded = decode_peer_message(
        encode_peer_message(
            message, {.bytes = bytes, .copies = 2, .period = milliseconds{200}, .reports = 5})
            .bytes);
    std::map<RobotId, std::vector<int>> ages;  // reports
    for (const auto& bearing : decoded->report.bearings)
      ages[bearing.neighbor].push_back(
          static_cast<int>((to_ns(kSent) - to_ns(bearing.stamp)) / 40'000'000));
    return ages;
  };
  const auto expect_for_all = [&](std::size_t bytes, const std::vector<int>& expected) {
    const auto ages = ages_of(bytes);
    EXPECT_EQ(ages.size(), std::size_t{kNeighbors});
    for (const auto& [neighbor, reports] : ages) EXPECT_EQ(reports, expected) << bytes;
  };

  expect_for_all(1400, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  const std::size_t least = 320 + 8 * 14;
  std::set<std::vector<int>> seen;
  for (std::size_t bytes = least; bytes < 1000; bytes += 10) {
    const auto ages = ages_of(bytes);
    ASSERT_EQ(ages.size(), std::size_t{kNeighbors}) << bytes;
    seen.insert(ages.begin()->second);
  }
  EXPECT_TRUE(seen.contains({0, 2, 4, 6, 8}));
  EXPECT_TRUE(seen.contains({0, 4, 8}) || seen.contains({0, 3, 6, 9}));
  EXPECT_FALSE(seen.contains({0, 1, 2, 3, 4}));
}

TEST(PeerMessage, KeepsToItsLimitWithFiftyNeighborsAndReportsThemInTurn) {
  constexpr int kNeighbors = 50;
  constexpr std::size_t kLimit = 500;
  std::set<RobotId> echoed;
  std::set<RobotId> estimated;
  std::map<RobotId, int> seen;
  std::map<RobotId, int> ranged;
  for (std::uint32_t sequence = 0; sequence < kNeighbors; ++sequence) {
    OutgoingPeerMessage message = full_message(kNeighbors);
    message.sequence = sequence;

    const auto encoded = encode_peer_message(message, {.bytes = kLimit, .copies = 3});
    const auto decoded = decode_peer_message(encoded.bytes);

    ASSERT_TRUE(decoded.has_value());
    ASSERT_LE(encoded.bytes.size(), kLimit);
    EXPECT_GT(encoded.left_out, 0U);
    EXPECT_GE(decoded->report.imu.size(), 4U);
    for (const auto& echo : decoded->echoes) echoed.insert(echo.peer);
    for (const auto& estimate : decoded->report.estimates) estimated.insert(estimate.neighbor);
    for (const auto& bearing : decoded->report.bearings) ++seen[bearing.neighbor];
    for (const auto& range : decoded->report.ranges) ++ranged[range.neighbor];
  }

  EXPECT_EQ(echoed.size(), std::size_t{kNeighbors});
  EXPECT_EQ(estimated.size(), std::size_t{kNeighbors});
  for (const auto& counts : {seen, ranged}) {
    ASSERT_EQ(counts.size(), std::size_t{kNeighbors});
    const auto [least, most] = std::ranges::minmax(counts | std::views::values);
    EXPECT_GE(2 * least, most) << "evenly";
  }
}

TEST(PeerMessage, MarkedDatagramsEchoAllPeersByTurnsOfTheirOwn) {
  constexpr std::uint32_t kMark = 6;
  constexpr int kNeighbors = 12;
  std::set<RobotId> echoed;
  for (std::uint32_t sequence = 0; sequence < 4 * kMark; sequence += kMark) {
    OutgoingPeerMessage message = full_message(kNeighbors);
    message.sequence = sequence;
    message.mark = kMark;
    message.echoes.front().is_direct = false;

    const auto decoded =
        decode_peer_message(encode_peer_message(message, {.reports = kMark}).bytes);

    ASSERT_TRUE(decoded.has_value());
    EXPECT_EQ(decoded->mark, kMark);
    for (const auto& echo : decoded->echoes) {
      echoed.insert(echo.peer);
      EXPECT_EQ(echo.is_direct, echo.peer != RobotId{2});
    }
  }
  EXPECT_EQ(echoed.size(), std::size_t{kNeighbors});
}

TEST(PeerMessage, HasAFewHundredBytesForSmoothMotion) {
  OutgoingPeerMessage message = full_message(4);
  std::mt19937 random(5);
  for (std::size_t i = 0; i < message.report.imu.size(); ++i) {
    const double t = 0.01 * static_cast<double>(i);
    message.report.imu[i].gyro_radps =
        Eigen::Vector3d(std::sin(6 * t), std::cos(5 * t), 0.5) + random_vector(random, 2e-3);
    message.report.imu[i].accel_mps2 =
        Eigen::Vector3d(2 * std::sin(4 * t), 0, 9.8) + random_vector(random, 2e-2);
  }
  for (std::size_t i = 0; i < message.report.bearings.size(); ++i) {
    const double t = 0.005 * static_cast<double>(i % 20);
    message.report.bearings[i].u_B =
        (Eigen::Vector3d(std::cos(2 * t), std::sin(2 * t), 0.2) + random_vector(random, 7e-4))
            .normalized();
  }
  message.report.estimates.clear();

  const std::size_t bytes = encode_peer_message(message, {.copies = 3}).bytes.size();

  EXPECT_LT(bytes, 300U);  // version 1 had 880
}

TEST(PeerMessage, DecodesToWhatWasEncodedWithinItsResolution) {
  EXPECT_TRUE(rc::check([] {
    const OutgoingPeerMessage message =
        full_message(2, *rc::gen::inRange<std::uint32_t>(1, 1'000'000));
    const auto decoded = decode_peer_message(encode_peer_message(message).bytes);
    RC_ASSERT(decoded.has_value());
    const Report& in = message.report;
    const PeerReport& out = decoded->report;

    RC_ASSERT(std::abs(to_ns(out.stamp) - to_ns(in.stamp)) <= 5'000);
    RC_ASSERT((out.tilt.up_B - in.tilt.up_B).norm() < 1.5e-4);
    for (std::size_t i = 0; i < out.imu.size(); ++i) {
      const ImuSample& sent = in.imu[out.imu.size() - 1 - i];  // newest first
      RC_ASSERT(std::abs(to_ns(out.imu[i].stamp) - to_ns(sent.stamp)) <= 5'000);
      RC_ASSERT((out.imu[i].gyro_radps - sent.gyro_radps).norm() < 9e-4);
      RC_ASSERT((out.imu[i].accel_mps2 - sent.accel_mps2).norm() < 7e-3);
    }
    for (const auto& b : out.bearings) {
      const auto original =
          std::find_if(in.bearings.begin(), in.bearings.end(), [&](const Bearing& candidate) {
            return candidate.neighbor == b.neighbor &&
                   std::abs(to_ns(candidate.stamp) - to_ns(b.stamp)) <= 5'000;
          });
      RC_ASSERT(original != in.bearings.end());
      RC_ASSERT((b.u_B - original->u_B).norm() < 1.5e-4);
      RC_ASSERT((b.p_B_C - original->p_B_C).norm() < 3e-5);
      RC_ASSERT(std::abs(b.sigma_rad / original->sigma_rad - 1) < 0.05);
    }
    for (const auto& r : out.ranges) RC_ASSERT(std::abs(r.range_m - 1.0 - r.neighbor.value) < 1e-3);
    RC_ASSERT(out.estimates.size() == 1U);
    const NeighborEstimate& original = in.estimates.at(out.estimates[0].neighbor.value - 2U);
    const Pose& a = original.T_B_N.pose;
    const Pose& b = out.estimates[0].T_B_N.pose;
    RC_ASSERT(pose_difference(a, b).norm() < 2e-4);
    RC_ASSERT((out.estimates[0].v_B_N - original.v_B_N).norm() < 1e-3);
    const Matrix6d& P = original.T_B_N.covariance;
    RC_ASSERT((out.estimates[0].T_B_N.covariance - P).norm() < 6e-3 * P.norm());
  }));
}

TEST(PeerMessage, KeepsTheStampInEveryCopyOfAMeasurement) {
  EXPECT_TRUE(rc::check([] {
    OutgoingPeerMessage message = full_message(1);
    const Duration later{*rc::gen::inRange<std::int64_t>(0, 100'000'000)};
    const auto first = decode_peer_message(encode_peer_message(message).bytes);
    message.sent += later;
    const auto second = decode_peer_message(encode_peer_message(message).bytes);
    RC_ASSERT(first && second);
    RC_ASSERT(first->report.imu.front().stamp == second->report.imu.front().stamp);
    RC_ASSERT(first->report.bearings.front().stamp == second->report.bearings.front().stamp);
  }));
}

TEST(PeerMessage, KeepsCovariancesPositiveHoweverCorrelated) {
  EXPECT_TRUE(rc::check([] {
    std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
    const Eigen::Vector3d a = random_vector(random, 1);
    Vector6d direction;
    direction << a, random_vector(random, 1);
    const Matrix6d P = direction * direction.transpose() + 1e-4 * Matrix6d::Identity();
    const auto code = encode_covariance(P);
    RC_ASSERT(code.has_value());
    const Matrix6d decoded = *decode_covariance(*code);
    RC_ASSERT(Eigen::SelfAdjointEigenSolver<Matrix6d>(decoded).eigenvalues().minCoeff() > 0);
    RC_ASSERT((decoded - P).norm() < 6e-3 * P.norm());
  }));
}

TEST(PeerMessage, OmitsAndCountsWhatCannotBeEncoded) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  OutgoingPeerMessage message = full_message(1, 1, 2);
  constexpr WireLimits kLimits{.copies = 8};
  const auto fine = encode_peer_message(message, kLimits);
  message.report.imu[0].gyro_radps.x() = kNan;
  message.report.bearings[0].u_B = Eigen::Vector3d::Zero();
  message.report.ranges[0].range_m = -1.0;
  message.report.estimates[0].T_B_N.covariance.setZero();
  message.report.tilt.sigma_rad = kNan;

  const auto encoded = encode_peer_message(message, kLimits);
  const auto decoded = decode_peer_message(encoded.bytes);

  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(encoded.refused, 4U);
  EXPECT_EQ(fine.refused, 0U);
  EXPECT_EQ(decoded->report.bearings.size(), 1U);
  EXPECT_EQ(decoded->report.ranges.size(), 7U);
  EXPECT_TRUE(decoded->report.estimates.empty());
  EXPECT_GT(decoded->report.tilt.sigma_rad, 3.0);  // unknown
}

}  // namespace
}  // namespace crepes::peer_message_test
