#include "daemon/ctl/calibrate/calibrate_imu.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "config/writing/config_writer.hpp"
#include "daemon/ctl/calibrate/imu_fragment.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/imu/allan_deviation.hpp"
#include "estimator/calibration/imu/imu_calibration.hpp"
#include "estimator/calibration/imu/stillness.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/quantile.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPercent = 100.0;
constexpr double kLeastRest_s = 600.0;
constexpr double kGoodRest_s = 3000.0;
constexpr double kMostMissing = 0.001;  // of the samples
constexpr double kMaxRate_hz = 1000.0;  // that crepesd.yaml may have

std::string noise_text(const ImuNoise& noise, std::string_view indent) {
  return fmt::format(
      "{0}update_rate: {1}\n{0}accelerometer_noise_density: {2}\n{0}gyroscope_noise_density: {3}\n"
      "{0}accelerometer_random_walk: {4}\n{0}gyroscope_random_walk: {5}\n",
      indent, to_yaml(noise.update_rate), to_yaml(noise.accelerometer_noise_density),
      to_yaml(noise.gyroscope_noise_density), to_yaml(noise.accelerometer_random_walk),
      to_yaml(noise.gyroscope_random_walk));
}

Result<void> write_files(const std::filesystem::path& out, const std::string& fragment,
                         const ImuNoise& noise) {
  const std::string head = "# Written by crepesctl calibrate imu\n";
  return write_text_file(out, head + fragment).and_then([&] {
    return write_text_file(beside(out, ".kalibr.yaml"),
                           head + "rostopic: /imu0\n" + noise_text(noise, ""));
  });
}

std::array<double, 3> list_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::array<std::array<double, 3>, 3> rows_of(const Eigen::Matrix3d& M) {
  return {list_of(M.row(0)), list_of(M.row(1)), list_of(M.row(2))};
}

Json json_of(const TriadEstimate& triad) {
  return {{"bias", list_of(triad.bias)},
          {"scale", list_of(triad.scale())},
          {"misalignment", rows_of(triad.misalignment())},
          {"bias_sigma", list_of(triad.bias_sigma)},
          {"matrix_sigma", rows_of(triad.M_sigma)},
          {"residual_rms", triad.residual_rms}};
}

Json json_of(const ImuCalibration& found, const ImuTriads& sensor, const ImuNoise& noise) {
  Json json = report_head(found.refusals, found.warnings);
  json["rests"] = found.search.rests.size();
  json["shaky"] = found.search.shaky;
  json["attitudes"] = found.attitudes;
  if (found.refusals.empty()) {
    json["accelerometer"] = json_of(sensor.accelerometer);
    json["gyroscope"] = json_of(sensor.gyroscope);
    json["accelerometer_noise_density"] = noise.accelerometer_noise_density;
    json["gyroscope_noise_density"] = noise.gyroscope_noise_density;
  }
  return json;
}

std::vector<std::string> row_of(const std::string& name, const TriadEstimate& triad, double unit,
                                int decimals) {
  const double M_sigma = triad.M_sigma.norm() / 3.0;
  return {name,
          fixed(triad.bias.x() * unit, decimals),
          fixed(triad.bias.y() * unit, decimals),
          fixed(triad.bias.z() * unit, decimals),
          fixed(triad.bias_sigma.norm() / std::sqrt(3.0) * unit, decimals + 1),
          fixed(kPercent * (triad.scale().x() - 1.0), 3),
          fixed(kPercent * (triad.scale().y() - 1.0), 3),
          fixed(kPercent * (triad.scale().z() - 1.0), 3),
          fixed(kPercent * M_sigma, 4)};
}

std::string text_of(const ImuCalibration& found, const ImuTriads& sensor,
                    const std::filesystem::path& out) {
  std::string text = fmt::format("{} rests in {} attitudes; gravity differs by {} m/s^2 RMS\n",
                                 found.search.rests.size(), found.attitudes,
                                 fixed(found.accelerometer.residual_rms, 4));
  text += text_table({{"", "bias x", "y", "z", "+-", "scale x %", "y", "z", "+- %"},
                      row_of("accelerometer [m/s^2]", sensor.accelerometer, 1.0, 4),
                      row_of("gyroscope [deg/s]", sensor.gyroscope, kDegPerRad, 3)});
  return text + warning_lines(found.warnings) + fmt::format("written: {}\n", out.string());
}

std::vector<double> axis_of(const std::vector<ImuSample>& imu, int axis) {
  std::vector<double> readings;
  readings.reserve(imu.size());
  for (const ImuSample& sample : imu)
    readings.push_back(axis < 3 ? sample.gyro_radps[axis] : sample.accel_mps2[axis - 3]);
  return readings;
}

/// Noise of one sensor: the largest of its three axes, as Kalibr's keys hold one number.
struct AxesNoise {
  NoiseDensities noise;
  std::optional<double> moved_s;  ///< when it first did
};

AxesNoise noise_of(const std::vector<ImuSample>& imu, double period_s, int first_axis) {
  AxesNoise worst;
  for (int axis = first_axis; axis < first_axis + 3; ++axis) {
    const std::vector<double> readings = axis_of(imu, axis);
    if (const auto moved_s = first_motion_s(readings, period_s))
      worst.moved_s = std::min(*moved_s, worst.moved_s.value_or(*moved_s));
    const auto fit = fit_noise(allan_deviation(readings, period_s));
    if (!fit) continue;
    if (fit->white > worst.noise.white) {
      worst.noise.white = fit->white;
      worst.noise.white_sigma = fit->white_sigma;
    }
    if (fit->random_walk > worst.noise.random_walk) {
      worst.noise.random_walk = fit->random_walk;
      worst.noise.random_walk_sigma = fit->random_walk_sigma;
    }
    worst.noise.bias_stability = std::max(worst.noise.bias_stability, fit->bias_stability);
  }
  return worst;
}

std::string sigma_text(double value, double sigma) {
  return fmt::format("{:.3g} +- {:.1g}", value, sigma);
}

std::string rest_text(const AxesNoise& gyro, const AxesNoise& accel,
                      const std::vector<std::string>& warnings, const std::filesystem::path& out) {
  const auto row = [](const char* name, const NoiseDensities& n) {
    return std::vector<std::string>{name, sigma_text(n.white, n.white_sigma),
                                    fmt::format("{:.2g}", n.bias_stability),
                                    sigma_text(n.random_walk, n.random_walk_sigma)};
  };
  return text_table({{"", "white noise", "flat part", "random walk"},
                     row("accelerometer [m/s^2]", accel.noise),
                     row("gyroscope [rad/s]", gyro.noise)}) +
         warning_lines(warnings) + fmt::format("written: {}\n", out.string());
}

Json rest_json(const AxesNoise& gyro, const AxesNoise& accel,
               const std::vector<std::string>& reasons, const std::vector<std::string>& warnings) {
  Json json = report_head(reasons, warnings);
  const auto add = [&json](const std::string& name, const NoiseDensities& noise) {
    json[name + "_noise_density"] = noise.white;
    json[name + "_noise_density_sigma"] = noise.white_sigma;
    json[name + "_bias_stability"] = noise.bias_stability;
    json[name + "_random_walk"] = noise.random_walk;
    json[name + "_random_walk_sigma"] = noise.random_walk_sigma;
  };
  if (!reasons.empty()) return json;
  add("accelerometer", accel.noise);
  add("gyroscope", gyro.noise);
  return json;
}

double duration_of(const std::vector<ImuSample>& imu) {
  return imu.empty() ? 0.0 : to_seconds(imu.back().stamp - imu.front().stamp);
}

/// How a sensor sampled.
struct Sampling {
  double period_s = 0.0;   ///< where no sample is missing
  double missing_s = 0.0;  ///< in gaps
};

Sampling sampling_of(const std::vector<ImuSample>& imu) {
  constexpr double kGap = 2.5;  // periods
  if (imu.size() < 2) return {};
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < imu.size(); ++i)
    steps_s.push_back(to_seconds(imu[i].stamp - imu[i - 1].stamp));
  std::vector<double> sorted_s = steps_s;
  const double usual_s = upper_median(sorted_s);
  Sampling sampling;
  for (const double step_s : steps_s)
    if (step_s > kGap * usual_s) sampling.missing_s += step_s - usual_s;
  sampling.period_s = (duration_of(imu) - sampling.missing_s) / static_cast<double>(steps_s.size());
  return sampling;
}

/// Noise densities and random walks from a long time at rest.
Result<CalibrationReport> measure_noise(const CalibrateImuOptions& options,
                                        const std::vector<ImuSample>& imu, ImuNoise noise,
                                        DatasetFaults faults) {
  CalibrationReport report{.text = {}, .reasons = {}, .faults = std::move(faults)};
  const double duration_s = duration_of(imu);
  if (duration_s < kLeastRest_s) {
    report.reasons.push_back(
        fmt::format("{} s at rest do not show a random walk; record an hour, at least {} s",
                    fixed(duration_s, 0), fixed(kLeastRest_s, 0)));
  }
  const Sampling sampling = sampling_of(imu);
  if (sampling.missing_s > kMostMissing * duration_s) {
    report.reasons.push_back(
        fmt::format("samples of {} s in all are missing: their noise is not that of a whole hour",
                    fixed(sampling.missing_s, 1)));
  }
  const AxesNoise gyro = noise_of(imu, sampling.period_s, 0);
  if (options.on_progress) options.on_progress(0.6);
  const AxesNoise accel = noise_of(imu, sampling.period_s, 3);
  if (const auto moved_s = gyro.moved_s ? gyro.moved_s : accel.moved_s) {
    report.reasons.push_back(
        fmt::format("the robot was moved {} s after the start: lay it down where nobody touches it",
                    fixed(*moved_s, 0)));
  }
  std::vector<std::string> warnings;
  if (duration_s < kGoodRest_s) warnings.emplace_back("an hour at rest is better");
  noise.accelerometer_noise_density = accel.noise.white;
  noise.gyroscope_noise_density = gyro.noise.white;
  noise.accelerometer_random_walk = accel.noise.random_walk;
  noise.gyroscope_random_walk = gyro.noise.random_walk;
  // A sensor of 1000 Hz may be a little fast.
  if (sampling.period_s > 0.0) noise.update_rate = std::min(1.0 / sampling.period_s, kMaxRate_hz);
  if (report.reasons.empty()) {
    const auto written = write_files(options.out, "imu:\n" + noise_text(noise, "  "), noise);
    if (!written) return tl::unexpected(written.error());
  }
  if (options.json) {
    report.text = json_line(rest_json(gyro, accel, report.reasons, warnings));
  } else if (report.reasons.empty()) {
    report.text = rest_text(gyro, accel, warnings, options.out);
  }
  return report;
}

}  // namespace

Result<CalibrationReport> calibrate_imu(const CalibrateImuOptions& options) {
  const auto free =
      check_results({options.out, beside(options.out, ".kalibr.yaml")}, "imu", options.force);
  if (!free) return tl::unexpected(free.error());
  DatasetFaults faults;
  const auto recording =
      load_robot(options.robot_dir, {.imu = true, .ranges = false, .cameras = false}, faults);
  if (!recording) return tl::unexpected(recording.error());
  if (options.on_progress) options.on_progress(0.2);
  ImuNoise noise = recording->config.imu.noise;
  if (options.rest) return measure_noise(options, recording->imu, noise, std::move(faults));

  const ImuCalibration found =
      calibrate_imu(recording->imu, {.noise = noise, .gravity_mps2 = options.gravity_mps2});
  CalibrationReport report{.text = {}, .reasons = found.refusals, .faults = std::move(faults)};
  noise.accelerometer_noise_density = found.accel_noise_density;
  noise.gyroscope_noise_density = found.gyro_noise_density;
  const ImuTriads sensor =
      of_sensor({found.accelerometer, found.gyroscope}, recording->config.imu.device);
  if (found.refusals.empty()) {
    const std::string fragment = "imu:\n" + triad_text("accelerometer", sensor.accelerometer) +
                                 triad_text("gyroscope", sensor.gyroscope);
    const auto written = write_files(options.out, fragment, noise);
    if (!written) return tl::unexpected(written.error());
  }
  if (options.json) {
    report.text = json_line(json_of(found, sensor, noise));
  } else if (found.refusals.empty()) {
    report.text = text_of(found, sensor, options.out);
  }
  return report;
}

}  // namespace crepes
