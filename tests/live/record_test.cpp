/// What live daemons measure, recorded and replayed.
#include "daemon/ctl/dataset/record.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/picture_block.hpp"
#include "daemon/recording/recipient.hpp"
#include "daemon/recording/recorder_stage.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "daemon/runtime.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/dataset/csv_file.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::record_test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class Record : public LiveDaemon {
 protected:
  [[nodiscard]] Config recorded_config(std::uint16_t id) const {
    Config config = pair_config(id, mesh_port_);
    config.recording.socket = folder_.path() / ("r" + std::to_string(id) + ".socket");
    return config;
  }
  [[nodiscard]] RecordOptions options(const Config& config, double duration_s) const {
    RecordOptions options;
    options.dir = folder_.path() / ("recording" + std::to_string(config.robot.id.value));
    options.socket = config.recording.socket;
    options.duration_s = duration_s;
    return options;
  }
  /// The socket is there a moment after its daemon.
  void await_socket(const Config& config) const {
    const Timestamp end = machine_.now() + kPatience;
    while (machine_.now() < end && !connect_unix(config.recording.socket)) {
      wait_for(10ms, {});
    }
  }

  ScratchDirectory folder_ = ScratchDirectory::create({}).value();
};

TEST_F(Record, ReplaysTogetherWithTheOtherRobotsRecording) {
  const fs::path key = folder_.path() / "mesh.key";
  ASSERT_TRUE(write_mesh_key(key));
  Config first = recorded_config(1);
  Config second = recorded_config(2);
  first.net.key_file = second.net.key_file = key;
  for (Config* config : {&first, &second}) {
    config->net.robot_key_file =
        folder_.path() / ("robot" + std::to_string(config->robot.id.value) + ".key");
    const PublicKey own = public_key_of(write_robot_key(config->net.robot_key_file).value());
    for (Config* knowing : {&first, &second})
      std::ranges::find(knowing->swarm.members, config->robot.id, &MemberConfig::id)->public_key =
          to_text(own);
  }
  second.sim.clock_offset_s = 7.25;
  second.sim.clock_skew_ppm = 40.0;
  const auto runtime_1 = std::make_unique<Runtime>(first, machine_);
  const auto runtime_2 = std::make_unique<Runtime>(second, machine_);
  expect_true_poses(first);
  std::optional<Result<RecordSummary>> from_thread;
  auto other = std::make_unique<Worker>("record", [&](const std::stop_token& /*stop*/) {
    from_thread = record(options(second, 5.0));
  });
  const auto own = record(options(first, 5.0));
  other.reset();
  const auto& others = from_thread.value();
  ASSERT_TRUE(own) << own.error().message;
  ASSERT_TRUE(others) << others.error().message;
  EXPECT_EQ(own->end_reason, "--duration is over");
  EXPECT_EQ(own->progress.missing, 0U);

  // As swarm.yaml says: the other folder beside this one, and the # off its line.
  const fs::path swarm = options(first, 0).dir;
  fs::rename(others->folder, swarm / "r2");
  std::string manifest = text_of(swarm / "swarm.yaml");
  const std::size_t line = manifest.find("# - {id: 2");
  ASSERT_NE(line, std::string::npos) << manifest;
  std::ofstream(swarm / "swarm.yaml") << manifest.erase(line, 2);
  fs::remove(key);  // a replay needs none

  ReplayOptions replay;
  replay.swarm_dir = swarm;
  replay.out_dir = folder_.path() / "poses";
  const auto replayed = replay_swarm(replay);

  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->robots, 2U);
  EXPECT_GT(replayed->poses, 2 * 50 * 2U);
  DatasetFaults faults;
  auto poses =
      CsvFile::open(folder_.path() / "poses/r1/r2.csv", 31, faults, CsvFile::Header::kPlain)
          .value();
  const SimClock clock(machine_, first.sim);
  int rows = 0;
  int good = 0;
  for (; poses.next(faults); ++rows) {
    std::int64_t t_ns = 0;
    Eigen::Vector3d p_B_N;
    ASSERT_TRUE(poses.read(0, t_ns, faults));
    for (int i = 0; i < 3; ++i)
      ASSERT_TRUE(poses.read(static_cast<std::size_t>(3 + i), p_B_N[i], faults));
    const Pose truth = SimWorld(first.sim).T_B_N(RobotId{1}, RobotId{2},
                                                 clock.world_time_s(Timestamp{Duration{t_ns}}));
    if ((truth.p - p_B_N).norm() < 0.5) ++good;
  }
  EXPECT_GT(rows, 50 * 2);
  EXPECT_GT(good, 0.9 * rows);
}

TEST_F(Record, HasTheClocksInCaseItIsKilled) {
  const Config first = recorded_config(1);
  const Runtime runtime_1(first, machine_);
  const Runtime runtime_2(recorded_config(2), machine_);
  expect_true_poses(first);
  RecordOptions wanted = options(first, to_seconds(kPatience));
  // Before the manifest of the end is written.
  wanted.is_enough = [&] {
    return text_of(wanted.dir / "swarm.yaml").find("# - {id: 2") != std::string::npos;
  };

  const auto recorded = record(wanted);

  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_EQ(recorded->end_reason, "ended");
}

TEST_F(Record, AsksForTheClocksWhereTheDaemonIsReached) {
  const Runtime runtime_2(recorded_config(2), machine_);
  for (const std::vector<std::string>& listen :
       {std::vector<std::string>{"192.0.2.1", "127.0.0.1"}, std::vector<std::string>{"0.0.0.0"}}) {
    SCOPED_TRACE(listen.front());
    Config first = recorded_config(1);
    first.subscription.listen = listen;
    const Runtime runtime_1(first, machine_);
    expect_true_poses(first);
    RecordOptions wanted = options(first, 1.0);
    wanted.dir += listen.front();

    const auto recorded = record(wanted);

    ASSERT_TRUE(recorded) << recorded.error().message;
    EXPECT_EQ(recorded->warning, "");
    const std::string manifest = text_of(wanted.dir / "swarm.yaml");
    EXPECT_NE(manifest.find("# - {id: 2"), std::string::npos) << manifest;
  }
}

TEST_F(Record, SaysThatClocksAreMissing) {
  Config config = recorded_config(1);
  config.subscription.listen.clear();
  const Runtime runtime(config, machine_);
  await_socket(config);

  const auto recorded = record(options(config, 1.0));

  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_NE(recorded->warning.find("no STATUS from"), std::string::npos) << recorded->warning;
}

TEST_F(Record, CanBeReplayedThoughASensorWasSilent) {
  Config config = recorded_config(1);
  config.uwb.noise.max_range_m = 1.0;  // nobody is so near
  const Runtime runtime(config, machine_);
  await_socket(config);

  const auto recorded = record(options(config, 1.0));

  ASSERT_TRUE(recorded) << recorded.error().message;
  const auto dataset = load_swarm(options(config, 0).dir);
  ASSERT_TRUE(dataset) << dataset.error().message;
  EXPECT_TRUE(dataset->robots.at(0).ranges.empty());
  EXPECT_GT(dataset->robots.at(0).imu.size(), 50U);
}

TEST_F(Record, NamesItsFolderThoughTheRobotGetsAnotherName) {
  const Config config = recorded_config(1);
  Runtime runtime(config, machine_);
  await_socket(config);
  RecordOptions wanted = options(config, to_seconds(kPatience));
  int configurations = 0;
  wanted.on_config = [&](const Config&) { ++configurations; };
  wanted.on_rows = [&](const std::string&, std::string_view) {
    if (configurations != 1) return;
    Config renamed = config;
    renamed.swarm.members.at(0).name = "renamed";
    (void)runtime.reconfigure(renamed);
  };
  wanted.is_enough = [&] { return configurations > 1; };

  const auto recorded = record(wanted);

  ASSERT_TRUE(recorded) << recorded.error().message;
  const auto dataset = load_swarm(wanted.dir);
  ASSERT_TRUE(dataset) << dataset.error().message;
  EXPECT_EQ(dataset->robots.at(0).robot.name, "renamed");
}

TEST_F(Record, FailsIfItsFolderIsRemoved) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  RecordOptions wanted = options(config, to_seconds(kPatience));
  bool is_removed = false;
  wanted.on_progress = [&](const RecordProgress& progress) {
    if (progress.rows > 100 && !std::exchange(is_removed, true)) fs::remove_all(wanted.dir);
  };

  const auto recorded = record(wanted);

  ASSERT_FALSE(recorded);
  EXPECT_NE(recorded.error().message.find("was removed"), std::string::npos);
  EXPECT_FALSE(fs::exists(wanted.dir / "swarm.yaml"));
}

TEST_F(Record, ListensAgainWhereItsSocketWas) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  fs::remove(config.recording.socket);

  await_socket(config);

  EXPECT_TRUE(connect_unix(config.recording.socket));
}

TEST_F(Record, WritesPicturesThatTheDataSetReaderFinds) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  RecordOptions wanted = options(config, 2.0);
  wanted.pictures = true;

  const auto recorded = record(wanted);

  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_GT(recorded->progress.pictures, 0U);
  const auto dataset = load_swarm(wanted.dir);
  ASSERT_TRUE(dataset) << dataset.error().message;
  EXPECT_TRUE(dataset->faults.empty()) << dataset->faults.list().front();
  const CameraRecording& camera = dataset->robots.at(0).cameras.at(0);
  EXPECT_EQ(camera.images.size(), recorded->progress.pictures);
  EXPECT_GT(camera.spots.size(), 20U);
  EXPECT_GT(dataset->robots[0].imu.size(), 50U);
}

/// The next block of a kind.
Block next_block(BlockStream& daemon, const std::string& kind, Timestamp end,
                 const Clock& machine) {
  while (machine.now() < end) {
    auto block = daemon.next();
    if (!block) break;
    if (*block && (*block)->kind == kind) return std::move(**block);
    if (!*block && !daemon.receive(50).value_or(false)) break;
  }
  ADD_FAILURE() << "no " << kind;
  return {};
}

TEST_F(Record, ShowsAPictureToWhoLooksBesideARecording) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  const Runtime other(recorded_config(2), machine_);
  await_socket(config);
  expect_true_poses(config);
  BlockStream recording(connect_unix(config.recording.socket).value());
  ASSERT_TRUE(recording.request(kPicturesRequest));
  BlockStream looker(connect_unix(config.recording.socket).value());
  const Timestamp end = machine_.now() + kPatience;

  ASSERT_TRUE(looker.request("LOOK 1 0"));
  EXPECT_NE(next_block(looker, "config", end, machine_).content.find("cameras:"),
            std::string::npos);
  Json head;
  // A board may be dark in a picture, and the other robot may be out of it.
  while (machine_.now() < end && (head.is_null() || head["robots"].empty())) {
    const std::string look = next_block(looker, "look", end, machine_).content;
    head = Json::parse(look.substr(0, look.find('\n')));
    const std::size_t pixels = look.size() - look.find('\n') - 1;
    ASSERT_EQ(pixels, head["width"].get<std::size_t>() * head["height"].get<std::size_t>());
    ASSERT_TRUE(looker.request("LOOK 1 0"));
  }
  EXPECT_EQ(head["robots"][0][0], 2);
  EXPECT_FALSE(head["spots"].empty());
  EXPECT_GT(head["threshold"].get<int>(), head["background"].get<int>());
  EXPECT_LE(head["width"].get<int>(), kMaxLookSide);
  EXPECT_FALSE(next_block(recording, "picture", end, machine_).content.empty());
}

TEST_F(Record, EndsAfterItsDurationThoughNothingIsMeasured) {
  Config config = without_devices(mesh_port_);
  config.recording.socket = folder_.path() / "r1.socket";
  const Runtime runtime(config, machine_);
  await_socket(config);
  const Timestamp start = machine_.now();

  const auto summary = record(options(config, 0.5));

  EXPECT_LT(machine_.now() - start, kPatience);
  const std::string why = summary ? summary->end_reason : summary.error().message;
  EXPECT_NE(why.find("--duration is over"), std::string::npos) << why;
}

TEST_F(Record, StopsAtItsSizeAndRefusesToWriteOverADataSet) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  RecordOptions wanted = options(config, 60.0);
  wanted.max_bytes = 30'000;

  const auto recorded = record(wanted);

  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_EQ(recorded->end_reason, "--max-size is reached");
  EXPECT_LT(recorded->progress.bytes, 100'000U);
  EXPECT_FALSE(record(wanted));
}

TEST_F(Record, FailsWithAFullDiskAndTheDaemonDoesNotNotice) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  RecordOptions wanted = options(config, 60.0);
  fs::create_directories(wanted.dir / "r1/imu0");
  fs::create_symlink("/dev/full", wanted.dir / "r1/imu0/data.csv");

  const auto recorded = record(wanted);

  ASSERT_FALSE(recorded);
  EXPECT_NE(recorded.error().message.find("No space left on device"), std::string::npos);
  EXPECT_TRUE(Client(config).await_status([](const Json& status) {
    return status["queues"].value("events", 0) == 0 && sensor_of(status, "imu").value("ok", false);
  }));
}

TEST_F(Record, DropsTheNewestForAToolThatDoesNotReadAndReportsHowMany) {
  const Config config = recorded_config(1);
  RecordQueue events{100, Overflow::kDropNewest};
  std::deque<PictureTap> pictures;
  PictureRobotsQueue robots{1, Overflow::kDropOldest};
  Counter turns;
  LiveSettings<Config> settings(config);
  const StageContext context{machine_, [](SensorStatus) {}, turns};
  const Worker recorder("recorder", [&](const std::stop_token& stop) {
    run_recorder({settings, events, pictures, robots}, context, stop);
  });
  await_socket(config);
  UniqueFd lazy = connect_unix(config.recording.socket).value();
  const std::string request = std::string(kRecordRequest) + "\n";
  ASSERT_GT(::send(lazy.get(), request.data(), request.size(), 0), 0);
  std::int64_t sent = 0;
  const auto measure = [&] {
    SpotFrame frame{Timestamp{Duration{++sent}}, 0, {}};
    frame.spots.resize(100);
    events.push(frame);
  };

  const Timestamp end = machine_.now() + kPatience;
  while (machine_.now() < end && events.dropped() < 50) {
    for (int i = 0; i < 50; ++i) measure();
    wait_for(1ms, {});
  }
  EXPECT_GE(events.dropped(), 50U);  // while pushing went on all the time

  std::string heard;
  std::vector<char> chunk(1 << 20);
  std::size_t gap = std::string::npos;
  while (machine_.now() < end && gap == std::string::npos) {
    measure();  // a gap is reported before the next rows
    const ssize_t count = ::recv(lazy.get(), chunk.data(), chunk.size(), MSG_DONTWAIT);
    if (count < 0 && errno == EAGAIN) {
      wait_for(1ms, {});
      continue;
    }
    ASSERT_GT(count, 0);
    heard.append(chunk.data(), static_cast<std::size_t>(count));
    gap = heard.find("\ngap ");
  }
  ASSERT_NE(gap, std::string::npos);
  EXPECT_GT(std::stoi(heard.substr(heard.find('\n', gap + 1) + 1, 10)), 0);
}

TEST_F(Record, SaysWhenThereIsNoDaemonOrAnotherRecording) {
  const Config config = recorded_config(1);
  const auto nobody = record(options(config, 1.0));
  ASSERT_FALSE(nobody);
  EXPECT_NE(nobody.error().message.find("is crepesd running"), std::string::npos);

  const Runtime runtime(config, machine_);
  await_socket(config);
  BlockStream first(connect_unix(config.recording.socket).value());
  ASSERT_TRUE(first.request(kRecordRequest));
  const Timestamp end = machine_.now() + kPatience;
  std::string message;
  while (machine_.now() < end && message.find("under way") == std::string::npos) {
    const auto second = record(options(config, 0.1));
    message = second ? "" : second.error().message;
    if (second) fs::remove_all(options(config, 1.0).dir);
  }
  EXPECT_NE(message.find("another recording is under way"), std::string::npos);
}

TEST_F(Record, SurvivesToolsThatTalkNonsense) {
  const Config config = recorded_config(1);
  const Runtime runtime(config, machine_);
  await_socket(config);
  for (const std::string& request :
       {std::string("GET /\n"), std::string(5000, 'x'), std::string("RECORD 1\nRECORD 1\n"),
        std::string(), std::string("LOOK 1 x\n"), std::string("LOOK 1 999\n"),
        std::string("LOOK 1 7\nGET /\n")}) {
    const UniqueFd tool = connect_unix(config.recording.socket).value();
    ::send(tool.get(), request.data(), request.size(), MSG_NOSIGNAL);
  }

  const Timestamp end = machine_.now() + kPatience;
  Result<RecordSummary> recorded = record(options(config, 0.3));
  while (!recorded && machine_.now() < end) recorded = record(options(config, 0.3));

  EXPECT_TRUE(recorded) << recorded.error().message;
}

}  // namespace
}  // namespace crepes::record_test
