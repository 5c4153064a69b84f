#include "daemon/ctl/calibrate/calibrate_camera.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/camera_coverage.hpp"
#include "daemon/ctl/calibrate/record_for_camera.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "drivers/base/sleep.hpp"
#include "drivers/base/unique_fd.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/camera_model.hpp"
#include "tests/daemon/ctl/calibrate/calibrate_fixture.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::calibrate_camera_test {
namespace {

namespace fs = std::filesystem;
using test::Calibrate;

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

}  // namespace
}  // namespace crepes::calibrate_camera_test
