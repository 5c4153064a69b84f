#include <gtest/gtest.h>

#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/microstrain.hpp"
#include "drivers/imu/vectornav.hpp"
#include "drivers/imu/xsens.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/imu_readings.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::imu_protocols_test {
namespace {

using namespace std::chrono_literals;
using test::expect_sample;
using test::expect_time;
using test::vector_of;

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

}  // namespace
}  // namespace crepes::imu_protocols_test
