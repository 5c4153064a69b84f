#include "daemon/ctl/calibrate/calibrate_grid.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "tests/support/grid_film.hpp"
#include "tests/support/simulated_grid.hpp"

namespace crepes::calibrate_grid_test {
namespace {

namespace fs = std::filesystem;

class CalibrateGrid : public testing::Test {
 protected:
  [[nodiscard]] fs::path pictures() const { return scratch_.path() / "pictures"; }
  [[nodiscard]] fs::path out() const { return scratch_.path() / "camchain.yaml"; }

  /// Names in no order, JPEG and PNG.
  void write(int count, std::uint64_t seed) const {
    fs::create_directories(pictures());
    int k = 0;
    for (const simulated::SeenGrid& grid : simulated::seen_grids(seed, count, {})) {
      auto picture = simulated::rendered(grid, seed + static_cast<std::uint64_t>(++k));
      const cv::Mat image(simulated::kGridHeight, simulated::kGridWidth, CV_8UC1,
                          picture.pixels.data());
      const std::string name =
          "IMG_" + std::to_string((k * 7) % 100) + (k % 3 == 0 ? ".jpg" : ".png");
      ASSERT_TRUE(cv::imwrite((pictures() / name).string(), image, {cv::IMWRITE_JPEG_QUALITY, 90}));
    }
  }
  /// A robot's folder: a film of a grid 0.6 m before a hand, and the inertial samples.
  void write_film(const simulated::CameraRecording& recording) const {
    RobotFolder folder(pictures());
    for (const ImuSample& sample : recording.imu) {
      std::string row;
      append_rows(row, sample);
      ASSERT_TRUE(folder.append("imu0", row));
    }
    const simulated::RenderedGrid dark(1);
    auto seen = recording.sightings.begin();
    while (seen != recording.sightings.end()) {
      const Timestamp stamp = seen->stamp;
      simulated::RenderedGrid picture = dark;
      for (; seen != recording.sightings.end() && seen->stamp == stamp; ++seen)
        picture.add(seen->uv, 120.0 + 20.0 * static_cast<double>(seen->board % 5), 1.3);
      picture.expose();
      std::vector<std::uint8_t> png;
      ASSERT_TRUE(cv::imencode(
          ".png",
          cv::Mat(simulated::kGridHeight, simulated::kGridWidth, CV_8UC1, picture.pixels.data()),
          png, {cv::IMWRITE_PNG_COMPRESSION, 0}));
      ASSERT_TRUE(folder.add_picture("cam0", stamp, png));
    }
  }
  [[nodiscard]] Result<CalibrationReport> run(bool json, bool kannala_brandt = false) const {
    return calibrate_grid({.pictures = pictures(),
                           .out = out(),
                           .grid = simulated::five_by_seven(),
                           .fov_deg = {},
                           .kannala_brandt = kannala_brandt,
                           .json = json,
                           .on_progress = {}});
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

TEST_F(CalibrateGrid, FindsTheLensInAFolderOfPicturesAlone) {
  write(32, 1);

  const auto report = run(true);

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->reasons.empty()) << report->reasons.front();
  const auto json = nlohmann::json::parse(report->text);
  EXPECT_TRUE(json["ok"]);
  EXPECT_EQ(json["pictures"], 32);
  EXPECT_GE(json["views"], 28);
  EXPECT_LT(json["residual_px"], 0.2);
  EXPECT_EQ(json["intrinsics_sigma"].size(), 6U);
  GridLens found{.kind = LensKind::kDoubleSphere, .numbers = Eigen::VectorXd(6)};
  for (Eigen::Index i = 0; i < 6; ++i)
    found.numbers[i] = json["intrinsics"][static_cast<std::size_t>(i)];
  EXPECT_LT(simulated::shape_error_px(found, simulated::grid_camera(), 80.0), 0.15);
  const std::string camchain = read_text_file(out(), 1 << 20).value();
  EXPECT_NE(camchain.find("camera_model: ds"), std::string::npos) << camchain;
  EXPECT_EQ(camchain.find("T_cam_imu"), std::string::npos) << camchain;
}

simulated::CameraRecording film(double duration_s) {
  const GridShape shape = simulated::five_by_seven();
  CameraConstants camera;
  camera.lens = simulated::grid_camera().numbers;
  Eigen::Matrix3d R_C_B;
  R_C_B << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
  camera.q_C_B = Eigen::Quaterniond(R_C_B) * so3_exp(Eigen::Vector3d(0.1, -0.05, 0.08));
  camera.p_B_C = {0.02, -0.01, 0.01};
  camera.shift_s = 0.004;
  simulated::HandHeld hand = simulated::grid_in_hand(shape, duration_s);
  hand.noise_px = 0.0;
  hand.camera = camera;
  return simulated::hand_held(4, hand, ImuNoise{});
}

TEST_F(CalibrateGrid, FindsTheMountingInAFilmWithInertialSamples) {
  const simulated::CameraRecording recording = film(22.0);
  write_film(recording);

  const auto report = run(true);

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->reasons.empty()) << report->reasons.front();
  const auto json = nlohmann::json::parse(report->text);
  EXPECT_EQ(json["leds"], 35);
  Eigen::Matrix3d R_C_B;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      R_C_B(row, column) =
          json["T_cam_imu"][static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  EXPECT_LT(Eigen::Quaterniond(R_C_B).angularDistance(recording.truth.q_C_B), radians(0.1));
  EXPECT_NEAR(json["timeshift_cam_imu"], recording.truth.shift_s, 2e-4);
  EXPECT_LT(json["residual_px"], 0.1);
  const std::string camchain = read_text_file(out(), 1 << 20).value();
  EXPECT_NE(camchain.find("T_cam_imu"), std::string::npos) << camchain;
  EXPECT_NE(camchain.find("timeshift_cam_imu"), std::string::npos) << camchain;
}

TEST_F(CalibrateGrid, SaysWhatAShortFilmStillGives) {
  write_film(film(12.0));

  const auto report = run(false);

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_EQ(report->reasons.size(), 2U);
  EXPECT_NE(report->reasons[0].find("record a minute"), std::string::npos) << report->reasons[0];
  EXPECT_NE(report->reasons[1].find("pictures/cam0 instead"), std::string::npos)
      << report->reasons[1];
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(CalibrateGrid, RefusesPicturesWithoutAGridAndWritesNothing) {
  fs::create_directories(pictures());
  const cv::Mat dark(simulated::kGridHeight, simulated::kGridWidth, CV_8UC1, cv::Scalar(5));
  for (const std::string name : {"a", "b", "c"})
    ASSERT_TRUE(cv::imwrite((pictures() / (name + ".png")).string(), dark));

  const auto report = run(true);

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_FALSE(report->reasons.empty());
  EXPECT_NE(report->reasons[0].find("was not found in 3 of 3 pictures: a.png, b.png, c.png"),
            std::string::npos)
      << report->reasons[0];
  EXPECT_FALSE(nlohmann::json::parse(report->text)["ok"]);
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(CalibrateGrid, SaysThatPicturesAreOfDifferentSizes) {
  fs::create_directories(pictures());
  ASSERT_TRUE(
      cv::imwrite((pictures() / "a.png").string(), cv::Mat(100, 200, CV_8UC1, cv::Scalar(5))));
  ASSERT_TRUE(
      cv::imwrite((pictures() / "b.png").string(), cv::Mat(100, 201, CV_8UC1, cv::Scalar(5))));

  const auto report = run(false);

  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("b.png is 201x100"), std::string::npos)
      << report.error().message;
}

TEST_F(CalibrateGrid, ReadsTheSizeOfTheGrid) {
  EXPECT_EQ(parse_grid("5x7", 0.05)->columns, 7);
  for (const std::string text : {"5", "5x", "x7", "1x7", "5x700", "5*7", "-5x7"})
    EXPECT_FALSE(parse_grid(text, 0.05)) << text;
}

}  // namespace
}  // namespace crepes::calibrate_grid_test
