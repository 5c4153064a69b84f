#include "drivers/imu/witmotion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "estimator/core/constants.hpp"
#include "tests/support/frame_damage.hpp"
#include "tests/support/recorded_files.hpp"
#include "tests/support/recorded_frames.hpp"

namespace crepes::witmotion_test {
namespace {

using namespace std::chrono_literals;

constexpr Timestamp kArrival{7s};
constexpr std::ptrdiff_t kHalf = WitMotion::kMaxFrame / 2;

std::vector<ImuSample> samples_in(WitMotionParser& parser, Bytes stream) {
  std::vector<ImuSample> samples;
  for (const auto& frame : decode<WitMotionParser>(stream))
    parser.parse(frame, kArrival, [&](const ImuSample& sample) { samples.push_back(sample); });
  return samples;
}

/// Frame k of the recording.
std::vector<std::uint8_t> recorded_half(std::ptrdiff_t k) {
  const auto all = recorded_witmotion();
  return {all.begin() + kHalf * k, all.begin() + kHalf * (k + 1)};
}

TEST(WitMotion, ReadsARecordingInSiUnits) {
  WitMotionParser parser;

  const auto samples = samples_in(parser, recorded_witmotion());

  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].stamp, kArrival);
  EXPECT_NEAR(samples[0].accel_mps2.x(), 0.00048828125 * kGravityMps2, 1e-12);
  EXPECT_NEAR(samples[0].accel_mps2.y(), -0.0009765625 * kGravityMps2, 1e-12);
  EXPECT_NEAR(samples[0].accel_mps2.z(), kGravityMps2, 1e-12);
  EXPECT_NEAR(samples[1].gyro_radps.z(), radians(-0.06103515625), 1e-12);
  EXPECT_EQ(parser.counts().partial, 0U);
}

TEST(WitMotion, NeverPairsHalvesOfTwoSamples) {
  WitMotionParser parser;
  const auto broken = [](std::vector<std::uint8_t> half) {
    half[5] ^= 0x10U;
    return half;
  };
  const auto acceleration = recorded_half(0);
  const auto rate = recorded_half(1);
  const auto angle = recorded_half(2);
  EXPECT_TRUE(samples_in(parser, rate + angle).empty());
  EXPECT_TRUE(samples_in(parser, acceleration + angle + rate).empty());
  EXPECT_EQ(parser.counts().partial, 3U);
  EXPECT_TRUE(
      samples_in(parser, acceleration + broken(rate) + broken(acceleration) + rate).empty());
  EXPECT_EQ(parser.counts().partial, 5U);
}

/// Every end that a sample can lose, with 256 different sums: some are right by chance.
TEST(WitMotion, NeverTakesTheNextSampleForTheEndOfOne) {
  WitMotionParser parser;
  for (int k = 0; k < 256; ++k) {
    const auto sample = encode_witmotion({0.01 * k, 1.0, -0.5}, {0.1, 0.05 * k, 9.8});
    for (std::ptrdiff_t length = 0; length < 2 * kHalf; ++length) {
      std::vector<std::uint8_t> stream(sample.begin(), sample.begin() + length);
      stream.insert(stream.end(), sample.begin(), sample.end());

      const auto samples = samples_in(parser, stream);

      // The next sample's first byte can be the very checksum that is missing.
      const bool is_whole_but_for_its_sum = length % kHalf == kHalf - 1;
      if (is_whole_but_for_its_sum && samples.empty()) continue;
      ASSERT_EQ(samples.size(), 1U) << length;
      ASSERT_NEAR(samples[0].gyro_radps.x(), 0.01 * k, 1e-3) << length;
      ASSERT_NEAR(samples[0].gyro_radps.y(), 1.0, 1e-3) << length;
      ASSERT_NEAR(samples[0].accel_mps2.y(), 0.05 * k, 1e-2) << length;
    }
  }
}

TEST(WitMotion, RefusesSaturatedAndDeadSensors) {
  WitMotionParser parser;
  const Eigen::Vector3d up(0.0, 0.0, 9.81);

  EXPECT_TRUE(samples_in(parser, encode_witmotion({40.0, 0.0, 0.0}, up)).empty());
  EXPECT_TRUE(samples_in(parser, encode_witmotion({0.0, 0.0, 0.0}, {0.0, -200.0, 9.8})).empty());
  EXPECT_EQ(parser.counts().saturated, 2U);
  EXPECT_TRUE(samples_in(parser, encode_witmotion({0.1, 0.0, 0.0}, {0.0, 0.0, 0.0})).empty());
  EXPECT_EQ(parser.counts().implausible, 1U);
}

TEST(WitMotion, RefusesEveryTruncationSplitAndBitErrorOfFramesThatAreNoSamples) {
  expect_refuses_damage<WitMotionParser>(recorded_half(2));
  expect_refuses_damage<WitMotionParser>(recorded_half(3));
}

TEST(WitMotion, GivesNothingButTheSamplesThatWereSentWhateverBitIsWrong) {
  const auto good = recorded_half(0) + recorded_half(1);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    WitMotionParser parser;

    const auto samples = samples_in(parser, good + bad + good + recorded_half(2));

    ASSERT_EQ(samples.size(), 2U) << bit;
    EXPECT_EQ(samples[0].accel_mps2, samples[1].accel_mps2) << bit;
    EXPECT_EQ(samples[0].gyro_radps, samples[1].gyro_radps) << bit;
  }
}

TEST(WitMotion, EncodesWhatItDecodesToHalfAStep) {
  EXPECT_TRUE(rc::check([] {
    const auto axis = [](double scale) { return *rc::gen::inRange(-1000, 1000) * scale; };
    const Eigen::Vector3d gyro(axis(0.03), axis(0.03), axis(0.03));
    const Eigen::Vector3d accel(axis(0.15), axis(0.15), 5.0);
    WitMotionParser parser;
    const auto samples = samples_in(parser, encode_witmotion(gyro, accel));
    RC_ASSERT(samples.size() == 1U);
    RC_ASSERT((samples[0].gyro_radps - gyro).cwiseAbs().maxCoeff() < 0.51 * 2000 / 57.29 / 32768);
    RC_ASSERT((samples[0].accel_mps2 - accel).cwiseAbs().maxCoeff() < 0.51 * 157 / 32768);
  }));
}

std::vector<std::uint8_t> ble_packet() { return recorded_file("imu/witmotion_ble_built").bytes; }

TEST(WitMotionBle, ReadsAPacketInSiUnits) {
  const RecordedFrame file = recorded_file("imu/witmotion_ble_built");
  ASSERT_EQ(WitMotionBle::examine(file.bytes).length, 20U);

  const ImuReading reading = WitMotionBle::read(file.bytes);

  EXPECT_EQ(reading.verdict, ImuVerdict::kSample);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(reading.accel_mps2[axis],
                file.decoded["acc_raw"][axis].get<double>() / 2048.0 * kGravityMps2, 1e-12);
    EXPECT_NEAR(reading.gyro_radps[axis],
                radians(file.decoded["gyro_raw"][axis].get<double>() * 2000.0 / 32768.0), 1e-12);
  }
}

TEST(WitMotionBle, GivesNothingButWholePacketsWhateverIsMissing) {
  const auto good = ble_packet();
  for (std::size_t from = 0; from < good.size(); ++from) {
    for (std::size_t to = from + 1; to <= good.size(); ++to) {
      auto torn = good;
      torn.erase(torn.begin() + static_cast<std::ptrdiff_t>(from),
                 torn.begin() + static_cast<std::ptrdiff_t>(to));
      const Frames frames = decode<WitMotionBleParser>(good + torn + good + good);
      ASSERT_EQ(frames, (Frames{good, good, good})) << from << " " << to;
    }
  }
}

TEST(WitMotionBle, IsTheSameInEveryPiece) {
  auto turned = ble_packet();
  turned.back() = 0x55;  // as another packet begins
  for (const auto& packet : {ble_packet(), turned}) {
    for (std::size_t chunk = 1; chunk <= 21; ++chunk)
      EXPECT_EQ(decode<WitMotionBleParser>(packet + packet + ble_packet(), chunk),
                (Frames{packet, packet, ble_packet()}))
          << chunk;
  }
}

TEST(WitMotionBle, PassesByAnswersAndRefusesTheEndOfTheRange) {
  auto answer = ble_packet();
  answer[1] = 0x71;
  EXPECT_EQ(WitMotionBle::examine(answer).kind, FrameKind::kComplete);
  EXPECT_EQ(WitMotionBle::read(answer).verdict, ImuVerdict::kOther);

  auto full = ble_packet();
  full[8] = 0xff;
  full[9] = 0x7f;
  EXPECT_EQ(WitMotionBle::read(full).verdict, ImuVerdict::kSaturated);
}

}  // namespace
}  // namespace crepes::witmotion_test
