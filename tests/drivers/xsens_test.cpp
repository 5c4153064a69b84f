#include "drivers/imu/xsens.hpp"

#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>

#include "tests/support/imu_readings.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::xsens_test {
namespace {

using namespace std::chrono_literals;
using test::expect_sample;
using test::samples_in;
using test::vector_of;

TEST(Xsens, ReadsTheRecordedMessage) {
  const RecordedFrame file = recorded_file("imu/xsens_mtdata2_accgyr");

  ASSERT_EQ(Xsens::examine(file.bytes).length, file.bytes.size());
  expect_sample(Xsens::read(file.bytes), vector_of(file.decoded["items"][3]["v"]),
                vector_of(file.decoded["items"][2]["v"]));
}

TEST(Xsens, PassesByMessagesWithoutSamples) {
  const auto bytes = recorded_file("imu/xsens_mtdata2_short").bytes;
  ASSERT_EQ(Xsens::examine(bytes).kind, FrameKind::kComplete);

  EXPECT_EQ(Xsens::read(bytes).verdict, ImuVerdict::kOther);
}

TEST(Xsens, RefusesEveryTruncationSplitAndBitError) {
  expect_refuses_damage<XsensParser>(recorded_file("imu/xsens_mtdata2_accgyr").bytes);
  expect_refuses_damage<XsensParser>(recorded_file("imu/xsens_mtdata2_short").bytes);
}

/// A message with these items, checksum included.
std::vector<std::uint8_t> xsens_message(const std::string& items, const std::string& bus = "ff",
                                        const std::string& kind = "36") {
  const auto payload = bytes_of(items);
  auto message = bytes_of("fa " + bus + " " + kind) +
                 std::vector<std::uint8_t>{static_cast<std::uint8_t>(payload.size())} + payload;
  unsigned sum = 0;
  for (std::size_t i = 1; i < message.size(); ++i) sum += message[i];
  message.push_back(static_cast<std::uint8_t>(0x100U - (sum & 0xffU)));
  return message;
}

TEST(Xsens, RefusesItemsThatEndWithoutTheMessage) {
  EXPECT_EQ(Xsens::examine(xsens_message("10 20 02 00 01")).kind, FrameKind::kComplete);
  EXPECT_EQ(Xsens::examine(xsens_message("10 20 02 00 01 e0")).kind, FrameKind::kNone);
  EXPECT_EQ(Xsens::examine(xsens_message("10 20 02 00 01 e0 20")).kind, FrameKind::kNone);
  EXPECT_EQ(Xsens::examine(xsens_message("10 20 09 00 01")).kind, FrameKind::kNone);
}

TEST(Xsens, ReadsEveryNumberFormat) {
  const auto fixed12_20 = xsens_message(
      "40 21 0c 00 10 00 00 00 20 00 00 00 9d 00 00 80 21 0c ff f0 00 00 00 08 00 00 00 00 00 00");
  expect_sample(Xsens::read(fixed12_20), {-1.0, 0.5, 0.0}, {1.0, 2.0, 9.8125});
  const auto fixed16_32 = xsens_message(
      "40 22 12 00 00 00 00 00 01 00 00 00 00 00 02 d0 00 00 00 00 09 "
      "80 22 12 00 00 00 00 ff ff 80 00 00 00 00 00 00 00 00 00 00 00");
  expect_sample(Xsens::read(fixed16_32), {-1.0, 0.5, 0.0}, {1.0, 2.0, 9.8125});
  const auto doubles = xsens_message(
      "40 23 18 3f f0 00 00 00 00 00 00 40 00 00 00 00 00 00 00 40 23 a0 00 00 00 00 00 "
      "80 23 18 bf f0 00 00 00 00 00 00 3f e0 00 00 00 00 00 00 00 00 00 00 00 00 00 00");
  expect_sample(Xsens::read(doubles), {-1.0, 0.5, 0.0}, {1.0, 2.0, 9.8125});
}

TEST(Xsens, StampsSamplesByTheSensorsClockOnceItIsKnown) {
  XsensParser parser;
  std::vector<Timestamp> stamps;
  std::vector<Timestamp> arrivals;
  for (unsigned i = 0; i < 300; ++i) {
    std::ostringstream time;
    for (const unsigned byte : {i * 100 >> 8U, i * 100 & 0xffU})
      time << " " << std::hex << std::setw(2) << std::setfill('0') << byte;
    const auto message = xsens_message("10 60 04 00 00" + time.str() +
                                       " 40 20 0c 3f 80 00 00 40 00 00 00 41 1d 00 00"
                                       " 80 20 0c bf 80 00 00 3f 00 00 00 00 00 00 00");
    arrivals.push_back(Timestamp{i * 10ms + i % 7 * 1ms});
    parser.parse(message, arrivals.back(),
                 [&](const ImuSample& sample) { stamps.push_back(sample.stamp); });
  }

  ASSERT_EQ(stamps.size(), 300U);
  EXPECT_EQ(stamps[50], arrivals[50]);
  for (unsigned i = 150; i < 300; ++i)
    EXPECT_LT(std::chrono::abs(stamps[i] - Timestamp{i * 10ms}), 100us) << i;
}

TEST(Xsens, ReportsClippedAndHalfSamples) {
  const std::string accel = "40 20 0c 3f 80 00 00 40 00 00 00 41 1d 00 00 ";
  const std::string gyro = "80 20 0c bf 80 00 00 3f 00 00 00 00 00 00 00 ";

  EXPECT_EQ(Xsens::read(xsens_message(accel + gyro)).verdict, ImuVerdict::kSample);
  EXPECT_EQ(Xsens::read(xsens_message(accel + gyro + "e0 20 04 00 08 08 00")).verdict,
            ImuVerdict::kSaturated);
  EXPECT_EQ(Xsens::read(xsens_message(gyro)).verdict, ImuVerdict::kPartial);
}

TEST(Xsens, ReadsHighRateItemsOfASensorOnABus) {
  const RecordedFrame file = recorded_file("imu/xsens_high_rate_built");

  ASSERT_EQ(Xsens::examine(file.bytes).length, file.bytes.size());
  expect_sample(Xsens::read(file.bytes), vector_of(file.decoded["gyro_rads"]),
                vector_of(file.decoded["acc_mps2"]));
  expect_refuses_damage<XsensParser>(file.bytes);
}

const char* const kXsensAccel = "40 20 0c 3f 80 00 00 40 00 00 00 41 1d 00 00 ";
const char* const kXsensGyro = "80 20 0c bf 80 00 00 3f 00 00 00 00 00 00 00 ";

TEST(Xsens, TakesOneSensorOfABusAndAnotherWhenThatIsGone) {
  const auto items = std::string(kXsensAccel) + kXsensGyro;
  const auto first = xsens_message(items, "02");
  const auto second = xsens_message(items, "14");
  XsensParser parser;

  EXPECT_EQ(samples_in(parser, first + second + first, Timestamp{1s}), 2U);
  EXPECT_EQ(samples_in(parser, second, Timestamp{1500ms}), 0U);
  EXPECT_EQ(samples_in(parser, second + first, Timestamp{3s}), 1U);
}

TEST(Xsens, PrefersCalibratedNumbersToHighRateOnes) {
  const auto high_rate = recorded_file("imu/xsens_high_rate_built").bytes;
  const auto calibrated = xsens_message(std::string(kXsensAccel) + kXsensGyro, "02");
  XsensParser parser;

  EXPECT_EQ(samples_in(parser, high_rate, Timestamp{1s}), 1U);
  EXPECT_EQ(samples_in(parser, calibrated + high_rate, Timestamp{2s}), 1U);
  EXPECT_EQ(samples_in(parser, high_rate, Timestamp{4s}), 1U);
}

TEST(Xsens, RefusesBusesBeyondTheTwentieth) {
  const auto items = std::string(kXsensAccel) + kXsensGyro;
  EXPECT_EQ(Xsens::examine(xsens_message(items, "00")).kind, FrameKind::kNone);
  EXPECT_EQ(Xsens::examine(xsens_message(items, "15")).kind, FrameKind::kNone);
}

TEST(Xsens, SaysThatTheOldFormatDoesNotSayWhatItContains) {
  XsensParser parser;
  const auto old_format = xsens_message(kXsensAccel, "01", "32");
  ASSERT_EQ(Xsens::examine(old_format).kind, FrameKind::kComplete);

  EXPECT_EQ(samples_in(parser, old_format), 0U);

  EXPECT_NE(parser.no_measurement_reason().find("MTData (32)"), std::string::npos);
}

std::string hex_of(std::uint64_t value, int bytes) {
  std::ostringstream text;
  for (int i = bytes - 1; i >= 0; --i)
    text << " " << std::hex << std::setw(2) << std::setfill('0')
         << (value >> 8U * static_cast<unsigned>(i) & 0xffU);
  return text.str();
}

/// Increments of 1/1600 s: 16 m/s^2 along x, 16 rad/s about z. The clock's steps are 0.1 ms.
std::vector<std::uint8_t> increment_message(std::uint64_t number) {
  const std::uint64_t ticks = number * 10000 / 1600 + 0xffff0000U;
  return xsens_message("10 20 02" + hex_of(number & 0xffffU, 2) + " 10 60 04" +
                       hex_of(ticks & 0xffffffffU, 4) +
                       " 40 10 0c 3c 23 d7 0a 00 00 00 00 00 00 00 00"                // 0.01 m/s
                       " 80 30 10 3f 7f ff 2e 00 00 00 00 00 00 00 00 3b a3 d6 ff");  // 0.01 rad
}

TEST(Xsens, DividesIncrementsByTheirPeriod) {
  XsensParser parser;
  std::vector<ImuSample> samples;
  std::vector<Timestamp> arrivals;
  for (std::uint64_t i = 0; i < 8000; ++i) {
    if (i % 10 == 3) continue;  // lost on the line
    const Timestamp arrival{i * 625us};
    parser.parse(increment_message(i), arrival, [&](const ImuSample& sample) {
      samples.push_back(sample);
      arrivals.push_back(arrival);
    });
  }

  ASSERT_GT(samples.size(), 5000U);  // all but the first second's
  EXPECT_EQ(parser.counts().partial + samples.size(), 7200U);
  for (const ImuSample& sample : samples) {
    ASSERT_NEAR(sample.accel_mps2.x(), 16.0, 0.01);
    ASSERT_NEAR(sample.gyro_radps.z(), 16.0, 0.01);
  }
  // A sample is the mean of the period that ends at its stamp.
  EXPECT_NEAR(to_seconds(arrivals.back() - samples.back().stamp), 0.0, 150e-6);
}

TEST(Xsens, CannotDivideIncrementsWithoutClockAndCounter) {
  XsensParser parser;

  EXPECT_EQ(
      samples_in(parser, xsens_message("40 10 0c 3c 23 d7 0a 00 00 00 00 00 00 00 00 80 30 10 "
                                       "3f 80 00 00 00 00 00 00 00 00 00 00 00 00 00 00")),
      0U);

  EXPECT_EQ(parser.counts().partial, 1U);
  EXPECT_NE(parser.no_measurement_reason().find("1060"), std::string::npos);
}

std::size_t implausible_in(const std::vector<std::uint8_t>& frame) {
  XsensParser parser;
  EXPECT_EQ(samples_in(parser, frame), 0U);
  return parser.counts().implausible;
}

TEST(Xsens, RefusesWhatIsNoNumberOrBeyondEverySensor) {
  const std::string gyro = "80 20 0c bf 80 00 00 3f 00 00 00 00 00 00 00";
  const auto with_accel_x = [&](const std::string& x) {
    return xsens_message("40 20 0c " + x + " 40 00 00 00 41 1d 00 00 " + gyro);
  };
  EXPECT_EQ(implausible_in(with_accel_x("7f c0 00 00")), 1U);  // not a number
  EXPECT_EQ(implausible_in(with_accel_x("7f 80 00 00")), 1U);  // infinite
  EXPECT_EQ(implausible_in(with_accel_x("44 7a 00 00")), 1U);  // 1000 m/s^2
}

}  // namespace
}  // namespace crepes::xsens_test
