#include "daemon/ctl/dataset/record.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <string>
#include <utility>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::record_test {
namespace {

using namespace std::chrono_literals;

constexpr int kMostLooks = 30;  // of a tenth of a second: more than enough for a second

/// The daemon's end of the socket. It speaks whenever the recording asks whether it is enough.
class Record : public testing::Test {
 protected:
  /// Records until `is_enough`, which is asked once the configuration has been sent.
  [[nodiscard]] Result<RecordSummary> run(const std::function<bool()>& is_enough) {
    RecordOptions options;
    options.dir = dir();
    options.socket = socket_path();
    options.is_enough = [&] {
      if (daemon_) return ++looks_ > kMostLooks || is_enough();
      daemon_ = UniqueFd(::accept(listener_.get(), nullptr, nullptr));
      send("config", swarm_.read("r1/crepesd.yaml") + "subscription: {listen: []}\n");
      return false;
    };
    return record(options);
  }
  /// One sample each 10 ms of the robot's clock, so many milliseconds after it began.
  void send_samples(int from_ms, int to_ms) const {
    std::string rows;
    for (int ms = from_ms; ms < to_ms; ms += 10) {
      append_rows(rows, ImuSample{.stamp = Timestamp{10s + ms * 1ms},
                                  .gyro_radps = {0.1, 0.2, 0.3},
                                  .accel_mps2 = {0.01, -0.02, 9.81}});
    }
    send("imu0", rows);
  }
  /// What `crepesctl replay` would find now; 0 if there is no data set.
  [[nodiscard]] std::size_t readable_samples() const {
    const Result<SwarmDataset> swarm = load_swarm(dir());
    return swarm ? swarm->robots.front().imu.size() : 0;
  }
  [[nodiscard]] std::filesystem::path dir() const { return scratch_.path() / "recording"; }
  [[nodiscard]] int looks() const { return looks_; }

 private:
  [[nodiscard]] std::filesystem::path socket_path() const { return scratch_.path() / "socket"; }
  void send(std::string_view kind, const std::string& content) const {
    std::string block;
    append_block(block, kind, content);
    EXPECT_EQ(::send(daemon_.get(), block.data(), block.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(block.size()));
  }

  TinySwarm swarm_;
  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
  UniqueFd listener_ = listen_unix(socket_path()).value();
  UniqueFd daemon_;
  int looks_ = 0;
};

/// No file may have more bytes; a disk that is full refuses to write in the same way.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : former_signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &former_), 0);
    const rlimit limit{bytes, former_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  FileSizeLimit(FileSizeLimit&&) = delete;
  FileSizeLimit& operator=(FileSizeLimit&&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &former_);
    std::signal(SIGXFSZ, former_signal_);
  }

 private:
  rlimit former_{};
  void (*former_signal_)(int);
};

TEST_F(Record, IsADataSetFromTheFirstMeasurementOn) {
  std::size_t readable = 0;

  const auto summary = run([&] {
    if (looks() == 1) send_samples(0, 200);
    if (looks() == 4) readable = readable_samples();  // killed here, it would be what is left
    return readable > 0;
  });

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(readable, 20U);
}

TEST_F(Record, RefusesTheFolderOfARobotThatWasRecorded) {
  std::filesystem::create_directories(dir());
  std::ofstream(dir() / "crepesd.yaml") << "robot: {id: 1}\n";

  const auto summary = run([] { return true; });

  ASSERT_FALSE(summary);
  EXPECT_NE(summary.error().message.find("has a data set already"), std::string::npos);
}

TEST_F(Record, KeepsAllButTheLastSecondWhateverEndsIt) {
  std::size_t readable = 0;

  const auto summary = run([&] {
    if (looks() == 1) send_samples(0, 200);
    if (looks() == 4) send_samples(200, 10000);
    readable = readable_samples();
    return readable == 1000;
  });

  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(readable, 1000U);
  EXPECT_LT(looks(), kMostLooks);
}

TEST_F(Record, SaysThatTheDiskIsFullAndKeepsWhatIsThere) {
  std::optional<FileSizeLimit> full;

  const auto summary = run([&] {
    if (looks() == 1) send_samples(0, 200);
    if (looks() == 4) {
      full.emplace(4000);
      send_samples(200, 1900);
    }
    return false;
  });
  full.reset();

  ASSERT_FALSE(summary);
  EXPECT_NE(summary.error().message.find("imu0/data.csv: File too large"), std::string::npos)
      << summary.error().message;
  EXPECT_NE(summary.error().message.find("s until then are in"), std::string::npos)
      << summary.error().message;
  EXPECT_GT(readable_samples(), 20U);
}

}  // namespace
}  // namespace crepes::record_test
