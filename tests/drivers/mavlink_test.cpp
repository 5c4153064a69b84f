#include "drivers/imu/mavlink.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "estimator/core/constants.hpp"
#include "tests/support/imu_readings.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::mavlink_test {
namespace {

using namespace std::chrono_literals;
using test::expect_sample;
using test::samples_in;
using test::vector_of;

/// MAVLink's forward, right, down as our forward, left, up.
Eigen::Vector3d turned(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

TEST(Mavlink, ReadsRecordedMessagesInOurAxesAndUnits) {
  for (const char* name : {"imu/mavlink_highres_imu_v1", "imu/mavlink_highres_imu_v2"}) {
    const RecordedFrame file = recorded_file(name);
    ASSERT_EQ(Mavlink::examine(file.bytes).length, file.bytes.size()) << name;
    expect_sample(Mavlink::read(file.bytes), turned(vector_of(file.decoded["gyro_rads"])),
                  turned(vector_of(file.decoded["acc_ms2"])));
  }
  for (const char* name : {"imu/mavlink_scaled_imu_v1", "imu/mavlink_scaled_imu2_v2"}) {
    const RecordedFrame file = recorded_file(name);
    ASSERT_EQ(Mavlink::examine(file.bytes).length, file.bytes.size()) << name;
    expect_sample(Mavlink::read(file.bytes), turned(vector_of(file.decoded["gyro_mrads"])) / 1e3,
                  turned(vector_of(file.decoded["acc_mg"])) * kGravityMps2 / 1e3);
  }
}

TEST(Mavlink, RefusesEveryTruncationSplitAndBitErrorOfEveryRecordedMessage) {
  int checked = 0;
  for (const RecordedFrame& file : recorded_files("imu")) {
    if (file.name.find("mavlink") == std::string::npos) continue;
    SCOPED_TRACE(file.name);
    expect_refuses_damage<MavlinkParser>(file.bytes);
    ++checked;
  }
  EXPECT_EQ(checked, 6);
}

TEST(Mavlink, RefusesRawImuWithAReason) {
  MavlinkParser parser;
  EXPECT_EQ(samples_in(parser, recorded_file("imu/mavlink_timesync_v2").bytes), 0U);
  EXPECT_NE(parser.no_measurement_reason().find("without an IMU message"), std::string::npos);

  EXPECT_EQ(samples_in(parser, recorded_file("imu/mavlink_raw_imu_v2").bytes), 0U);

  EXPECT_EQ(parser.counts().unscaled, 1U);
  EXPECT_NE(parser.no_measurement_reason().find("RAW_IMU only"), std::string::npos);
}

/// A message of version 2, with its checksum.
std::vector<std::uint8_t> mavlink_message(std::uint32_t id, std::uint8_t crc_extra,
                                          const std::string& payload, std::uint8_t system = 1) {
  const auto content = bytes_of(payload);
  std::vector<std::uint8_t> message{0xfd,
                                    static_cast<std::uint8_t>(content.size()),
                                    0,
                                    0,
                                    7,
                                    system,
                                    1,
                                    static_cast<std::uint8_t>(id & 0xffU),
                                    static_cast<std::uint8_t>(id >> 8U & 0xffU),
                                    0};
  message = message + content;
  std::uint32_t crc = 0xffffU;
  auto covered = message;
  covered.push_back(crc_extra);
  for (std::size_t i = 1; i < covered.size(); ++i) {
    crc ^= covered[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ 0x8408U : crc >> 1U;
  }
  message.push_back(static_cast<std::uint8_t>(crc & 0xffU));
  message.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return message;
}

/// 1 s; 100, -200, -1000 mG; 50, -25, 10 mrad/s.
const char* const kRawImuPayload =
    "40 42 0f 00 00 00 00 00 64 00 38 ff 18 fc 32 00 e7 ff 0a 00 00 00 00 00 00 00 00";
const char* const kArduPilotHeartbeat = "00 00 00 00 02 03 51 04 03";
const char* const kPx4Heartbeat = "00 00 00 00 02 0c 51 04 03";

TEST(Mavlink, ReadsRawImuOfArduPilotOnly) {
  const auto raw = mavlink_message(27, 144, kRawImuPayload);
  MavlinkParser px4;
  EXPECT_EQ(samples_in(px4, mavlink_message(0, 50, kPx4Heartbeat) + raw), 0U);
  EXPECT_EQ(px4.counts().unscaled, 1U);

  MavlinkParser ardupilot;
  EXPECT_EQ(samples_in(ardupilot, mavlink_message(0, 50, kArduPilotHeartbeat) + raw), 1U);

  expect_sample(Mavlink::read(raw, true), {0.05, 0.025, -0.01},
                Eigen::Vector3d(0.1, 0.2, 1.0) * kGravityMps2);
}

TEST(Mavlink, LeavesRawImuOfFurtherSensorsWithoutAUnit) {
  std::string second = kRawImuPayload;
  second.replace(second.size() - 2, 2, "01");

  EXPECT_EQ(Mavlink::read(mavlink_message(27, 144, second), true).verdict, ImuVerdict::kUnscaled);
}

TEST(Mavlink, ReadsScaledImu3) {
  const auto message =
      mavlink_message(129, 46, "e8 03 00 00 64 00 38 ff 18 fc 32 00 e7 ff 0a 00 00 00 00 00 00 00");
  ASSERT_EQ(Mavlink::examine(message).kind, FrameKind::kComplete);

  expect_sample(Mavlink::read(message), {0.05, 0.025, -0.01},
                Eigen::Vector3d(0.1, 0.2, 1.0) * kGravityMps2);
  expect_refuses_damage<MavlinkParser>(message);
}

TEST(Mavlink, PassesOverUnknownMessagesWithoutCallingThemSkippedBytes) {
  const auto known = recorded_file("imu/mavlink_highres_imu_v2").bytes;
  // GPS_RAW_INT, whose checksum is not known here.
  const auto unknown = mavlink_message(24, 24, "01 02 fd 04 05 fe 07 08 09 0a 0b 0c 0d 0e 0f 10");
  for (std::size_t chunk = 1; chunk < 60; ++chunk) {
    FrameDecoder<MavlinkParser> decoder;
    EXPECT_EQ(decode(decoder, known + unknown + unknown + known, chunk), (Frames{known, known}));
    EXPECT_EQ(decoder.counts().skipped_bytes, 0U);
    EXPECT_EQ(decoder.counts().unchecked, 2U);
  }

  FrameDecoder<MavlinkParser> torn;
  const std::vector<std::uint8_t> half(unknown.begin(), unknown.begin() + 14);
  EXPECT_EQ(decode(torn, half + known + known + known + known).size(), 4U);
  EXPECT_EQ(torn.counts().skipped_bytes, half.size());
}

TEST(Mavlink, TakesTheBestMessageOnlyAndAnotherWhenThatIsGone) {
  const auto highres = recorded_file("imu/mavlink_highres_imu_v2").bytes;
  const auto scaled = recorded_file("imu/mavlink_scaled_imu_v1").bytes;
  const auto scaled2 = recorded_file("imu/mavlink_scaled_imu2_v2").bytes;
  MavlinkParser parser;

  EXPECT_EQ(samples_in(parser, scaled2, Timestamp{1s}), 1U);
  EXPECT_EQ(samples_in(parser, scaled + highres, Timestamp{2s}), 2U);
  EXPECT_EQ(samples_in(parser, scaled + scaled2, Timestamp{2500ms}), 0U);
  EXPECT_EQ(samples_in(parser, scaled + scaled2, Timestamp{4s}), 1U);
}

TEST(Mavlink, LearnsTheClockOfEachSenderAnew) {
  const auto message = [](std::uint8_t system, Duration boot) {
    const auto ms = static_cast<std::uint32_t>(boot / 1ms);
    std::string payload;
    for (unsigned shift = 0; shift < 32; shift += 8)
      payload += fmt::format("{:02x} ", ms >> shift & 0xffU);
    return mavlink_message(
        26, 170, payload + "64 00 38 ff 18 fc 32 00 e7 ff 0a 00 00 00 00 00 00 00", system);
  };
  MavlinkParser parser;
  Timestamp newest{};
  const auto send = [&](std::uint8_t system, Duration behind, Duration from, Duration to) {
    Duration most{};
    for (Duration now = from; now < to; now += 10ms) {
      for (const auto& frame : decode<MavlinkParser>(message(system, now - behind)))
        parser.parse(frame, Timestamp{now},
                     [&](const ImuSample& sample) { newest = sample.stamp; });
      most = std::max(most, Timestamp{now} - newest);
    }
    return most;
  };

  EXPECT_LE(send(1, 10s, 20s, 30s), 1ms);
  EXPECT_LE(send(2, 10s + 300ms, 32s, 34s), 1ms);
}

}  // namespace
}  // namespace crepes::mavlink_test
