#include "drivers/detect_protocol.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/support/recorded_files.hpp"

namespace crepes::detect_protocol_test {
namespace {

/// So many times the same frame, cut off at both ends.
std::vector<std::uint8_t> stream_of(const std::string& name, int frames) {
  const auto frame = recorded_file(name).bytes;
  std::vector<std::uint8_t> stream(frame.begin() + 3, frame.end());
  for (int i = 0; i < frames; ++i) stream = stream + frame;
  stream.insert(stream.end(), frame.begin(), frame.begin() + 5);
  return stream;
}

TEST(Recognize, NamesTheProtocolOfEveryRecordedFrameAndNoOther) {
  EXPECT_EQ(detect_protocol(stream_of("imu/witmotion_hwt905_real", 2)), SerialProtocol::kWitMotion);
  EXPECT_EQ(detect_protocol(stream_of("imu/hipnuc_hi91_official", 3)), SerialProtocol::kHipnuc);
  EXPECT_EQ(detect_protocol(stream_of("imu/xsens_mtdata2_accgyr", 3)), SerialProtocol::kXsens);
  EXPECT_EQ(detect_protocol(stream_of("imu/xsens_mtdata2_short", 3)), SerialProtocol::kXsens);
  EXPECT_EQ(detect_protocol(stream_of("imu/xsens_high_rate_built", 3)), SerialProtocol::kXsens);
  EXPECT_EQ(detect_protocol(stream_of("imu/witmotion_ble_built", 3)),
            SerialProtocol::kWitMotionBle);
  for (const char* name : {"imu/mavlink_highres_imu_v1", "imu/mavlink_highres_imu_v2",
                           "imu/mavlink_raw_imu_v2", "imu/mavlink_scaled_imu2_v2"})
    EXPECT_EQ(detect_protocol(stream_of(name, 3)), SerialProtocol::kMavlink) << name;
  EXPECT_EQ(detect_protocol(stream_of("imu/vectornav_vnimu_published", 3)),
            SerialProtocol::kVectorNav);
  EXPECT_EQ(detect_protocol(stream_of("imu/vectornav_binary_built", 3)),
            SerialProtocol::kVectorNav);
  EXPECT_EQ(detect_protocol(stream_of("imu/microstrain_imu_built", 3)),
            SerialProtocol::kMicroStrain);
  for (const char* name : {"nlink/nodeframe0_01", "nlink/nodeframe2_01", "nlink/tagframe0_01"})
    EXPECT_EQ(detect_protocol(stream_of(name, 3)), SerialProtocol::kNlink) << name;
}

TEST(Recognize, NamesTextThatRangingModulesPrint) {
  const auto spoken = [](const std::string& line) {
    const std::string text = line + line + line + line;
    return detect_protocol(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  EXPECT_EQ(spoken("range 3 4.27\n"), SerialProtocol::kRangeLine);
  EXPECT_EQ(spoken("# calibrated today\n"), std::nullopt);
  EXPECT_EQ(spoken("DIST,1,AN0,0E15,1.75,4.55,2.33,1.61\r\n"), SerialProtocol::kDwm1001Shell);
  EXPECT_EQ(spoken("0E15[1.75,4.55,2.33]=1.61 le_us=3082\r\n"), SerialProtocol::kDwm1001Shell);
  EXPECT_EQ(spoken("AT+RANGE=tid:1,mask:04,seq:63,range:(0,0,30,0,0,0,0,0)\r\n"),
            SerialProtocol::kMaUwb);
}

TEST(Recognize, WaitsForThreeFrames) {
  EXPECT_EQ(detect_protocol(stream_of("imu/hipnuc_hi91_official", 2)), std::nullopt);
  EXPECT_EQ(detect_protocol({}), std::nullopt);
}

TEST(Recognize, FindsNothingInNoise) {
  EXPECT_TRUE(rc::check([] {
    const auto noise =
        *rc::gen::container<std::vector<std::uint8_t>>(2048, rc::gen::arbitrary<std::uint8_t>());
    RC_ASSERT(!detect_protocol(noise));
  }));
}

}  // namespace
}  // namespace crepes::detect_protocol_test
