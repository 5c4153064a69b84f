#include <gtest/gtest.h>

#include <cmath>
#include <iomanip>
#include <sstream>

#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/microstrain.hpp"
#include "drivers/imu/vectornav.hpp"
#include "drivers/imu/xsens.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/frame_damage.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::imu_protocols_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

Eigen::Vector3d vector_of(const Json& values) {
  return {values[0].get<double>(), values[1].get<double>(), values[2].get<double>()};
}

/// MAVLink's forward, right, down as our forward, left, up.
Eigen::Vector3d turned(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

void expect_sample(const ImuReading& reading, const Eigen::Vector3d& gyro_radps,
                   const Eigen::Vector3d& accel_mps2) {
  EXPECT_EQ(reading.verdict, ImuVerdict::kSample);
  EXPECT_LT((reading.gyro_radps - gyro_radps).norm(), 1e-6);
  EXPECT_LT((reading.accel_mps2 - accel_mps2).norm(), 1e-5);
}

template <class Parser>
std::size_t samples_in(Parser& parser, const std::vector<std::uint8_t>& stream,
                       Timestamp arrival = {}) {
  std::size_t samples = 0;
  for (const auto& frame : decode<Parser>(stream))
    parser.parse(frame, arrival, [&](const ImuSample&) { ++samples; });
  return samples;
}

TEST(Hipnuc, ReadsTheRecordedFrameInSiUnits) {
  const RecordedFrame file = recorded_file("imu/hipnuc_hi91_official");

  ASSERT_EQ(Hipnuc::examine(file.bytes).length, file.bytes.size());
  expect_sample(Hipnuc::read(file.bytes), vector_of(file.decoded["gyro_dps"]) * radians(1.0),
                vector_of(file.decoded["acc_g"]) * 9.8);
}

void expect_time(const ImuReading& reading, std::uint64_t ticks, Duration tick) {
  ASSERT_TRUE(reading.time);
  EXPECT_EQ(reading.time->ns, ticks * static_cast<std::uint64_t>(tick.count()));
}

TEST(ImuReading, HoldsTheSensorsOwnTime) {
  const auto ticks = [](const RecordedFrame& file, const char* key) {
    return file.decoded[key].get<std::uint64_t>();
  };
  const RecordedFrame hipnuc = recorded_file("imu/hipnuc_hi91_official");
  expect_time(Hipnuc::read(hipnuc.bytes), ticks(hipnuc, "time_ms"), 1ms);
  const RecordedFrame xsens = recorded_file("imu/xsens_mtdata2_accgyr");
  expect_time(Xsens::read(xsens.bytes), xsens.decoded["items"][1]["v"].get<std::uint64_t>(), 100us);
  const RecordedFrame highres = recorded_file("imu/mavlink_highres_imu_v2");
  expect_time(Mavlink::read(highres.bytes), ticks(highres, "time_us"), 1us);
  const RecordedFrame scaled = recorded_file("imu/mavlink_scaled_imu_v1");
  expect_time(Mavlink::read(scaled.bytes), ticks(scaled, "time_ms"), 1ms);
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
  // A mean rate is half a period old.
  EXPECT_NEAR(to_seconds(arrivals.back() - samples.back().stamp), 312.5e-6, 150e-6);
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

/// A message of version 2 from system 1, with its checksum.
std::vector<std::uint8_t> mavlink_message(std::uint32_t id, std::uint8_t crc_extra,
                                          const std::string& payload) {
  const auto content = bytes_of(payload);
  std::vector<std::uint8_t> message{0xfd,
                                    static_cast<std::uint8_t>(content.size()),
                                    0,
                                    0,
                                    7,
                                    1,
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

TEST(VectorNav, ReadsPublishedLinesAndBinaryMessagesOfGroup1) {
  for (const char* name : {"imu/vectornav_vnimu_published", "imu/vectornav_binary_built"}) {
    const RecordedFrame file = recorded_file(name);
    ASSERT_EQ(VectorNav::examine(file.bytes).length, file.bytes.size()) << name;
    expect_sample(VectorNav::read(file.bytes), vector_of(file.decoded["gyro_rads"]),
                  vector_of(file.decoded["acc_ms2"]));
    expect_refuses_damage<VectorNavParser>(file.bytes);
  }
  expect_time(VectorNav::read(recorded_file("imu/vectornav_binary_built").bytes), 123456789012,
              1ns);
}

TEST(VectorNav, TakesCompensatedFieldsWhereImuIsNotThere) {
  const auto message = bytes_of(
      "fa 01 20 01 00 00 00 3e 00 00 00 bf 00 00 80 3d 00 00 00 3f 00 00 80 be 00 00 1d c1 eb 31");
  ASSERT_EQ(VectorNav::examine(message).kind, FrameKind::kComplete);

  expect_sample(VectorNav::read(message), {0.125, -0.5, 0.0625}, {0.5, -0.25, -9.8125});
}

TEST(VectorNav, PassesByMessagesWithoutSamples) {
  const auto angles = recorded_file("imu/vectornav_ypr_published").bytes;
  ASSERT_EQ(VectorNav::examine(angles).length, angles.size());
  EXPECT_EQ(VectorNav::read(angles).verdict, ImuVerdict::kOther);
}

TEST(MicroStrain, ReadsAccelerationAndRateOfOnePacket) {
  const RecordedFrame file = recorded_file("imu/microstrain_imu_built");
  ASSERT_EQ(MicroStrain::examine(file.bytes).length, file.bytes.size());

  expect_sample(MicroStrain::read(file.bytes), vector_of(file.decoded["gyro_rads"]),
                vector_of(file.decoded["acc_g"]) * kGravityMps2);
  expect_time(MicroStrain::read(file.bytes), 123456789012, 1ns);
  expect_refuses_damage<MicroStrainParser>(file.bytes);
}

TEST(MicroStrain, FindsThePublishedPacketAndCallsItHalfASample) {
  const auto published = recorded_file("imu/microstrain_accel_published").bytes;
  ASSERT_EQ(MicroStrain::examine(published).length, published.size());

  EXPECT_EQ(MicroStrain::read(published).verdict, ImuVerdict::kPartial);
  expect_refuses_damage<MicroStrainParser>(published);
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

template <class Parser>
std::size_t implausible_in(const std::vector<std::uint8_t>& frame) {
  Parser parser;
  EXPECT_EQ(samples_in(parser, frame), 0U);
  return parser.counts().implausible;
}

TEST(ImuReading, RefusesWhatIsNoNumberOrBeyondEverySensor) {
  const std::string gyro = "80 20 0c bf 80 00 00 3f 00 00 00 00 00 00 00";
  const auto with_accel_x = [&](const std::string& x) {
    return xsens_message("40 20 0c " + x + " 40 00 00 00 41 1d 00 00 " + gyro);
  };
  EXPECT_EQ(implausible_in<XsensParser>(with_accel_x("7f c0 00 00")), 1U);  // not a number
  EXPECT_EQ(implausible_in<XsensParser>(with_accel_x("7f 80 00 00")), 1U);  // infinite
  EXPECT_EQ(implausible_in<XsensParser>(with_accel_x("44 7a 00 00")), 1U);  // 1000 m/s^2
}

}  // namespace
}  // namespace crepes::imu_protocols_test
