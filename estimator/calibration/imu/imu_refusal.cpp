#include "estimator/calibration/imu/imu_refusal.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <string_view>

#include "estimator/calibration/number_text.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr int kLeastAttitudes = 12;
constexpr int kGoodAttitudes = 30;
constexpr double kAttitude_rad = radians(15.0);
constexpr double kNearAxis_rad = radians(45.0);
constexpr double kMostShaky = 0.2;        // share of all pauses
constexpr double kGyroAtRest = 0.02;      // [rad/s] noise of one sample, at most
constexpr double kAccelAtRest = 0.2;      // [m/s^2]
constexpr double kMostAccelBias = 0.005;  // [m/s^2], one sigma
constexpr double kMostAccelM = 0.001;
constexpr double kMostGyroM = 0.002;
constexpr double kResidualRatio = 3.0;  // of what noise explains
constexpr double kFirstRest_s = 10.0;
constexpr double kMostScale = 1.5;

/// The faces of the body that never looked up, in words.
std::string faces_missing(const std::vector<Rest>& rests) {
  struct Face {
    Eigen::Vector3d up;
    std::string_view name;
  };
  const std::array<Face, 6> faces{{{Eigen::Vector3d::UnitX(), "front (+x)"},
                                   {-Eigen::Vector3d::UnitX(), "back (-x)"},
                                   {Eigen::Vector3d::UnitY(), "left side (+y)"},
                                   {-Eigen::Vector3d::UnitY(), "right side (-y)"},
                                   {Eigen::Vector3d::UnitZ(), "top (+z)"},
                                   {-Eigen::Vector3d::UnitZ(), "bottom (-z)"}}};
  std::string missing;
  for (const Face& face : faces) {
    bool was_up = false;
    for (const Rest& rest : rests)
      was_up = was_up || angle_between(rest.accel_mps2, face.up) < kNearAxis_rad;
    if (!was_up) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", face.name);
  }
  return missing;
}

/// The same as the end of a sentence; empty if no face is missing.
std::string never_up(const std::string& faces) {
  return faces.empty() ? "" : fmt::format("; never up: {}", faces);
}

double explained_residual(const ImuCalibrationSettings& settings, const ImuCalibration& found) {
  double sum = 0.0;
  for (const Rest& rest : found.search.rests) {
    sum += std::pow(found.accel_noise_density, 2) / rest.duration_s() +
           std::pow(settings.noise.accelerometer_random_walk, 2) * found.search.rests.back().end_s;
  }
  return std::sqrt(sum / static_cast<double>(found.search.rests.size()));
}

}  // namespace

int count_attitudes(const std::vector<Rest>& rests) {
  std::vector<Eigen::Vector3d> counted;
  for (const Rest& rest : rests) {
    bool is_new = true;
    for (const Eigen::Vector3d& other : counted)
      is_new = is_new && angle_between(rest.accel_mps2, other) > kAttitude_rad;
    if (is_new) counted.push_back(rest.accel_mps2);
  }
  return static_cast<int>(counted.size());
}

std::vector<std::string> refusals_before_fit(const ImuCalibration& found) {
  std::vector<std::string> reasons;
  const RestSearch& search = found.search;
  if (search.rests.empty() || search.gyro_sigma_radps > kGyroAtRest ||
      search.accel_sigma_mps2 > kAccelAtRest) {
    reasons.push_back(fmt::format(
        "never at rest: even the quietest tenth of the recording shows {} deg/s and {} m/s^2 of "
        "motion; lay the robot down, do not hold it",
        number_text(search.gyro_sigma_radps * kDegPerRad, 2),
        number_text(search.accel_sigma_mps2, 3)));
    return reasons;
  }
  const auto pauses = static_cast<double>(search.shaky) + static_cast<double>(search.rests.size());
  if (static_cast<double>(search.shaky) > kMostShaky * pauses) {
    reasons.push_back(fmt::format(
        "shaky: in {} of {} pauses the robot was held, not laid down ({} deg/s of trembling); rest "
        "it against something each time",
        search.shaky, number_text(pauses, 0), number_text(search.shake_radps * kDegPerRad, 2)));
  }
  if (found.attitudes < kLeastAttitudes) {
    reasons.push_back(fmt::format(
        "only {} attitudes at rest; at least {} are needed, 40 are good: {} are missing{}",
        found.attitudes, kLeastAttitudes, kLeastAttitudes - found.attitudes,
        never_up(faces_missing(search.rests))));
  }
  return reasons;
}

void judge_fit(const ImuCalibrationSettings& settings, ImuCalibration& found) {
  const std::string faces = faces_missing(found.search.rests);
  const double bias_sigma = found.accelerometer.bias_sigma.maxCoeff();
  if (found.refusals.empty() &&
      (bias_sigma > kMostAccelBias || found.accelerometer.M_sigma.maxCoeff() > kMostAccelM)) {
    found.refusals.push_back(fmt::format(
        "the attitudes do not determine the accelerometer (bias to {} m/s^2, one sigma){}",
        number_text(bias_sigma, 4), never_up(faces)));
  }
  const Eigen::Vector3d scale = found.accelerometer.scale();
  if (scale.minCoeff() < 1.0 / kMostScale || scale.maxCoeff() > kMostScale) {
    found.refusals.push_back(fmt::format(
        "the accelerometer would have to be scaled by {}: is its unit m/s^2, and gravity {}?",
        number_text(scale.mean(), 2), number_text(settings.gravity_mps2, 4)));
  }
  const double explained = explained_residual(settings, found);
  if (found.accelerometer.residual_rms > kResidualRatio * explained) {
    found.refusals.push_back(fmt::format(
        "gravity at the rests differs by {} m/s^2 RMS from {}, where noise explains {}: the robot "
        "was not at rest, or the sensor is not linear",
        number_text(found.accelerometer.residual_rms, 4), number_text(settings.gravity_mps2, 4),
        number_text(explained, 4)));
  }
  if (found.refusals.empty() && found.gyroscope.M_sigma.maxCoeff() > kMostGyroM) {
    found.refusals.push_back(fmt::format(
        "the turns do not determine the gyroscope's scale and axes (to {} %, one sigma): turn by "
        "more than 90 degrees about every axis",
        number_text(100.0 * found.gyroscope.M_sigma.maxCoeff(), 2)));
  }
  if (found.attitudes < kGoodAttitudes) {
    found.warnings.push_back(
        fmt::format("{} attitudes; {} to 50 make it better", found.attitudes, kGoodAttitudes));
  }
  if (found.search.shaky > 0 && found.refusals.empty()) {
    found.warnings.push_back(
        fmt::format("{} pauses were too shaky and are not used", found.search.shaky));
  }
  if (!faces.empty()) found.warnings.push_back(fmt::format("never up: {}", faces));
  if (found.search.rests.front().duration_s() < kFirstRest_s)
    found.warnings.emplace_back("the recording should begin with half a minute at rest");
}

}  // namespace crepes
