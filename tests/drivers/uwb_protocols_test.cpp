#include <gtest/gtest.h>

#include <string>

#include "drivers/detect_protocol.hpp"
#include "drivers/uwb/bu03.hpp"
#include "drivers/uwb/dwm1001.hpp"
#include "drivers/uwb/fira_uci.hpp"
#include "drivers/uwb/mauwb.hpp"
#include "drivers/uwb/range_line.hpp"
#include "tests/support/frame_damage.hpp"

namespace crepes::uwb_protocols_test {
namespace {

using namespace std::chrono_literals;

constexpr Timestamp kArrival{10s};

std::vector<std::uint8_t> bytes_in(const std::string& text) { return {text.begin(), text.end()}; }

UwbModules modules_of(std::initializer_list<std::uint32_t> modules) {
  UwbModules robots;
  for (const std::uint32_t module : modules)
    robots.emplace(module, RobotId{static_cast<std::uint16_t>(robots.size() + 1)});
  return robots;
}

template <class Parser>
std::vector<UwbRange> ranges_in(Parser& parser, const std::vector<std::uint8_t>& stream) {
  std::vector<UwbRange> ranges;
  for (const auto& frame : decode<Parser>(stream))
    parser.parse(frame, kArrival, [&](const UwbRange& range) { ranges.push_back(range); });
  return ranges;
}

/// Text that is cut short or torn by a lost character must not become a range. (A digit that turned
/// into another one cannot be detected: lines have no checksum.)
template <class Protocol>
void expect_refuses_cuts(const std::vector<std::uint8_t>& line) {
  for (std::size_t length = 1; length + 1 < line.size(); ++length) {
    const std::vector<std::uint8_t> cut(line.begin(),
                                        line.begin() + static_cast<std::ptrdiff_t>(length));
    const Frames frames = decode<Protocol>(cut + bytes_in("\n") + line);
    EXPECT_EQ(frames.back(), line) << length;
  }
  for (std::size_t chunk = 1; chunk <= line.size(); ++chunk)
    EXPECT_EQ(decode<Protocol>(line + line, chunk), (Frames{line, line})) << chunk;
}

TEST(RangeLine, ReadsRangesWithAndWithoutPowers) {
  RangeLineParser parser(modules_of({3, 70000}), 200.0);

  const auto ranges =
      ranges_in(parser, bytes_in("# made by me\nrange 3 4.27\r\nrange 70000 0.5 -91.5 -80\n"));

  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_EQ(ranges[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 4.27);
  EXPECT_EQ(ranges[0].first_path_dbm, 0.0);
  EXPECT_EQ(ranges[0].stamp, kArrival);
  EXPECT_EQ(ranges[1].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(ranges[1].first_path_dbm, -91.5);
  EXPECT_DOUBLE_EQ(ranges[1].received_dbm, -80.0);
}

TEST(RangeLine, RefusesWhatIsNoRange) {
  for (const char* line :
       {"range 3\n", "range 3 4.27 -80\n", "range 3 4.27 -80 -70 1\n", "range -3 4.27\n",
        "range 3 nan\n", "range 3 inf\n", "range 3 4,27\n", "range  3 4.27\n", "range 3 4.27 \n",
        "range 3 0x4\n", "ranges 3 4.27\n", "range 3 4.27\r", "range 3 4.\x01\n", "3 4.27\n"})
    EXPECT_EQ(decode<RangeLineParser>(bytes_in(line)), Frames{}) << line;
  EXPECT_EQ(decode<RangeLineParser>(std::vector<std::uint8_t>(500, '#')), Frames{});
}

TEST(RangeLine, NeverReadsATornLine) {
  expect_refuses_cuts<RangeLineParser>(bytes_in("range 12 14.237 -91.5 -80.25\n"));
  RangeLineParser parser(modules_of({12}), 200.0);
  EXPECT_EQ(ranges_in(parser, bytes_in("range 12 3.range 12 4.5\n")).size(), 1U);
}

TEST(RangeLine, RefusesRangesThatCannotBeWithAReason) {
  RangeLineParser parser(modules_of({3}), 200.0);

  EXPECT_TRUE(ranges_in(parser, bytes_in("range 3 -0.1\n")).empty());

  EXPECT_EQ(parser.counts().implausible, 1U);
  EXPECT_NE(parser.no_measurement_reason().find("robot 1 is refused: it is not"),
            std::string::npos);
}

TEST(RangeLine, NamesOneOfSeveralStrangersSteadily) {
  RangeLineParser parser(modules_of({3}), 200.0);
  for (const char* line : {"range 7 4.1\n", "range 9 5.2\n", "range 7 4.1\n", "range 9 5.2\n"}) {
    EXPECT_TRUE(ranges_in(parser, bytes_in(line)).empty());
    EXPECT_NE(parser.no_measurement_reason().find("such as 7 "), std::string::npos)
        << parser.no_measurement_reason();
  }
}

// Lines of real modules, as users of the module published them.
constexpr const char* kLec =
    "DIST,4,AN0,022E,7.94,8.03,0.00,3.44,AN1,9280,7.95,0.00,0.00,5.68,AN2,DCAE,0.00,8.03,0.00,7.76,"
    "AN3,5431,0.00,0.00,0.00,8.73,POS,6.95,5.37,-1.97,52\r\n";
constexpr const char* kLes =
    "022E[7.94,8.03,0.00]=3.38 9280[7.95,0.00,0.00]=5.49 DCAE[0.00,8.03,0.00]=7.73 "
    "5431[0.00,0.00,0.00]=9.01 le_us=3082 est[6.97,5.17,-1.77,53]\r\n";

TEST(Dwm1001Shell, ReadsBothKindsOfLines) {
  Dwm1001ShellParser parser(modules_of({0x022e, 0x9280, 0xdcae, 0x5431}), 200.0);

  const auto lec = ranges_in(parser, bytes_in(kLec));
  const auto les = ranges_in(parser, bytes_in(kLes));

  ASSERT_EQ(lec.size(), 4U);
  EXPECT_EQ(lec[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(lec[0].range_m, 3.44);
  EXPECT_EQ(lec[3].neighbor, RobotId{4});
  EXPECT_DOUBLE_EQ(lec[3].range_m, 8.73);
  ASSERT_EQ(les.size(), 4U);
  EXPECT_DOUBLE_EQ(les[1].range_m, 5.49);
  EXPECT_DOUBLE_EQ(les[3].range_m, 9.01);
}

TEST(Dwm1001Shell, ReadsLinesAmongTheShellsOtherText) {
  Dwm1001ShellParser parser(modules_of({0x0e15}), 200.0);

  const auto ranges = ranges_in(
      parser, bytes_in("\r\ndwm> lec\r\nDIST,1,AN0,0E15,1.75,4.55,2.33,1.61\r\nPOS,1,2,3,4\r\n"));

  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 1.61);
}

TEST(Dwm1001Shell, RefusesLinesThatLostCharacters) {
  for (const std::string& whole : std::vector<std::string>{kLec, kLes}) {
    std::size_t changed = 0;
    const std::size_t end =
        std::min(whole.find(" le_us"), whole.find(",POS"));  // no ranges behind it
    for (std::size_t at = 0; at < end; ++at) {
      // A lost digit of a number cannot be detected; a lost separator or letter must be.
      if (std::string_view("0123456789ABCDEF-.").find(whole[at]) != std::string_view::npos)
        continue;
      std::string torn = whole;
      torn.erase(at, 1);
      for (const auto& frame : decode<Dwm1001ShellParser>(bytes_in(torn)))
        EXPECT_TRUE(whole.ends_with(std::string(frame.begin(), frame.end()))) << torn;
      ++changed;
    }
    EXPECT_GT(changed, 20U);
  }
  expect_refuses_cuts<Dwm1001ShellParser>(bytes_in(kLec));
  expect_refuses_cuts<Dwm1001ShellParser>(bytes_in(kLes));
}

TEST(Dwm1001Shell, IsOpenedAndThenAskedForDistancesWhileItIsSilent) {
  EXPECT_EQ(Dwm1001Shell::request(0).bytes, "\r\r");
  EXPECT_EQ(Dwm1001Shell::request(1).bytes, "lec\r");
  EXPECT_EQ(Dwm1001Shell::request(2).bytes, "\r\r");
  EXPECT_TRUE(Dwm1001Shell::request(1).only_if_silent);
}

/// Built as the host API of the maker reads it (dwm_api.c, dwm_loc_get); no recording.
std::vector<std::uint8_t> location(const std::string& distances) {
  return bytes_of("40 01 00 41 0d 4b 0a 00 00 1f 0e 00 00 9c 0f 00 00 40 " + distances);
}
constexpr const char* kOfTag =
    "49 29 02 ab 4e 83 0b 00 00 64 00 00 00 00 00 00 00 00 00 00 00 00 64 "
    "2e 02 70 0d 00 00 64 01 00 00 00 02 00 00 00 03 00 00 00 64";
constexpr const char* kOfAnchor = "48 0e 01 2e 02 34 12 00 00 ca de 39 05 00 00 64";

TEST(Dwm1001Tlv, ReadsTheDistancesOfTagsAndAnchors) {
  Dwm1001TlvParser parser(modules_of({0x4eab, 0x022e}), 200.0);

  const auto of_tag = ranges_in(parser, location(kOfTag));
  const auto of_anchor = ranges_in(parser, location(kOfAnchor));

  ASSERT_EQ(of_tag.size(), 2U);
  EXPECT_EQ(of_tag[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(of_tag[0].range_m, 2.947);
  EXPECT_EQ(of_tag[1].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(of_tag[1].range_m, 3.44);
  ASSERT_EQ(of_anchor.size(), 1U);
  EXPECT_EQ(of_anchor[0].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(of_anchor[0].range_m, 1.337);
}

TEST(Dwm1001Tlv, FindsAnswersInEveryChunkSizeAndRefusesLengthsThatContradict) {
  const auto good = location(kOfTag);
  for (std::size_t chunk = 1; chunk <= good.size(); ++chunk)
    EXPECT_EQ(decode<Dwm1001TlvParser>(good + good, chunk), (Frames{good, good})) << chunk;
  // The last byte is not used, and without a checksum its loss cannot be detected.
  for (std::size_t length = 0; length + 1 < good.size(); ++length) {
    expect_only_good_frames<Dwm1001TlvParser>(
        {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)}, good, length);
  }
  auto contradiction = good;
  contradiction[20] = 3;
  EXPECT_EQ(Dwm1001Tlv::examine(contradiction).kind, FrameKind::kNone);
}

TEST(Dwm1001Tlv, IsAskedTenTimesASecond) {
  EXPECT_EQ(Dwm1001Tlv::request(5).bytes, std::string_view("\x0c\x00", 2));
  EXPECT_EQ(Dwm1001Tlv::request(5).pause, 100ms);
  EXPECT_FALSE(Dwm1001Tlv::request(5).only_if_silent);
}

// Lines as boards sent them, published by users.
constexpr const char* kWithIds =
    "AT+RANGE=tid:7,mask:0F,seq:128,range:(997,1321,911,738,0,0,0,0),ancid:(0,1,2,3,-1,-1,-1,-1)"
    "\r\n";
constexpr const char* kWithPowers =
    "AT+RANGE=tid:1,mask:04,seq:63,range:(0,0,30,0,0,0,0,0),"
    "rssi:(0.00,0.00,-77.93,0.00,0.00,0.00,0.00,0.00)\r\n";

TEST(MaUwb, ReadsTheTagsOwnRanges) {
  MaUwbParser tag(modules_of({0, 1, 2, 3, 7}), 200.0, 7);

  const auto ranges = ranges_in(tag, bytes_in(kWithIds));

  ASSERT_EQ(ranges.size(), 4U);
  EXPECT_EQ(ranges[1].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(ranges[1].range_m, 13.21);
}

TEST(MaUwb, ReadsOnAnAnchorItsOwnRangeOfEachTag) {
  MaUwbParser anchor(modules_of({0, 1, 2, 3, 7}), 200.0, 2);

  const auto ranges = ranges_in(anchor, bytes_in(kWithIds));

  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_EQ(ranges[0].neighbor, RobotId{5});
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 9.11);
}

TEST(MaUwb, TakesThePlaceForTheAnchorWhereNoIdsAreGiven) {
  MaUwbParser tag(modules_of({2, 1}), 200.0, 1);

  const auto ranges = ranges_in(tag, bytes_in(kWithPowers));

  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_EQ(ranges[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 0.3);
}

TEST(MaUwb, NeverReadsATornLine) {
  expect_refuses_cuts<MaUwbParser>(bytes_in(kWithIds));
  for (const char* line :
       {"AT+RANGE=tid:7,mask:0F,seq:128,range:(997,13x1)\n",
        "AT+RANGE=tid:7,mask:0F,seq:1,range:(997,1321),ancid:(0)\n",
        "AT+RANGE=tid:,mask:0F,seq:1,range:(997)\n", "AT+RANGE=tid:7,mask:0F,seq:1\n"})
    EXPECT_EQ(decode<MaUwbParser>(bytes_in(line)), Frames{}) << line;
}

/// Built as Android's uci_packets.pdl says; no recording. Module 0x0201 at 1.53 m and in sight,
/// module 0x0403 without an answer (status 0x21).
const char* const kShort =
    "62 00 00 57 10 00 00 00 11 00 00 00 00 c8 00 00 00 01 00 00 00 00 00 00 00 00 00 00 02 "
    "01 02 00 00 99 00 00 00 00 00 00 00 00 00 00 00 00 00 00 50 00 00 00 00 00 00 00 00 00 00 00 "
    "03 04 21 00 ff ff 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00";
const char* const kExtended =
    "62 00 00 38 10 00 00 00 11 00 00 00 00 c8 00 00 00 01 00 01 00 00 00 00 00 00 00 00 01 "
    "07 00 00 00 00 00 ca de 00 01 2c 01 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00";

TEST(FiraUci, ReadsAnswersWithShortAndExtendedAddresses) {
  FiraUciParser parser(modules_of({0x0201, 0x0403, 7}), 200.0);

  const auto of_short = ranges_in(parser, bytes_of(kShort));
  const auto of_extended = ranges_in(parser, bytes_of(kExtended));

  ASSERT_EQ(of_short.size(), 1U);
  EXPECT_EQ(of_short[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(of_short[0].range_m, 1.53);
  ASSERT_EQ(of_extended.size(), 1U);
  EXPECT_EQ(of_extended[0].neighbor, RobotId{3});
  EXPECT_DOUBLE_EQ(of_extended[0].range_m, 3.0);
}

TEST(FiraUci, FindsNotificationsAmongOtherPacketsInEveryChunkSize) {
  const auto good = bytes_of(kShort);
  const auto status = bytes_of("61 02 00 06 11 00 00 00 02 00");  // SESSION_STATUS_NTF
  for (std::size_t chunk = 1; chunk <= good.size(); ++chunk)
    EXPECT_EQ(decode<FiraUciParser>(good + status + good, chunk), (Frames{good, good})) << chunk;
  // The last byte is not used, and without a checksum its loss cannot be detected.
  for (std::size_t length = 0; length + 1 < good.size(); ++length) {
    expect_only_good_frames<FiraUciParser>(
        {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)}, good, length);
  }
}

TEST(FiraUci, RefusesCountsThatDoNotFitAndOtherKindsOfRanging) {
  auto bytes = bytes_of(kShort);
  bytes[28] = 3;
  EXPECT_EQ(FiraUci::examine(bytes).kind, FrameKind::kNone);
  bytes = bytes_of(kShort);
  bytes[17] = 0x02;
  EXPECT_EQ(FiraUci::examine(bytes).kind, FrameKind::kNone);
}

/// The first 35 bytes are of a board, as its user published them with what they mean: 2.030 m to
/// station 0, 1.240 m to station 1. The last two are as the drivers of two other users expect them.
const char* const kBu03 =
    "aa 25 01 ee 07 00 00 d8 04 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
    "00 00 00 00 00 55";

TEST(Bu03, ReadsThePublishedFrame) {
  Bu03Parser parser(modules_of({0, 1, 2}), 200.0, 8);

  const auto ranges = ranges_in(parser, bytes_of(kBu03));

  ASSERT_EQ(ranges.size(), 2U);
  EXPECT_EQ(ranges[0].neighbor, RobotId{1});
  EXPECT_DOUBLE_EQ(ranges[0].range_m, 2.030);
  EXPECT_EQ(ranges[1].neighbor, RobotId{2});
  EXPECT_DOUBLE_EQ(ranges[1].range_m, 1.240);
  EXPECT_EQ(parser.counts().implausible, 0U);
}

TEST(Bu03, FindsFramesInEveryChunkSizeAndAfterEveryCut) {
  const auto good = bytes_of(kBu03);
  for (std::size_t chunk = 1; chunk <= good.size(); ++chunk)
    EXPECT_EQ(decode<Bu03Parser>(good + good, chunk), (Frames{good, good})) << chunk;
  for (std::size_t length = 0; length < good.size(); ++length) {
    expect_only_good_frames<Bu03Parser>(
        {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)}, good, length);
  }
}

TEST(Bu03, RefusesFramesThatCannotBe) {
  auto bytes = bytes_of(kBu03);
  bytes[36] = 0x54;
  EXPECT_EQ(Bu03::examine(bytes).kind, FrameKind::kNone);
  bytes = bytes_of(kBu03);
  bytes[6] = 0x01;  // 16 779 m
  EXPECT_EQ(Bu03::examine(bytes).kind, FrameKind::kNone);
  bytes = bytes_of(kBu03);
  std::copy_n(bytes.begin(), 3, bytes.begin() + 20);
  EXPECT_EQ(Bu03::examine(bytes).kind, FrameKind::kNone);
}

TEST(Bu03, IsRecognized) {
  const auto good = bytes_of(kBu03);
  EXPECT_EQ(detect_protocol(good + good + good), SerialProtocol::kBu03);
}

}  // namespace
}  // namespace crepes::uwb_protocols_test
