#include "net/mesh/peer_message.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <ranges>
#include <set>

#include "net/mesh/crc32.hpp"
#include "net/mesh/mesh_counters.hpp"
#include "net/mesh/peer_message_code.hpp"
#include "net/mesh/wire_codes.hpp"

namespace crepes::peer_message_test {
namespace {

using std::chrono::milliseconds;

constexpr Timestamp kSent{Duration{993'638'158'694'177}};

Eigen::Vector3d random_vector(std::mt19937& random, double scale) {
  std::normal_distribution<double> normal(0, scale);
  return {normal(random), normal(random), normal(random)};
}

Matrix6d random_covariance(std::mt19937& random) {
  Matrix6d A;
  std::normal_distribution<double> normal(0, 1);
  for (double& v : A.reshaped()) v = normal(random);
  const Vector6d scale{0.1, 0.2, 0.05, 0.01, 0.02, 0.03};
  return scale.asDiagonal() * Matrix6d(A * A.transpose() + 0.1 * Matrix6d::Identity()) *
         scale.asDiagonal();
}

/// The full report of a robot with `neighbors`: 200 ms of 100 Hz IMU, 160 ms of 50 Hz ranges, and
/// bearings from a 200 Hz camera. All of it is noise, which no code shortens.
OutgoingPeerMessage full_message(int neighbors, std::uint32_t seed = 1, int bearing_frames = 20) {
  std::mt19937 random(seed);
  OutgoingPeerMessage message;
  message.sent = kSent;
  message.session = 77;
  message.sequence = seed;
  Report& report = message.report;
  report.sender = RobotId{1};
  report.stamp = kSent - milliseconds{2};
  report.tilt = {kSent - milliseconds{3}, random_vector(random, 1).normalized(), 0.01};
  for (int i = 0; i < 20; ++i)
    report.imu.push_back({kSent - milliseconds{10 * i}, random_vector(random, 1.5),
                          Eigen::Vector3d(0, 0, 9.81) + random_vector(random, 2)});
  for (int n = 0; n < neighbors; ++n) {
    const RobotId neighbor{static_cast<std::uint16_t>(n + 2)};
    message.echoes.push_back(
        {neighbor, 1'000'000U + static_cast<unsigned>(n), to_ns(kSent) - 40'000'000, 0.1});
    for (int i = 0; i < bearing_frames; ++i)
      report.bearings.push_back({kSent - milliseconds{5 * i},
                                 neighbor,
                                 random_vector(random, 1).normalized(),
                                 {0.06, 0.0, 0.04},
                                 7e-4});
    for (int i = 0; i < 8; ++i)
      report.ranges.push_back(
          {kSent - milliseconds{20 * i + n % 7}, neighbor, 3.0 + n, -81.5, -78.0});
    NeighborEstimate estimate;
    estimate.stamp = kSent - milliseconds{4};
    estimate.neighbor = neighbor;
    estimate.T_B_N.pose = {random_vector(random, 5), so3_exp(random_vector(random, 1))};
    estimate.T_B_N.covariance = random_covariance(random);
    estimate.v_B_N = random_vector(random, 1);
    report.estimates.push_back(estimate);
  }
  return message;
}

std::vector<std::uint8_t> resealed(std::vector<std::uint8_t> body) {
  const std::uint32_t sum = crc32(body);
  for (int i = 0; i < 4; ++i) body.push_back(static_cast<std::uint8_t>(sum >> (8 * i)));
  return body;
}

std::vector<std::uint8_t> body_of(const OutgoingPeerMessage& message) {
  auto bytes = encode_peer_message(message).bytes;
  bytes.resize(bytes.size() - 4);
  return bytes;
}

PeerMessageError fault_of(std::span<const std::uint8_t> bytes) {
  const auto message = decode_peer_message(bytes);
  EXPECT_FALSE(message.has_value());
  return message ? PeerMessageError{} : message.error();
}

bool is_finite(const PeerMessage& message) {
  const auto& report = message.report;
  const auto all = [](const auto& items, auto finite) {
    return std::all_of(items.begin(), items.end(), finite);
  };
  return report.tilt.up_B.allFinite() && std::isfinite(report.tilt.sigma_rad) &&
         all(report.imu,
             [](const auto& s) { return s.gyro_radps.allFinite() && s.accel_mps2.allFinite(); }) &&
         all(report.bearings,
             [](const auto& b) {
               return b.u_B.allFinite() && b.p_B_C.allFinite() && b.sigma_rad > 0 &&
                      b.neighbor.value > 0;
             }) &&
         all(report.ranges, [](const auto& r) { return std::isfinite(r.range_m); }) &&
         all(report.estimates, [](const auto& e) {
           return e.T_B_N.pose.p.allFinite() && e.T_B_N.pose.q.coeffs().allFinite() &&
                  e.T_B_N.covariance.allFinite() && e.v_B_N.allFinite();
         });
}

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

TEST(PeerMessage, RefusesEveryTruncation) {
  const auto bytes = encode_peer_message(full_message(3)).bytes;

  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_peer_message(std::span(bytes).first(size)).has_value()) << size;
}

TEST(PeerMessage, RefusesEveryDamagedByte) {
  const auto bytes = encode_peer_message(full_message(3)).bytes;

  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (const int flip : {0x01, 0x80, 0xFF}) {
      auto damaged = bytes;
      damaged[i] ^= static_cast<std::uint8_t>(flip);
      EXPECT_FALSE(decode_peer_message(damaged).has_value()) << i;
    }
}

TEST(PeerMessage, DecodesToFiniteValuesOrNotAtAllWhateverASenderSeals) {
  const auto body = body_of(full_message(3));

  for (std::size_t i = 0; i < body.size(); ++i)
    for (const int value : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
      auto odd = body;
      odd[i] = static_cast<std::uint8_t>(value);
      const auto message = decode_peer_message(resealed(odd));
      EXPECT_TRUE(!message || is_finite(*message)) << i;
    }
  for (std::size_t size = 4; size < body.size(); ++size)
    EXPECT_FALSE(decode_peer_message(resealed({body.begin(), body.begin() + long(size)})));
}

TEST(PeerMessage, SurvivesRandomBytesBehindAValidSeal) {
  EXPECT_TRUE(rc::check([] {
    auto body = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::arbitrary<std::uint8_t>());
    const std::vector<std::uint8_t> preamble{'C', 'R', 'P', 2, 2, 0};
    body.insert(body.begin(), preamble.begin(), preamble.end());
    const auto message = decode_peer_message(resealed(body));
    const bool is_sound = !message || is_finite(*message);  // RC_ASSERT's own || evaluates both
    RC_ASSERT(is_sound);
  }));
}

TEST(PeerMessage, ReturnsTheFirstError) {
  const auto body = body_of(full_message(1));
  const auto with = [&](std::size_t at, std::initializer_list<int> values) {
    auto odd = body;
    for (const int value : values) odd[at++] = static_cast<std::uint8_t>(value);
    return fault_of(resealed(odd));
  };
  auto longer = body;
  longer.push_back(0);

  EXPECT_EQ(fault_of({}), PeerMessageError::kTooShort);
  EXPECT_EQ(fault_of(std::vector<std::uint8_t>(1401)), PeerMessageError::kTooLong);
  EXPECT_EQ(fault_of(std::vector<std::uint8_t>(100)), PeerMessageError::kForeign);
  EXPECT_EQ(with(3, {1}), PeerMessageError::kOtherVersion);
  EXPECT_EQ(fault_of(body), PeerMessageError::kDamaged);
  EXPECT_EQ(fault_of(resealed({body.begin(), body.end() - 1})), PeerMessageError::kTruncated);
  EXPECT_EQ(fault_of(resealed(longer)), PeerMessageError::kTrailingBytes);
  EXPECT_EQ(with(4, {0, 0}), PeerMessageError::kBadId);
  EXPECT_EQ(with(25, {0x7F}), PeerMessageError::kBadStamp);
}

/// The fault of a datagram whose checksum is right.
PeerMessageError fault_of_code(wire::CodedBody body) {
  std::vector<std::uint8_t> bytes{'C', 'R', 'P', 2, 1, 0};
  bytes.resize(kClearHeader);
  wire::BodyWriter writer;
  wire::code_body(writer, body);
  const auto code = std::move(writer).finished();
  bytes.insert(bytes.end(), code.begin(), code.end());
  return fault_of(resealed(bytes));
}

TEST(PeerMessage, RefusesWhatNoEncoderWrites) {
  wire::CodedBody seen;
  seen.cameras = {{0, 0, 0}};
  seen.sources.push_back({2, {{.age = 0}}, {{.age = 0, .range_mm = 1000}}});
  const auto with = [&](auto change) {
    wire::CodedBody body = seen;
    change(body.sources.front());
    return fault_of_code(body);
  };
  wire::CodedEstimate estimate{.neighbor = 2};
  const auto with_estimate = [](const wire::CodedEstimate& code) {
    wire::CodedBody body;
    body.estimates.push_back(code);
    return fault_of_code(body);
  };

  EXPECT_EQ(with([](auto& s) { s.bearings[0].u = {16384, 0}; }), PeerMessageError::kNotUnit);
  EXPECT_EQ(with([](auto& s) {
              s.bearings.push_back({.u = {1 << 20, 0}});
            }),
            PeerMessageError::kNotUnit);
  EXPECT_EQ(with([](auto& s) { s.bearings.push_back({.sigma = 128}); }),
            PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.bearings[0].age = 200'000; }), PeerMessageError::kBadStamp);
  EXPECT_EQ(with([](auto& s) { s.ranges[0].range_mm = 0; }), PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.ranges[0].received = 256; }), PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.neighbor = 65535; }), PeerMessageError::kBadId);
  seen.cameras.clear();
  EXPECT_EQ(with([](auto&) {}), PeerMessageError::kBadIndex);

  wire::CodedBody moved;
  moved.imu = {.gyro_exponent = 30, .accel_exponent = 0, .predictions = {}, .samples = {{}}};
  EXPECT_EQ(fault_of_code(moved), PeerMessageError::kOutOfRange);
  moved.imu.gyro_exponent = 0;
  moved.imu.samples[0].values[0] = 1 << 30;
  EXPECT_EQ(fault_of_code(moved), PeerMessageError::kOutOfRange);

  estimate.q = {16383, 16383, 16383};
  EXPECT_EQ(with_estimate(estimate), PeerMessageError::kNotUnit);
  estimate.q = {};
  estimate.factor.fill(2047);
  EXPECT_EQ(with_estimate(estimate), PeerMessageError::kBadCovariance);
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
