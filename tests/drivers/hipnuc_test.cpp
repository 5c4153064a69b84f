#include "drivers/imu/hipnuc.hpp"

#include <gtest/gtest.h>

#include "estimator/core/constants.hpp"
#include "tests/support/imu_readings.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::hipnuc_test {
namespace {

using namespace std::chrono_literals;
using test::expect_sample;
using test::expect_time;
using test::samples_in;
using test::vector_of;

TEST(Hipnuc, ReadsTheRecordedFrameInSiUnits) {
  const RecordedFrame file = recorded_file("imu/hipnuc_hi91_official");

  ASSERT_EQ(Hipnuc::examine(file.bytes).length, file.bytes.size());
  expect_sample(Hipnuc::read(file.bytes), vector_of(file.decoded["gyro_dps"]) * radians(1.0),
                vector_of(file.decoded["acc_g"]) * 9.8);
}

TEST(Hipnuc, ReadsThePacketOfSensorsWithGnss) {
  const RecordedFrame file = recorded_file("imu/hipnuc_hi81_built");

  ASSERT_EQ(Hipnuc::examine(file.bytes).length, file.bytes.size());
  const ImuReading reading = Hipnuc::read(file.bytes);
  expect_sample(reading, vector_of(file.decoded["gyro_rads"]), vector_of(file.decoded["acc_mps2"]));
  EXPECT_FALSE(reading.time);
}

TEST(Hipnuc, ReadsTheFramesThatTheMakerPublishesWithTheirMeaning) {
  for (const char* name : {"hi91", "hi81", "hi83"}) {
    const RecordedFrame file = recorded_file("imu/hipnuc_" + std::string(name) + "_published");

    ASSERT_EQ(Hipnuc::examine(file.bytes).length, file.bytes.size()) << name;
    const ImuReading reading = Hipnuc::read(file.bytes);
    EXPECT_EQ(reading.verdict, ImuVerdict::kSample) << name;
    EXPECT_LT((reading.gyro_radps - vector_of(file.decoded["gyro_radps"])).norm(), 1e-6) << name;
    // The maker prints the step of HI81 with five digits.
    EXPECT_LT((reading.accel_mps2 - vector_of(file.decoded["acc_mps2"])).norm(), 3e-5) << name;
  }
  const RecordedFrame hi83 = recorded_file("imu/hipnuc_hi83_published");
  expect_time(Hipnuc::read(hi83.bytes), hi83.decoded["time_us"].get<std::uint64_t>(), 1us);
}

TEST(Hipnuc, RefusesEveryTruncationSplitAndBitError) {
  for (const char* name : {"hi91_official", "hi81_built", "hi83_published"})
    expect_refuses_damage<HipnucParser>(recorded_file("imu/hipnuc_" + std::string(name)).bytes);
}

/// A frame with these fields of HI83 and this status; the checksum is not set.
std::vector<std::uint8_t> hi83_frame(std::uint32_t bitmap, std::size_t field_bytes,
                                     std::uint8_t status = 0) {
  std::vector<std::uint8_t> frame(6 + 8 + field_bytes, 0);
  frame[6] = 0x83;
  frame[7] = status;
  for (std::size_t i = 0; i < 4; ++i)
    frame[10 + i] = static_cast<std::uint8_t>(bitmap >> (8 * i) & 0xffU);
  for (std::size_t at = 14 + 3; at < frame.size(); at += 4) frame[at] = 0x40;  // each number 2.0
  return frame;
}

TEST(Hipnuc, FindsTheTimeOfHi83BehindWhicheverFieldsAreThere) {
  for (const auto& [bitmap, before] : {std::pair{0x23U, 24U}, {0x27U, 36U}, {0x33U, 40U}}) {
    auto frame = hi83_frame(bitmap, before + 8);
    for (std::size_t i = 0; i < 8; ++i) frame[14 + before + i] = 0;
    frame[14 + before] = 77;

    const ImuReading reading = Hipnuc::read(frame);
    expect_sample(reading, {2, 2, 2}, {2, 2, 2});
    expect_time(reading, 77, 1us);
  }
  EXPECT_FALSE(Hipnuc::read(hi83_frame(0x03, 24)).time);
}

TEST(Hipnuc, CountsHi83AtTheEndOfTheRange) {
  for (const std::uint8_t status : {std::uint8_t{0x20}, std::uint8_t{0x40}})
    EXPECT_EQ(Hipnuc::read(hi83_frame(0x03, 24, status)).verdict, ImuVerdict::kSaturated);
  EXPECT_EQ(Hipnuc::read(hi83_frame(0x03, 24, 0x9f)).verdict, ImuVerdict::kSample);
}

TEST(Hipnuc, NamesWhatHasNoSample) {
  const auto frame_of = [](std::uint8_t tag, std::size_t length) {
    std::vector<std::uint8_t> frame(6 + length, 0);
    frame[6] = tag;
    return frame;
  };
  const std::vector<std::pair<std::vector<std::uint8_t>, std::string>> cases{
      {hi83_frame(0x08, 12), "HI83 without acc_b and gyr_b"},
      {hi83_frame(0x22, 20), "HI83 without one of acc_b and gyr_b"},
      {hi83_frame(0x23, 28), "HI83 of another length"},  // the time of four bytes
      {hi83_frame(0x02000003, 64), "fields that are not published"},
      {frame_of(0x83, 7), "HI83 that is cut short"},
      {frame_of(0x92, 42), "HI92"},
      {frame_of(0x91, 75), "HI91 of another length"},
      {frame_of(0x81, 20), "HI81 that is cut short"},
      {frame_of(0xb0, 7), "old items of HI226 and HI229"},
      {frame_of(0x62, 80), "wireless receiver"},
      {frame_of(0x01, 4), "a packet that is not known"}};
  for (const auto& [frame, name] : cases) {
    HipnucParser parser;
    parser.parse(frame, {}, [&](const ImuSample&) { ADD_FAILURE() << name; });
    EXPECT_NE(parser.no_measurement_reason().find("the sensor sends "), std::string::npos) << name;
    EXPECT_NE(parser.no_measurement_reason().find(name), std::string::npos)
        << parser.no_measurement_reason();
    EXPECT_EQ(parser.counts().partial, name == "HI83 without one of acc_b and gyr_b" ? 1U : 0U);
  }
}

}  // namespace
}  // namespace crepes::hipnuc_test
