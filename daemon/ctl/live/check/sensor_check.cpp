#include "daemon/ctl/live/check/sensor_check.hpp"

#include <fmt/core.h>

#include "daemon/ctl/live/light_advice.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

using SensorLine = client::Status::Sensor;

constexpr const char* kAskAgain =
    "the daemon did not report its counts: ask again; is it as new as crepesctl?";

void check_rate(const std::string& name, double rate_hz, double wanted_hz, CheckSection& section) {
  constexpr double kLeast = 0.9;
  constexpr double kMost = 1.1;
  const std::string text =
      fmt::format("{}: {} of {} Hz", name, fixed(rate_hz, 1), fixed(wanted_hz, 0));
  if (rate_hz >= kLeast * wanted_hz && rate_hz <= kMost * wanted_hz) return section.good(text);
  section.doubt(text, rate_hz < wanted_hz
                          ? "the device is set otherwise, or the computer or its cable is too slow"
                          : "set the key to what the device does");
}

void check_spot_rate(const SensorLine& spots, const client::Status& status, CheckSection& section) {
  constexpr double kSlow = 20e3;  // us from a picture to its spots
  constexpr double kShare = 0.9;
  const SensorLine* const camera =
      sensor_of(status, spots.name.substr(0, spots.name.size() - kSpotsSuffix.size()));
  const std::string rate = fmt::format("{}: {} Hz", spots.name, fixed(spots.rate_hz, 1));
  const auto delay_us = static_cast<double>(total(spots.counts, "delay_p99_us"));
  if (camera != nullptr && spots.rate_hz < kShare * camera->rate_hz) {
    section.doubt(fmt::format("{}, the camera has {}", rate, fixed(camera->rate_hz, 1)),
                  "the computer is too slow: end other programs, or lower rate_hz");
  } else if (spots.counts.empty()) {
    section.doubt(rate + ", time from picture to spots unknown", kAskAgain);
  } else if (delay_us > kSlow) {
    section.doubt(
        fmt::format("{}: {} ms from picture to spots", spots.name, fixed(1e-3 * delay_us, 1)),
        "the computer is too slow, or the picture too bright");
  } else {
    section.good(fmt::format("{}, {} ms", rate, fixed(1e-3 * delay_us, 1)));
  }
}

void check_picture(const SensorLine& spots, CheckSection& section) {
  if (spots.counts.empty())
    return section.doubt(spots.name + ": background and lights unknown", kAskAgain);
  const std::uint64_t background = total(spots.counts, "background");
  const std::uint64_t brightest = total(spots.counts, "brightest");
  const std::string text =
      brightest == 0
          ? fmt::format("{}: background {}, no light in view", spots.name, background)
          : fmt::format(
                "{}: background {}, threshold {}, brightest light {}, faintest {}, {} lights",
                spots.name, background, total(spots.counts, "threshold"), brightest,
                total(spots.counts, "faintest"), total(spots.counts, "spots"));
  const std::string advice = light_advice(spots.counts);
  if (advice.empty()) {
    section.good(text);
  } else {
    section.doubt(text, advice);
  }
}

}  // namespace

void check_sensors(const RobotObservation& seen, CheckSection section) {
  if (seen.after.sensors.empty())
    section.fault("the daemon reports no sensor", "see its messages: journalctl -u crepesd");
  for (const SensorLine& sensor : seen.after.sensors) {
    if (!sensor.ok && sensor.calibrated) {
      section.fault(fmt::format("{}: {}", sensor.name,
                                sensor.message.empty() ? "does not work" : sensor.message),
                    "crepesctl devices lists what is connected; see troubleshooting.md");
      continue;
    }
    const SensorLine* const before = sensor_of(seen.before, sensor.name);
    const std::string lost = before == nullptr ? "" : growth_text(before->faults, sensor.faults);
    if (lost.empty()) {
      section.good(sensor.name);
    } else {
      section.doubt(fmt::format("{}: in {} s, {}", sensor.name, fixed(seen.duration_s, 0), lost),
                    "check cable and port; the names are explained in formats.md");
    }
  }
}

void check_rates(const RobotObservation& seen, CheckSection section) {
  for (const SensorLine& sensor : seen.after.sensors) {
    if (sensor.name == "mesh" || sensor.name == "subscription") continue;  // they have no rate
    if (sensor.rate_hz <= 0.0) {
      section.fault(sensor.name + ": silent", "see sensors, above");
    } else if (is_spots(sensor)) {
      check_spot_rate(sensor, seen.after, section);
    } else if (!seen.config || sensor.name == "uwb") {
      section.good(fmt::format("{}: {} Hz", sensor.name, fixed(sensor.rate_hz, 1)));
    } else if (sensor.name == "imu") {
      check_rate("imu", sensor.rate_hz, seen.config->imu.noise.update_rate, section);
    } else {
      for (const CameraConfig& camera : seen.config->cameras) {
        if (camera.calibration.name == sensor.name)
          check_rate(sensor.name, sensor.rate_hz, camera.calibration.rate_hz, section);
      }
    }
  }
  const std::string dropped = growth_text(seen.before.queues, seen.after.queues);
  if (!dropped.empty())
    section.doubt("dropped from queues: " + dropped, "the computer is too slow, or busy");
}

void check_exposure(const client::Status& status, CheckSection section) {
  for (const SensorLine& sensor : status.sensors)
    if (is_spots(sensor) && sensor.rate_hz > 0.0) check_picture(sensor, section);
}

}  // namespace crepes
