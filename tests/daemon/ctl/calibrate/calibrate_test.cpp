/// crepesctl calibrate, from the files of a recording to the files of a configuration.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/calibrate_camera.hpp"
#include "daemon/ctl/calibrate/calibrate_imu.hpp"
#include "daemon/ctl/calibrate/calibrate_range.hpp"
#include "daemon/ctl/calibrate/calibrate_swarm.hpp"
#include "daemon/ctl/calibrate/camera_coverage.hpp"
#include "daemon/ctl/calibrate/record_for_camera.hpp"
#include "daemon/ctl/setup/init.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/sleep.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/camera_model.hpp"
#include "tests/support/calibration_recording.hpp"
#include "tests/support/calibration_swarm.hpp"

namespace crepes::calibrate_test {
namespace {

namespace fs = std::filesystem;

/// A configuration as crepesctl init writes it, and a recording made with it.
class Calibrate : public testing::Test {
 protected:
  Calibrate() {
    InitOptions options;
    options.dir = etc();
    options.id = 1;
    options.robots = 3;
    options.p_body_led = {0.06, 0.0, 0.01};
    options.search_devices = false;
    options.interface = "lo";
    std::ostringstream nobody;
    Questions questions(nullptr, nobody);
    EXPECT_TRUE(init(options, questions));
  }

  [[nodiscard]] fs::path etc() const { return scratch_.path() / "etc"; }
  [[nodiscard]] fs::path robot_dir(int id) const {
    return scratch_.path() / ("r" + std::to_string(id));
  }
  [[nodiscard]] Config config() const { return load_config(etc() / "crepesd.yaml").value(); }

  void write_robot(int id, const std::vector<ImuSample>& imu) const {
    RobotFolder folder(robot_dir(id));
    Config own = config();
    own.robot.id = RobotId{static_cast<std::uint16_t>(id)};
    ASSERT_TRUE(folder.write_config(write_config(own)));
    std::string rows;
    for (const ImuSample& sample : imu) append_rows(rows, sample);
    ASSERT_TRUE(folder.append("imu0", rows));
  }

  /// Boards 2 and 3 blink their patterns from a phase of their own.
  [[nodiscard]] std::map<Timestamp, SpotFrame> frames_of(
      const simulated::CameraRecording& recording) const {
    constexpr double kSlot = 10e-3;
    const std::vector<MemberConfig> members = config().swarm.members;
    std::map<Timestamp, SpotFrame> frames;
    for (const BoardSighting& sighting : recording.sightings) {
      SpotFrame& frame = frames[sighting.stamp];
      frame.stamp = sighting.stamp;
      const std::string& pattern = *members.at(sighting.board + 1).pattern;
      const double t_s = to_seconds(sighting.stamp.time_since_epoch()) +
                         0.0037 * static_cast<double>(1 + sighting.board);
      const auto slot = static_cast<std::size_t>(t_s / kSlot) % pattern.size();
      if (pattern[slot] == '1')
        frame.spots.push_back({sighting.uv.x(), sighting.uv.y(), 12.0, 200.0, 1.0});
    }
    return frames;
  }
  void write_spots(const simulated::CameraRecording& recording) const {
    std::string rows;
    for (const auto& [stamp, frame] : frames_of(recording)) append_rows(rows, frame);
    RobotFolder folder(robot_dir(1));
    ASSERT_TRUE(folder.append("cam0", rows));
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

/// RMS over the field of view of what a direction of the body is seen wrong by.
double error_px(const CameraCalibration& found, const CameraConstants& truth) {
  const CameraModel model = CameraModel::from(found).value();
  CameraCalibration exact = found;
  exact.camera_model = CameraModelKind::kDoubleSphere;
  exact.distortion_model = DistortionModel::kNone;
  exact.distortion_coeffs.clear();
  exact.intrinsics.assign(truth.lens.begin(), truth.lens.end());
  const CameraModel true_model = CameraModel::from(exact).value();
  double sum = 0.0;
  double count = 0.0;
  for (double u = 200.0; u < 1100.0; u += 100.0) {
    for (double v = 100.0; v < 1000.0; v += 100.0) {
      const auto u_C = true_model.unproject({u, v});
      if (!u_C) continue;
      const Eigen::Vector3d u_B = truth.q_C_B.conjugate() * *u_C;
      const auto seen = model.project(found.T_cam_imu.q * u_B);
      if (!seen) return 1e3;
      sum += (*seen - Eigen::Vector2d(u, v)).squaredNorm();
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

TEST_F(Calibrate, MakesOfAGuessedCameraACalibratedOneOfKannalaAndBrandt) {
  const ImuNoise noise;
  const auto recording = simulated::hand_held(3, {.dark_share = 0.0}, noise);
  write_robot(1, recording.imu);
  write_spots(recording);
  const CameraCalibration guess = config().cameras[0].calibration;
  ASSERT_FALSE(guess.calibrated);
  ASSERT_GT(error_px(guess, recording.truth), 20.0);

  const auto report = calibrate_camera({.robot_dir = robot_dir(1),
                                        .out = etc() / "camchain-imucam.yaml",
                                        .fov_deg = {},
                                        .kannala_brandt = true,
                                        .json = false,
                                        .on_progress = {}});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  const CameraCalibration found = config().cameras[0].calibration;
  EXPECT_TRUE(found.calibrated);
  EXPECT_EQ(found.camera_model, CameraModelKind::kPinhole);
  EXPECT_LT(error_px(found, recording.truth), 0.5);
  EXPECT_LT(kDegPerRad * found.T_cam_imu.q.angularDistance(recording.truth.q_C_B), 0.05);
  EXPECT_NEAR(found.timeshift_cam_imu, recording.truth.shift_s, 1e-4);
}

TEST_F(Calibrate, WritesNoCameraFromATurnOnASwivelChair) {
  const ImuNoise noise;
  const auto recording = simulated::hand_held(3, {.is_chair = true, .dark_share = 0.0}, noise);
  write_robot(1, recording.imu);
  write_spots(recording);
  const fs::path out = scratch_.path() / "camera.yaml";

  const auto report = calibrate_camera({.robot_dir = robot_dir(1),
                                        .out = out,
                                        .fov_deg = {},
                                        .kannala_brandt = false,
                                        .json = true,
                                        .on_progress = {}});

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_FALSE(report->reasons.empty());
  EXPECT_NE(report->reasons.front().find("hardly turned about x"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
  const auto json = nlohmann::json::parse(report->text);
  EXPECT_FALSE(json["ok"]);
  EXPECT_EQ(json["reasons"].size(), report->reasons.size());
}

/// All of a recording.
void add_to(CameraCoverage& coverage, const std::vector<ImuSample>& imu,
            const std::map<Timestamp, SpotFrame>& frames) {
  for (const ImuSample& sample : imu) coverage.add(sample);
  for (const auto& [stamp, frame] : frames) coverage.add(frame);
}

TEST_F(Calibrate, CoverageNamesTheTurnsThatASwivelChairLacks) {
  const auto chair = simulated::hand_held(3, {.is_chair = true, .dark_share = 0.0}, ImuNoise{});
  auto coverage = CameraCoverage::of(config()).value();
  EXPECT_NE(coverage.missing().at(0).find("no board"), std::string::npos);

  add_to(coverage, chair.imu, frames_of(chair));

  EXPECT_LT(coverage.share(), 1.0);
  EXPECT_EQ(coverage.boards(), (std::set{RobotId{2}, RobotId{3}}));
  const std::string text = coverage_text(coverage);
  EXPECT_NE(text.find("turn more about x (roll)"), std::string::npos) << text;
  EXPECT_NE(text.find("turn more about y (pitch)"), std::string::npos) << text;
  EXPECT_EQ(text.find("turn more about z"), std::string::npos) << text;
}

/// A daemon's socket of recordings that sends a recording, a second of it at a time.
class FakeDaemon {
 public:
  FakeDaemon(const fs::path& socket, const Config& config, const std::vector<ImuSample>& imu,
             const std::map<Timestamp, SpotFrame>& frames)
      : listener_(listen_unix(socket).value()) {
    append_block(blocks_.emplace_back(), "config", write_config(config));
    auto sample = imu.begin();
    auto frame = frames.begin();
    for (Timestamp end = imu.front().stamp; sample != imu.end();) {
      end += std::chrono::seconds{1};
      std::string imu_rows;
      std::string spot_rows;
      for (; sample != imu.end() && sample->stamp < end; ++sample) append_rows(imu_rows, *sample);
      for (; frame != frames.end() && frame->first < end; ++frame)
        append_rows(spot_rows, frame->second);
      std::string& block = blocks_.emplace_back();
      if (!imu_rows.empty()) append_block(block, "imu0", imu_rows);
      if (!spot_rows.empty()) append_block(block, "cam0", spot_rows);
    }
    thread_ = std::thread([this] { serve(); });
  }
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;
  FakeDaemon(FakeDaemon&&) = delete;
  FakeDaemon& operator=(FakeDaemon&&) = delete;
  ~FakeDaemon() { thread_.join(); }

 private:
  void serve() {
    constexpr int kPatienceMs = 10'000;
    pollfd calls{.fd = listener_.get(), .events = POLLIN, .revents = 0};
    if (::poll(&calls, 1, kPatienceMs) != 1) return;
    const UniqueFd tool(::accept(listener_.get(), nullptr, nullptr));
    std::array<char, 256> request{};
    if (::recv(tool.get(), request.data(), request.size(), 0) <= 0) return;
    for (const std::string& block : blocks_) {
      for (std::size_t at = 0; at < block.size();) {
        const ssize_t sent = ::send(tool.get(), block.data() + at, block.size() - at, MSG_NOSIGNAL);
        if (sent <= 0) return;
        at += static_cast<std::size_t>(sent);
      }
      sleep_for(std::chrono::milliseconds{5});
    }
  }

  UniqueFd listener_;
  std::vector<std::string> blocks_;
  std::thread thread_;
};

TEST_F(Calibrate, LiveRecordsUntilTheCameraHasSeenEnoughAndThenCalibrates) {
  const auto recording = simulated::hand_held(3, {.dark_share = 0.0}, ImuNoise{});
  const fs::path socket = scratch_.path() / "record.socket";
  testing::internal::CaptureStdout();
  Result<fs::path> folder = fail(ErrorCode::kIo, "not recorded");
  {
    const FakeDaemon daemon(socket, config(), recording.imu, frames_of(recording));
    folder =
        record_for_camera({.dir = scratch_.path() / "live", .socket = socket, .is_quiet = true});
  }
  const std::string lines = testing::internal::GetCapturedStdout();

  ASSERT_TRUE(folder) << folder.error().message;
  EXPECT_EQ(lines, "");  // with --json, the result is the only object
  const auto report = calibrate_camera({.robot_dir = *folder,
                                        .out = etc() / "camchain-imucam.yaml",
                                        .fov_deg = {},
                                        .kannala_brandt = false,
                                        .json = false,
                                        .on_progress = {}});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  EXPECT_LT(error_px(config().cameras[0].calibration, recording.truth), 0.5);
}

TEST_F(Calibrate, LiveSaysWhenThereIsNoDaemon) {
  const auto folder = record_for_camera({.dir = scratch_.path() / "live",
                                         .socket = scratch_.path() / "none.socket",
                                         .is_quiet = true});
  ASSERT_FALSE(folder);
  EXPECT_NE(folder.error().message.find("is crepesd running"), std::string::npos);
}

TEST_F(Calibrate, WritesWhatTheImuIsOffByAsAFragment) {
  const ImuNoise noise;
  const auto recording = simulated::imu_protocol(1, {}, noise);
  write_robot(1, recording.samples);
  const fs::path out = scratch_.path() / "imu.yaml";

  const auto report = calibrate_imu({.robot_dir = robot_dir(1), .out = out});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  fs::copy_file(out, etc() / "crepesd.d" / "20-imu.yaml");
  const ImuDeviceConfig imu = config().imu.device;
  const Eigen::Matrix3d T_K = imu.accelerometer.misalignment * imu.accelerometer.scale.asDiagonal();
  EXPECT_LT((imu.accelerometer.bias - recording.errors.accel_bias).norm(), 3e-3);  // m/s^2
  EXPECT_TRUE((T_K * recording.errors.S_accel).isIdentity(1e-3));
  EXPECT_TRUE(fs::exists(scratch_.path() / "imu.kalibr.yaml"));
}

TEST_F(Calibrate, RefusesTooFewAttitudes) {
  const auto recording = simulated::imu_protocol(1, {.attitudes = 4}, ImuNoise{});
  write_robot(1, recording.samples);
  const fs::path out = scratch_.path() / "imu.yaml";

  const auto report = calibrate_imu({.robot_dir = robot_dir(1), .out = out});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->reasons.empty());
  EXPECT_FALSE(fs::exists(out));
}

/// Robots at rest in a triangle of 3, 4 and 5 m, whose modules have antenna delays.
class CalibrateRange : public Calibrate {
 protected:
  void write_swarm(int robots) const {
    std::ostringstream swarm;
    swarm << "scenario: rest\nseed: 1\nduration_s: 21\n"
             "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 0.0, seed: 7}\nrobots:\n";
    for (int id = 1; id <= robots; ++id) {
      swarm << "- {id: " << id << ", name: r" << id << ", dir: r" << id
            << ", clock: {offset_s: 0.0, skew_ppm: 0.0}}\n";
      const ImuSample rest{.stamp = Timestamp{},
                           .gyro_radps = Eigen::Vector3d::Zero(),
                           .accel_mps2 = {0.0, 0.0, 9.81}};
      write_robot(id, {rest});
      RobotFolder folder(robot_dir(id));
      ASSERT_TRUE(folder.append("uwb0", ranges_of(id, robots)));
      std::string no_spots;
      append_rows(no_spots, SpotFrame{.stamp = Timestamp{}, .camera = 0, .spots = {}});
      ASSERT_TRUE(folder.append("cam0", no_spots));
    }
    std::ofstream(scratch_.path() / "swarm.yaml") << swarm.str();
    std::ofstream tape(scratch_.path() / "tape.yaml");
    tape << "segments:\n- {from_s: 0, to_s: 20, pairs: [{ids: [1, 2], distance_m: 3.0}";
    if (robots == 3) tape << ", {ids: [2, 3], distance_m: 4.0}, {ids: [1, 3], distance_m: 5.0}";
    tape << "]}\n";
  }

  [[nodiscard]] Result<CalibrationReport> run() const {
    return calibrate_range({.swarm_dir = scratch_.path(),
                            .tape = scratch_.path() / "tape.yaml",
                            .out = etc() / "ranges.yaml"});
  }
  [[nodiscard]] Result<CalibrationReport> run_with(
      const std::vector<std::string>& distances) const {
    return calibrate_range(
        {.swarm_dir = scratch_.path(), .distances = distances, .out = etc() / "ranges.yaml"});
  }
  /// What the command is for: the fragment where the daemon reads it.
  [[nodiscard]] Config config_with_fragment() const {
    fs::copy_file(etc() / "ranges.members.yaml", etc() / "crepesd.d" / "30-ranges.yaml");
    return config();
  }

  static constexpr std::array<double, 4> kDelays{0.0, 0.10, 0.25, -0.05};  // by id

 private:
  [[nodiscard]] static std::string ranges_of(int id, int robots) {
    simulated::Dice dice(static_cast<std::uint64_t>(id));
    std::string rows;
    for (int i = 0; i < 400; ++i) {
      for (int other = 1; other <= robots; ++other) {
        if (other == id) continue;
        const double distance = id + other == 3 ? 3.0 : id + other == 5 ? 4.0 : 5.0;
        append_rows(rows, UwbRange{.stamp = Timestamp{std::chrono::milliseconds{50 * i}},
                                   .neighbor = RobotId{static_cast<std::uint16_t>(other)},
                                   .range_m = distance + kDelays.at(static_cast<std::size_t>(id)) +
                                              kDelays.at(static_cast<std::size_t>(other)) +
                                              dice.normal(0.05),
                                   .first_path_dbm = -81.0,
                                   .received_dbm = -79.0});
      }
    }
    return rows;
  }
};

TEST_F(CalibrateRange, WritesTheAntennaDelayOfEveryModule) {
  write_swarm(3);

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  const Config config = config_with_fragment();
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(config.swarm.members[i].range_delay_m, kDelays.at(i + 1), 0.01) << i;
  EXPECT_LT(config.uwb.noise.bias_sigma_m, 0.1);
  EXPECT_EQ(config.swarm.members[1].name, "r2");
}

TEST_F(CalibrateRange, GivesEachOfTwoRobotsHalfOfTheirBias) {
  write_swarm(2);

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  const Config config = config_with_fragment();
  EXPECT_NEAR(config.swarm.members[0].range_delay_m, 0.175, 0.01);
  EXPECT_EQ(config.swarm.members[0].range_delay_m, config.swarm.members[1].range_delay_m);
  EXPECT_EQ(config.swarm.members[2].range_delay_m, 0.0);
}

TEST_F(CalibrateRange, TakesDistancesFromTheCommandLineByNameOrId) {
  write_swarm(3);

  const auto report = run_with({"r1,r2=3.00", "3,r2=4.00", "1,3=5.00"});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->reasons.empty()) << report->reasons.front();
  const Config config = config_with_fragment();
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(config.swarm.members[i].range_delay_m, kDelays.at(i + 1), 0.01) << i;
  EXPECT_NE(report->text.find("ranges.members.yaml"), std::string::npos);
}

TEST_F(CalibrateRange, SaysWhatIsWrongWithADistance) {
  write_swarm(2);
  for (const std::string text : {"r1=3.0", "r1,r9=3.0", "r1,r1=3.0", "r1,r2=far", "r1,r2=-3"}) {
    const auto report = run_with({text});
    ASSERT_FALSE(report) << text;
    EXPECT_EQ(report.error().code, ErrorCode::kUsage);
    EXPECT_NE(report.error().message.find(text), std::string::npos) << report.error().message;
  }
}

TEST_F(CalibrateRange, WritesTheNoiseThatTheRangesHave) {
  write_swarm(3);

  ASSERT_TRUE(run());

  const RangeNoise noise = config_with_fragment().uwb.noise;
  EXPECT_NEAR(noise.noise_m, 0.05, 0.005);
  EXPECT_LT(noise.bias_drift_m, 0.03);
}

/// Robots that fly in view of each other, with configurations that are a little off.
class CalibrateSwarm : public Calibrate {
 protected:
  void write_flight(const simulated::SwarmFlight& flight) const {
    std::ostringstream swarm;
    swarm << "scenario: flight\nseed: 1\nduration_s: 20\n"
             "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 0.0, seed: 7}\nrobots:\n";
    for (std::size_t r = 0; r < flight.records.size(); ++r) {
      swarm << "- {id: " << r + 1 << ", name: r" << r + 1 << ", dir: r" << r + 1
            << ", clock: {offset_s: " << 2.0 * static_cast<double>(r) << ", skew_ppm: 0.0}}\n";
      write_flown(flight, r);
    }
    ASSERT_TRUE(write_text_file(scratch_.path() / "swarm.yaml", swarm.str()));
  }

  [[nodiscard]] Result<CalibrationReport> calibrate_flight() const {
    return calibrate_swarm(
        {.swarm_dir = scratch_.path(), .out = out(), .json = true, .on_progress = {}});
  }
  [[nodiscard]] fs::path out() const { return scratch_.path() / "swarm"; }

 private:
  void write_flown(const simulated::SwarmFlight& flight, std::size_t r) const {
    const RobotConstants& guess = flight.guess[r];
    RobotFolder folder(robot_dir(static_cast<int>(r) + 1));
    Config own = config();
    own.robot.id = RobotId{static_cast<std::uint16_t>(r + 1)};
    CameraCalibration& camera = own.cameras[0].calibration;
    camera.intrinsics.assign(guess.camera.lens.begin(), guess.camera.lens.end());
    camera.resolution = {1280, 1024};
    camera.T_cam_imu = guess.camera.T_C_B();
    camera.calibrated = true;
    for (MemberConfig& member : own.swarm.members) {
      member.p_body_led = guess.p_B_M;
      member.p_body_uwb = guess.p_B_U;
    }
    ASSERT_TRUE(folder.write_config(write_config(own)));
    const Duration ahead = std::chrono::seconds(2 * r);
    std::string imu;
    for (ImuSample sample : flight.records[r].imu) {
      sample.stamp += ahead;
      append_rows(imu, sample);
    }
    ASSERT_TRUE(folder.append("imu0", imu));
    std::string ranges;
    for (const RobotRange& range : flight.records[r].ranges)
      append_rows(ranges, UwbRange{.stamp = range.stamp + ahead,
                                   .neighbor = RobotId{static_cast<std::uint16_t>(range.other + 1)},
                                   .range_m = range.range_m,
                                   .first_path_dbm = -80.0,
                                   .received_dbm = -79.0});
    ASSERT_TRUE(folder.append("uwb0", ranges));
    ASSERT_TRUE(folder.append("cam0", blinking(flight.records[r].sightings, own, ahead)));
  }

  static std::string blinking(const std::vector<BoardSighting>& sightings, const Config& own,
                              Duration ahead) {
    constexpr double kSlot = 10e-3;
    std::map<Timestamp, SpotFrame> frames;
    for (const BoardSighting& sighting : sightings) {
      SpotFrame& frame = frames[sighting.stamp];
      frame.stamp = sighting.stamp + ahead;
      const std::string& pattern = *own.swarm.members.at(sighting.board).pattern;
      const double t_s = to_seconds(sighting.stamp.time_since_epoch()) +
                         0.0037 * static_cast<double>(1 + sighting.board);
      const auto slot = static_cast<std::size_t>(t_s / kSlot) % pattern.size();
      if (pattern[slot] == '1')
        frame.spots.push_back({sighting.uv.x(), sighting.uv.y(), 12.0, 200.0, 1.0});
    }
    std::string rows;
    for (const auto& [stamp, frame] : frames) append_rows(rows, frame);
    return rows;
  }
};

TEST_F(CalibrateSwarm, WritesAFragmentForEveryRobot) {
  const auto flight = simulated::fly(6, {.camera_rate_hz = 200.0, .outliers = 0.0}, ImuNoise{});
  write_flight(flight);

  const auto report = calibrate_flight();

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->reasons.empty()) << report->reasons.front();
  EXPECT_TRUE(fs::exists(out() / "r3.yaml"));
  fs::copy_file(out() / "r1.fragment.yaml", etc() / "crepesd.d" / "20-swarm.yaml");
  const Config found = config();
  const CameraCalibration& camera = found.cameras[0].calibration;
  const RobotConstants& truth = flight.truth[0];
  EXPECT_TRUE(camera.calibrated);
  EXPECT_LT(kDegPerRad * camera.T_cam_imu.q.angularDistance(truth.camera.q_C_B), 0.4);
  EXPECT_NEAR(camera.timeshift_cam_imu, truth.camera.shift_s, 5e-4);
  for (std::size_t r = 0; r < 3; ++r)
    EXPECT_LT((found.swarm.members[r].p_body_led - flight.truth[r].p_B_M).norm(), 0.015) << r;
  EXPECT_TRUE(nlohmann::json::parse(report->text)["ok"]);
}

TEST_F(CalibrateSwarm, WritesNothingFromFiveSeconds) {
  write_flight(
      simulated::fly(6, {.duration_s = 5.0, .camera_rate_hz = 200.0, .outliers = 0.0}, ImuNoise{}));

  const auto report = calibrate_flight();

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->reasons.empty());
  EXPECT_FALSE(fs::exists(out()));
}

}  // namespace
}  // namespace crepes::calibrate_test
