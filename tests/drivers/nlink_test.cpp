#include "drivers/uwb/nlink.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/recorded_frames.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Timestamp kArrival{10s};

UwbModules identity_modules() {
  UwbModules modules;
  for (std::uint16_t id = 0; id < 256; ++id) modules.emplace(id, RobotId{id});
  return modules;
}

std::vector<UwbRange> ranges_in(NlinkParser& parser, Bytes frame) {
  EXPECT_EQ(NlinkParser::examine(frame).length, frame.size());
  std::vector<UwbRange> ranges;
  parser.parse(frame, kArrival, [&](const UwbRange& range) { ranges.push_back(range); });
  return ranges;
}

std::vector<UwbRange> ranges_in(Bytes frame) {
  NlinkParser parser(identity_modules(), 200.0);
  return ranges_in(parser, frame);
}

TEST(Nlink, ReadsARecordedNodeFrame3) {
  const auto ranges = ranges_in(recorded_node_frame3());

  ASSERT_EQ(ranges.size(), 4U);
  EXPECT_EQ(ranges[2].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(ranges[2].range_m, 7.304);
  EXPECT_DOUBLE_EQ(ranges[2].first_path_dbm, -85.0);
  EXPECT_DOUBLE_EQ(ranges[2].received_dbm, -79.5);
  EXPECT_EQ(ranges[2].stamp, kArrival);
}

TEST(Nlink, StampsRangesOfNodeFrame2WithTheirOwnAge) {
  const auto ranges = ranges_in(recorded_node_frame2());

  ASSERT_EQ(ranges.size(), 4U);
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 3.179);
  EXPECT_DOUBLE_EQ(ranges[1].first_path_dbm, -90.0);
  EXPECT_DOUBLE_EQ(ranges[1].received_dbm, -80.5);
  EXPECT_EQ(ranges[3].stamp, kArrival - 20ms);
}

TEST(Nlink, NamesRobotsByTheirModulesAndCountsStrangers) {
  NlinkParser parser({{3, RobotId{17}}}, 200.0);

  const auto ranges = ranges_in(parser, recorded_node_frame3());

  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_EQ(ranges[0].neighbor, RobotId{17});
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 5.35);
  EXPECT_EQ(parser.counts().unknown_modules, 3U);
}

TEST(Nlink, RefusesRangesThatCannotBe) {
  NlinkParser parser(identity_modules(), 6.0);
  EXPECT_EQ(ranges_in(parser, recorded_node_frame3()).size(), 2U);
  EXPECT_EQ(ranges_in(parser, encode_node_frame3(1, 0, {{2, 0.0, -80.0, -78.0}})).size(), 0U);
  EXPECT_EQ(ranges_in(parser, encode_node_frame3(1, 0, {{2, -0.5, -80.0, -78.0}})).size(), 0U);
  EXPECT_EQ(parser.counts().implausible, 4U);
}

TEST(Nlink, TakesAFrameWithoutPeersForWhatItIs) {
  const auto frame = encode_node_frame3(1, 1000, {});

  EXPECT_EQ(frame.size(), 22U);
  EXPECT_TRUE(ranges_in(frame).empty());
}

TEST(Nlink, RecognizesAModuleInAnotherMode) {
  EXPECT_EQ(NlinkParser::examine(bytes_of("ff 02 00")).kind, FrameKind::kForeign);
  EXPECT_EQ(NlinkParser::examine(bytes_of("ff 03 00")).kind, FrameKind::kNone);
}

TEST(Nlink, EncodesWhatItDecodes) {
  EXPECT_TRUE(rc::check([] {
    std::vector<NlinkNode> nodes;
    const int count = *rc::gen::inRange(0, 20);
    for (int i = 0; i < count; ++i) {
      nodes.push_back({*rc::gen::arbitrary<std::uint8_t>(), *rc::gen::inRange(1, 200000) / 1000.0,
                       *rc::gen::inRange(0, 255) / -2.0, *rc::gen::inRange(0, 255) / -2.0});
    }
    const auto ranges = ranges_in(encode_node_frame3(1, 42, nodes));
    RC_ASSERT(ranges.size() == nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      RC_ASSERT(ranges[i].neighbor.value == nodes[i].module);
      RC_ASSERT(std::abs(ranges[i].range_m - nodes[i].range_m) < 1e-9);
      RC_ASSERT(ranges[i].first_path_dbm == nodes[i].first_path_dbm);
      RC_ASSERT(ranges[i].received_dbm == nodes[i].received_dbm);
    }
  }));
}

TEST(Nlink, GivenModulesByConfigurationFallsBackToRobotIds) {
  SwarmConfig swarm;
  swarm.members.resize(2);
  swarm.members[0].id = RobotId{1};
  swarm.members[1].id = RobotId{2};
  swarm.members[1].uwb_id = 40;

  EXPECT_EQ(uwb_modules_of(swarm), (UwbModules{{1, RobotId{1}}, {40, RobotId{2}}}));
}

TEST(Nlink, AgreesWithAllRecordedFrames) {
  const auto folder =
      std::filesystem::path(__FILE__).parent_path() / "../../../shared/vectors/nlink";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recorded frames beside the project";
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".hex") continue;
    std::ostringstream hex;
    hex << std::ifstream(entry.path()).rdbuf();
    const auto bytes = bytes_of(hex.str());
    auto json_path = entry.path();
    const auto json = nlohmann::json::parse(std::ifstream(json_path.replace_extension(".json")));
    const auto& decoded = json.at("decoded");
    const std::string type = decoded.value("type", "");
    if (type != "NodeFrame2" && type != "NodeFrame3") {
      EXPECT_NE(NlinkParser::examine(bytes).kind, FrameKind::kComplete) << entry.path();
      continue;
    }
    const auto ranges = ranges_in(Bytes(bytes).first(decoded.at("ends_at").get<std::size_t>()));
    ASSERT_EQ(ranges.size(), decoded.at("n").get<std::size_t>()) << entry.path();
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const auto& node = decoded.at("nodes").at(i);
      EXPECT_EQ(ranges[i].neighbor.value, node.at("id").get<int>());
      EXPECT_DOUBLE_EQ(ranges[i].range_m, node.at("dis").get<double>());
      EXPECT_DOUBLE_EQ(ranges[i].first_path_dbm, node.at("fp_rssi").get<double>());
      EXPECT_DOUBLE_EQ(ranges[i].received_dbm, node.at("rx_rssi").get<double>());
      ++compared;
    }
  }
  EXPECT_GE(compared, 10);
}

}  // namespace
}  // namespace crepes
