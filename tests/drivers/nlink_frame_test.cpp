#include "drivers/uwb/nlink_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "drivers/uwb/nlink.hpp"
#include "drivers/uwb/nlink_encoder.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/frame_damage.hpp"
#include "tests/support/recorded_files.hpp"

namespace crepes::nlink_frame_test {
namespace {

using Json = nlohmann::json;

/// Recorded values are rounded to six decimals.
void expect_vector(const Eigen::Vector3d& found, const Json& node, const char* key,
                   double unit = 1.0) {
  if (!node.contains(key)) return;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(found[static_cast<Eigen::Index>(i)], node[key][i].get<double>() * unit, 1e-6)
        << key << i;
}

void expect_node(const NlinkNode& found, const Json& node) {
  EXPECT_EQ(found.module, node.at("id").get<unsigned>());
  EXPECT_EQ(found.role, node.at("role").get<unsigned>());
  EXPECT_DOUBLE_EQ(found.range_m, node.value("dis", 0.0));
  EXPECT_DOUBLE_EQ(found.first_path_dbm, node.value("fp_rssi", 0.0));
  EXPECT_DOUBLE_EQ(found.received_dbm, node.value("rx_rssi", 0.0));
  EXPECT_EQ(found.system_time_ms.has_value(), node.contains("system_time"));
  EXPECT_EQ(found.system_time_ms.value_or(0), node.value("system_time", 0U));
  EXPECT_EQ(found.angle_rad.has_value(), node.contains("angle"));
  EXPECT_NEAR(found.angle_rad.value_or(0.0), radians(node.value("angle", 0.0)), 1e-12);
  EXPECT_EQ(found.position_m.has_value(), node.contains("pos"));
  if (found.position_m) expect_vector(*found.position_m, node, "pos");
  std::string hex = node.value("data", "");
  for (std::size_t at = 2; at < hex.size(); at += 3) hex.insert(at, " ");
  EXPECT_EQ(found.user_data, bytes_of(hex));
}

void expect_motion(const NlinkMotion& found, const Json& decoded) {
  expect_vector(found.position_m, decoded, "pos");
  expect_vector(found.position_error_m, decoded, "eop");
  expect_vector(found.velocity_mps, decoded, "vel");
  expect_vector(found.gyro_radps, decoded, "gyro");
  expect_vector(found.accel_mps2, decoded, "acc");
  expect_vector(found.roll_pitch_yaw_rad, decoded, "angle", radians(1.0));
  EXPECT_NEAR(found.q.w(), decoded.at("quat")[0].get<double>(), 1e-6);
  EXPECT_NEAR(found.q.x(), decoded.at("quat")[1].get<double>(), 1e-6);
  EXPECT_NEAR(found.q.y(), decoded.at("quat")[2].get<double>(), 1e-6);
  EXPECT_NEAR(found.q.z(), decoded.at("quat")[3].get<double>(), 1e-6);
}

/// The ranges of a TagFrame0, by anchor; 0 where there is none.
std::vector<double> tag_ranges(const NlinkFrame& frame) {
  std::vector<double> ranges(8);
  for (const NlinkNode& node : frame.nodes) ranges.at(node.module) = node.range_m;
  return ranges;
}

/// AnchorFrame0 has no checksum; only its kind is read.
bool is_anchors(const RecordedFrame& file) { return file.decoded.at("type") == "AnchorFrame0"; }

/// NodeFrame4: a tag's anchors and distances [m].
void expect_tag(const NlinkNode& found, const Json& tag) {
  EXPECT_EQ(found.module, tag.at("id").get<unsigned>());
  ASSERT_EQ(found.user_data.size(), 4 * tag.at("anchors").size());
  for (std::size_t i = 0; i < tag.at("anchors").size(); ++i) {
    const Bytes anchor = Bytes(found.user_data).subspan(4 * i, 4);
    EXPECT_EQ(anchor[0], tag["anchors"][i][0].get<unsigned>());
    EXPECT_EQ(anchor[1] + 256 * anchor[2] + 65536 * anchor[3],
              std::lround(1000 * tag["anchors"][i][1].get<double>()));
  }
}

TEST(NlinkFrame, DecodesEveryRecordedFrameToItsStatedValues) {
  std::set<std::string> kinds;
  for (const RecordedFrame& file : recorded_files("nlink")) {
    if (is_anchors(file)) continue;
    SCOPED_TRACE(file.name);
    ASSERT_EQ(examine_nlink(file.bytes).kind, FrameKind::kComplete);
    ASSERT_EQ(examine_nlink(file.bytes).length, file.decoded.at("len").get<std::size_t>());

    const NlinkFrame frame = decode_nlink(file.bytes);

    const Json& decoded = file.decoded;
    kinds.insert(decoded.at("type"));
    EXPECT_EQ(frame.role, decoded.at("role").get<unsigned>());
    EXPECT_EQ(frame.module, decoded.at("id").get<unsigned>());
    EXPECT_EQ(frame.local_time_ms, decoded.value("local_time", 0U));
    EXPECT_EQ(frame.system_time_ms, decoded.value("system_time", 0U));
    EXPECT_DOUBLE_EQ(frame.voltage_v, decoded.value("voltage", 0.0));
    EXPECT_EQ(frame.motion.has_value(), decoded.contains("quat"));
    if (frame.motion) expect_motion(*frame.motion, decoded);
    if (decoded.contains("dis")) {
      EXPECT_EQ(tag_ranges(frame), decoded["dis"].get<std::vector<double>>());
    }
    if (decoded.contains("tags")) {
      ASSERT_EQ(frame.nodes.size(), decoded["tags"].size());
      for (std::size_t i = 0; i < frame.nodes.size(); ++i)
        expect_tag(frame.nodes[i], decoded["tags"][i]);
    }
    if (!decoded.contains("nodes")) continue;
    ASSERT_EQ(frame.nodes.size(), decoded["nodes"].size());
    for (std::size_t i = 0; i < frame.nodes.size(); ++i)
      expect_node(frame.nodes[i], decoded["nodes"][i]);
  }
  EXPECT_EQ(kinds.size(), 8U);
}

TEST(NlinkFrame, NamesEveryKindAsItsMakerDoes) {
  for (const RecordedFrame& file : recorded_files("nlink")) {
    const std::string type = file.decoded.at("type");
    const NlinkKind kind = decode_nlink(file.bytes).kind;
    EXPECT_EQ(name_of(kind), type == "AOA_NodeFrame0" ? "AOA NodeFrame0" : type) << file.name;
  }
}

TEST(NlinkFrame, FindsAnchorFramesByTheirTagsAndTail) {
  const auto anchors = recorded_file("nlink/anchorframe0_01").bytes;
  EXPECT_EQ(decode<NlinkParser>(anchors + anchors), (Frames{anchors, anchors}));
  for (std::size_t chunk : {1U, 7U, 895U})
    EXPECT_EQ(decode<NlinkParser>(anchors + anchors, chunk), (Frames{anchors, anchors})) << chunk;

  auto without_tail = anchors;
  without_tail.back() = 0x00;
  EXPECT_EQ(decode<NlinkParser>(without_tail), Frames{});
  auto with_a_wrong_role = anchors;
  with_a_wrong_role[3] = 0x07;
  EXPECT_EQ(examine_nlink(Bytes(with_a_wrong_role).first(4)).kind, FrameKind::kNone);
}

/// Modules 7 (two bytes for it) at 1.5 m and 305419896 at 2.75 m. Not recorded: built as the
/// maker's parser reads it.
std::vector<std::uint8_t> iot_frame() {
  auto frame = bytes_of(
      "6a 00 2d 00 01 02 03 04 10 27 00 00 00 02 07 00 00 00 dc 05 00 00 00 00 00 a0 98 02 aa bb "
      "78 56 34 12 be 0a 00 00 00 00 00 a2 9a 00");
  unsigned sum = 0;
  for (const auto byte : frame) sum += byte;
  frame.push_back(static_cast<std::uint8_t>(sum));
  return frame;
}

TEST(NlinkFrame, ReadsRangesOfIotModules) {
  const auto bytes = iot_frame();
  ASSERT_EQ(examine_nlink(bytes).length, bytes.size());

  const NlinkFrame frame = decode_nlink(bytes);

  EXPECT_EQ(name_of(frame.kind), "IoT Frame0");
  EXPECT_EQ(frame.module, 0x04030201U);
  ASSERT_EQ(frame.nodes.size(), 2U);
  EXPECT_EQ(frame.nodes[0].module, 7U);
  EXPECT_DOUBLE_EQ(frame.nodes[0].range_m, 1.5);
  EXPECT_DOUBLE_EQ(frame.nodes[0].first_path_dbm, -80.0);
  EXPECT_EQ(frame.nodes[0].user_data, bytes_of("aa bb"));
  EXPECT_EQ(frame.nodes[1].module, 305419896U);
  EXPECT_DOUBLE_EQ(frame.nodes[1].range_m, 2.75);
  EXPECT_DOUBLE_EQ(frame.nodes[1].received_dbm, -77.0);
  expect_refuses_damage<NlinkParser>(bytes);
}

TEST(NlinkFrame, RefusesEveryTruncationSplitAndBitErrorOfEveryRecordedFrame) {
  for (const RecordedFrame& file : recorded_files("nlink")) {
    if (is_anchors(file)) continue;
    SCOPED_TRACE(file.name);
    expect_refuses_damage<NlinkParser>(file.bytes);
  }
}

TEST(NlinkFrame, RefusesDamageToFramesWithoutNodesAndWithMany) {
  std::vector<NlinkNode> nodes;
  for (const std::size_t count : {0U, 1U, 30U}) {
    while (nodes.size() < count) {
      const auto module = static_cast<std::uint32_t>(nodes.size() + 2);
      nodes.push_back({module, 1.0 + 0.37 * module, -84.0 - 0.5 * module, -79.5});
    }
    SCOPED_TRACE(count);
    expect_refuses_damage<NlinkParser>(encode_node_frame3(1, 123456789, nodes));
  }
}

/// Modules 7 (3 bytes for it) and 300 (none).
std::vector<std::uint8_t> node_frame6() {
  auto frame = bytes_of(
      "55 09 20 00 00 2c 01 00 00 00 00 00 00 02 00 07 00 00 00 03 00 aa bb cc 00 2c 01 00 00 00 "
      "00");
  unsigned sum = 0;
  for (const auto byte : frame) sum += byte;
  frame.push_back(static_cast<std::uint8_t>(sum));
  return frame;
}

TEST(NlinkFrame, ReadsUserDataOfNodeFrame6) {
  const auto bytes = node_frame6();
  ASSERT_EQ(examine_nlink(bytes).length, bytes.size());

  const NlinkFrame frame = decode_nlink(bytes);

  EXPECT_EQ(frame.module, 300U);
  ASSERT_EQ(frame.nodes.size(), 2U);
  EXPECT_EQ(frame.nodes[0].module, 7U);
  EXPECT_EQ(frame.nodes[0].user_data, bytes_of("aa bb cc"));
  EXPECT_EQ(frame.nodes[1].module, 300U);
  EXPECT_TRUE(frame.nodes[1].user_data.empty());
  expect_refuses_damage<NlinkParser>(bytes);
}

TEST(NlinkFrame, NeverWaitsForUserDataThatCannotBe) {
  auto frame = node_frame6();
  frame[19] = 0xff;  // longer than the frame

  EXPECT_EQ(examine_nlink(Bytes(frame).first(21)).kind, FrameKind::kNone);
}

}  // namespace
}  // namespace crepes::nlink_frame_test
