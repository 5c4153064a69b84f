#include "tests/study/scene_pictures.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes::study {
namespace {

constexpr double kColumn = radians(30.0);  // of places, side by side
constexpr double kRow = radians(15.0);
constexpr std::size_t kColumns = 5;
constexpr double kJitter = 0.25;  // of a column or row

/// Where a board is while the camera looks straight ahead, in the body.
Pose place_of(const VisionScene& scene, std::size_t board, std::mt19937& random) {
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  const double column = static_cast<double>(board % kColumns) - 0.5 * (kColumns - 1);
  const double row = static_cast<double>(board / kColumns) - 1.5;
  const double azimuth = kColumn * (column + kJitter * part(random));
  const double elevation = kRow * (row + kJitter * part(random));
  const Eigen::Vector3d toward(std::cos(azimuth) * std::cos(elevation),
                               std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
  const double range = 0.5 * (scene.nearest_m + scene.farthest_m) +
                       0.5 * (scene.farthest_m - scene.nearest_m) * part(random);
  const double around = std::numbers::pi * part(random);
  const Eigen::Quaterniond tilt = so3_exp(scene.tilt_rad * part(random) *
                                          Eigen::Vector3d(0.0, std::cos(around), std::sin(around)));
  return {range * toward, shortest_rotation(Eigen::Vector3d::UnitX(), -toward) * tilt};
}

}  // namespace

std::vector<ScenePicture> scene_pictures(const VisionScene& scene, std::size_t boards,
                                         std::size_t count) {
  const CameraCalibration camera = scene_camera(scene.effects);
  const CameraModel model = CameraModel::from(camera).value();
  const double rate_radps = radians(scene.peak_rate_dps);
  std::vector<ScenePicture> pictures;
  for (std::size_t k = 0; k < count; ++k) {
    std::mt19937 random(static_cast<unsigned>(1000 * scene.seed + k));
    BoardRenderer renderer(model, scene.effects, scene.seed);  // its hot pixels are the same
    for (std::size_t board = 0; board < boards; ++board) {
      const Pose place = place_of(scene, board, random);
      renderer.add({scene.board,
                    [&camera, place, rate_radps](double t_s) {
                      const Pose turned{Eigen::Vector3d::Zero(),
                                        so3_exp(-rate_radps * t_s * Eigen::Vector3d::UnitZ())};
                      return camera.T_cam_imu * (turned * place);
                    },
                    [](double) { return true; }});
    }
    pictures.push_back(renderer.render(0.0));
  }
  return pictures;
}

}  // namespace crepes::study
