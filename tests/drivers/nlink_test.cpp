#include "drivers/uwb/nlink.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "drivers/uwb/nlink_encoder.hpp"
#include "tests/support/recorded_files.hpp"
#include "tests/support/recorded_frames.hpp"

namespace crepes::nlink_test {
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

TEST(Nlink, StampsFramesByTheModulesClockOnceItIsKnown) {
  NlinkParser parser(identity_modules(), 200.0);
  for (unsigned i = 0; i < 200; ++i) {
    const Duration late = i % 5 * 2ms;
    parser.parse(encode_node_frame3(1, 1000 + 20 * i, {{2, 3.0, -80.0, -78.0}}),
                 Timestamp{20ms * i + late}, [&](const UwbRange& range) {
                   const Duration expected = i < 50 ? late : 0ms;
                   if (i >= 50 && i <= 60) return;
                   EXPECT_LT(std::chrono::abs(range.stamp - Timestamp{20ms * i + expected}), 100us)
                       << i;
                 });
  }
  EXPECT_EQ(parser.counts().ranges, 200U);
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

TEST(Nlink, ReadsRangesOfEveryKindThatHasThem) {
  const auto ranges_of = [](const char* name) { return ranges_in(recorded_file(name).bytes); };
  EXPECT_EQ(ranges_of("nlink/tagframe0_01").size(), 4U);
  EXPECT_EQ(ranges_of("nlink/aoa_nodeframe0_01").size(), 4U);
  EXPECT_EQ(ranges_of("nlink/nodeframe5_01").size(), 4U);
  EXPECT_EQ(ranges_of("nlink/nodeframe0_01").size(), 0U);
  EXPECT_EQ(ranges_of("nlink/nodeframe1_01").size(), 0U);
  // A weak first path is recognized by the difference of the powers; TagFrame0 has none.
  EXPECT_EQ(ranges_of("nlink/tagframe0_01")[1].first_path_dbm, 0.0);
  EXPECT_EQ(ranges_of("nlink/tagframe0_01")[1].received_dbm, 0.0);
}

TEST(Nlink, SaysThatARangeOfAMemberIsRefusedAndWhy) {
  NlinkParser parser({{2, RobotId{17}}}, 6.0);
  const auto reason_for = [&](double range_m) {
    ranges_in(parser,
              encode_node_frame3(1, 0, {{5, 1.0, -80.0, -78.0}, {2, range_m, -80.0, -78.0}}));
    return parser.no_measurement_reason();
  };

  // One text whatever was measured: each change of a fault is logged.
  for (const double range_m : {-0.5, 0.0, 7.25}) {
    EXPECT_EQ(reason_for(range_m),
              "the range to robot 17 is refused: it is not above 0 and up to uwb.max_range_m, 6 m");
  }
}

TEST(Nlink, NamesAnchorFramesThatHaveNoRangesOfThisRobot) {
  NlinkParser parser(identity_modules(), 200.0);
  for (const auto& [file, name] : {std::pair{"nlink/anchorframe0_01", "sends AnchorFrame0,"},
                                   std::pair{"nlink/nodeframe4_01", "sends NodeFrame4,"}}) {
    EXPECT_EQ(ranges_in(parser, recorded_file(file).bytes).size(), 0U);
    EXPECT_NE(parser.no_measurement_reason().find(name), std::string::npos)
        << parser.no_measurement_reason();
  }
}

TEST(Nlink, SaysWhyThereAreNoRanges) {
  NlinkParser parser({{9, RobotId{9}}}, 200.0);
  ranges_in(parser, recorded_file("nlink/nodeframe1_01").bytes);
  EXPECT_NE(parser.no_measurement_reason().find("NodeFrame1, which has no ranges"),
            std::string::npos);
  EXPECT_EQ(parser.counts().without_ranges, 1U);

  ranges_in(parser, recorded_file("nlink/nodeframe3_02").bytes);
  EXPECT_NE(parser.no_measurement_reason().find("such as 0 (0x0); see swarm.members"),
            std::string::npos);

  ranges_in(parser, encode_node_frame3(9, 0, {}));
  EXPECT_NE(parser.no_measurement_reason().find("are the others on"), std::string::npos);
}

}  // namespace
}  // namespace crepes::nlink_test
