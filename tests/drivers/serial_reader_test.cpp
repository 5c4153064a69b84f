#include "drivers/serial/serial_reader.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "drivers/uwb/nlink.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/recorded_frames.hpp"

namespace crepes::serial_reader_test {
namespace {

using namespace std::chrono_literals;

class SerialReaderTest : public testing::Test {
 protected:
  void SetUp() override {
    auto line = PseudoTerminal::open();
    ASSERT_TRUE(line) << line.error().message;
    line_ = std::make_unique<PseudoTerminal>(std::move(*line));
  }

  template <class Parser>
  SerialReader<Parser> reader(Parser parser, typename SerialReader<Parser>::Sink sink) {
    auto port = SerialPort::open(line_->path(), 921600);
    EXPECT_TRUE(port) << port.error().message;
    return SerialReader<Parser>(std::move(*port), std::move(parser), clock_, std::move(sink));
  }

  SerialReader<NlinkParser> uwb_reader() {
    return reader(NlinkParser({{0, RobotId{1}}, {1, RobotId{2}}}, 200.0),
                  [this](const UwbRange& range) { ranges_.push_back(range); });
  }

  void send(const std::vector<std::uint8_t>& bytes) {
    ASSERT_EQ(line_->write(bytes), bytes.size());
  }

  ManualClock clock_;
  std::unique_ptr<PseudoTerminal> line_;
  std::vector<UwbRange> ranges_;
};

TEST_F(SerialReaderTest, StampsMeasurementsWithTheArrivalOfTheirLastByte) {
  auto reader = uwb_reader();
  const auto frame = recorded_node_frame3();
  const auto middle = frame.begin() + 30;

  clock_.set(Timestamp{1s});
  send({frame.begin(), middle});
  ASSERT_TRUE(reader.read_once(1s));
  EXPECT_TRUE(ranges_.empty());
  clock_.set(Timestamp{2s});
  send({middle, frame.end()});
  ASSERT_TRUE(reader.read_once(1s));

  ASSERT_EQ(ranges_.size(), 2U);
  EXPECT_EQ(ranges_[0].stamp, Timestamp{2s});
}

TEST_F(SerialReaderTest, PassesEveryByteUnchanged) {
  // Control characters would be swallowed by a line that is not raw.
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  auto port = SerialPort::open(line_->path(), 115200);
  ASSERT_TRUE(port);
  send(all);

  std::vector<std::uint8_t> got;
  while (got.size() < all.size()) {
    const auto chunk = port->read_some(1s);
    ASSERT_TRUE(chunk);
    ASSERT_FALSE(chunk->empty());
    got.insert(got.end(), chunk->begin(), chunk->end());
  }

  EXPECT_EQ(got, all);
}

TEST_F(SerialReaderTest, ReturnsWithoutErrorWhenNothingComes) {
  auto reader = uwb_reader();

  EXPECT_TRUE(reader.read_once(1ms));
  EXPECT_FALSE(reader.diagnosis());
}

TEST_F(SerialReaderTest, FindsMeasurementsAmongGarbageAndSaysHowMuchItSkipped) {
  auto reader = uwb_reader();
  send(bytes_of("55 05 ff 00 aa") + recorded_node_frame3());

  ASSERT_TRUE(reader.read_once(1s));

  EXPECT_EQ(ranges_.size(), 2U);
  EXPECT_EQ(reader.counts().skipped_bytes, 5U);
}

TEST_F(SerialReaderTest, ReportsThatTheDeviceHungUp) {
  auto reader = uwb_reader();
  const std::string path = line_->path();
  line_.reset();

  const auto result = reader.read_once(1s);

  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kIo);
  EXPECT_EQ(result.error().message, path + ": hung up");
}

TEST_F(SerialReaderTest, SaysThatAModuleIsInAnotherModeUntilItIsNot) {
  auto reader = uwb_reader();
  send(bytes_of("ff 02 11 22 33 ff 02 11 22 33 ff 02 11 22 33"));
  ASSERT_TRUE(reader.read_once(1s));
  ASSERT_TRUE(reader.diagnosis());
  EXPECT_NE(reader.diagnosis()->find("ff 02"), std::string::npos);

  send(recorded_node_frame3());
  ASSERT_TRUE(reader.read_once(1s));

  EXPECT_FALSE(reader.diagnosis());
}

TEST_F(SerialReaderTest, SuspectsTheBaudRateWhenNoFrameIsFoundForASecond) {
  auto reader = this->reader(WitMotionParser(), [](const ImuSample&) {});
  send(std::vector<std::uint8_t>(100, 0xe0));

  ASSERT_TRUE(reader.read_once(1s));
  EXPECT_FALSE(reader.diagnosis());
  clock_.set(Timestamp{1s});

  ASSERT_TRUE(reader.diagnosis());
  EXPECT_NE(reader.diagnosis()->find("wrong baud rate"), std::string::npos);
}

TEST_F(SerialReaderTest, NamesWhatSpeaksInsteadOfTheConfiguredDevice) {
  auto reader = uwb_reader();
  send(recorded_witmotion() + recorded_witmotion() + recorded_witmotion());

  ASSERT_TRUE(reader.read_once(1s));
  clock_.set(Timestamp{1s});

  EXPECT_EQ(reader.diagnosis(), line_->path() + ": another kind of device: it speaks witmotion");
}

TEST_F(SerialReaderTest, ReportsWhyFramesHoldNoMeasurement) {
  auto reader = this->reader(NlinkParser({}, 200.0), [](const UwbRange&) {});
  clock_.set(Timestamp{1s});
  send(recorded_node_frame3());

  ASSERT_TRUE(reader.read_once(1s));

  ASSERT_TRUE(reader.diagnosis());
  EXPECT_NE(reader.diagnosis()->find("no member carries"), std::string::npos);
}

TEST_F(SerialReaderTest, DiscardsBytesReceivedBeforeOpening) {
  send(recorded_node_frame3());
  auto reader = uwb_reader();

  EXPECT_TRUE(reader.read_once(1ms));

  EXPECT_TRUE(ranges_.empty());
}

TEST_F(SerialReaderTest, OpensTheDeviceExclusively) {
  auto reader = uwb_reader();

  const auto second = SerialPort::open(line_->path(), 921600);

  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find(line_->path() + ": in use by drivers_test ("),
            std::string::npos)
      << second.error().message;
}

TEST_F(SerialReaderTest, NamesDeviceAndCauseWhenItCannotOpen) {
  EXPECT_EQ(SerialPort::open("/dev/no-such-device", 115200).error().message,
            "/dev/no-such-device: No such file or directory");
  EXPECT_EQ(SerialPort::open("/dev/no-such-device", 115200).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(SerialPort::open("/dev/null", 115200).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace crepes::serial_reader_test
