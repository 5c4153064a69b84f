#include "drivers/imu/witmotion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/support/frame_damage.hpp"
#include "tests/support/recorded_files.hpp"
#include "tests/support/recorded_frames.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

/// Frame k of the bytes arrives at k * `spacing`.
std::vector<ImuSample> samples_in(WitMotionParser& parser, Bytes bytes, Duration spacing = 1ms) {
  std::vector<ImuSample> samples;
  Timestamp arrival{};
  for (std::size_t at = 0; at < bytes.size(); at += WitMotionParser::kMaxFrame) {
    const Bytes frame = bytes.subspan(at, WitMotionParser::kMaxFrame);
    EXPECT_EQ(WitMotionParser::examine(frame).kind, FrameKind::kComplete);
    parser.parse(frame, arrival, [&](const ImuSample& sample) { samples.push_back(sample); });
    arrival += spacing;
  }
  return samples;
}

TEST(WitMotion, ReadsARecordingInSiUnits) {
  WitMotionParser parser;

  const auto samples = samples_in(parser, recorded_witmotion());

  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].stamp, Timestamp{1ms});
  EXPECT_NEAR(samples[0].accel_mps2.x(), 0.00048828125 * 9.80665, 1e-12);
  EXPECT_NEAR(samples[0].accel_mps2.y(), -0.0009765625 * 9.80665, 1e-12);
  EXPECT_NEAR(samples[0].accel_mps2.z(), 9.80665, 1e-12);
  EXPECT_NEAR(samples[1].gyro_radps.z(), -0.06103515625 * M_PI / 180.0, 1e-12);
  EXPECT_EQ(parser.counts().partial, 0U);
}

TEST(WitMotion, NeverPairsHalvesOfTwoSamples) {
  const auto all = recorded_witmotion();
  const auto frame = [&](std::size_t k) {
    return std::vector<std::uint8_t>(all.begin() + static_cast<std::ptrdiff_t>(11 * k),
                                     all.begin() + static_cast<std::ptrdiff_t>(11 * k + 11));
  };
  WitMotionParser parser;
  EXPECT_TRUE(samples_in(parser, frame(1)).empty());                        // rate alone
  EXPECT_TRUE(samples_in(parser, frame(0) + frame(2) + frame(5)).empty());  // angle in between
  EXPECT_TRUE(samples_in(parser, frame(0) + frame(5), 10ms).empty());       // a period apart
  EXPECT_EQ(parser.counts().partial, 3U);
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

TEST(WitMotion, RefusesEveryTruncationSplitAndBitErrorOfEveryRecordedFrame) {
  const auto all = recorded_file("imu/witmotion_hwt905_real").bytes;
  for (auto at = all.begin(); at != all.end(); at += WitMotionParser::kMaxFrame)
    expect_refuses_damage<WitMotionParser>({at, at + WitMotionParser::kMaxFrame});
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

}  // namespace
}  // namespace crepes
