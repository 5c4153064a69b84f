#include "tests/faults/sensor_faults.hpp"

#include <algorithm>
#include <utility>

#include "tests/faults/dice.hpp"

namespace crepes::faults {
namespace {

using namespace std::chrono_literals;

constexpr double kSaturation_mps2 = 19.6;
constexpr double kSaturation_radps = 4.4;
constexpr double kSpike_radps = 34.9;
constexpr double kSpike_mps2 = 150.0;

/// A robot's measurements, and what happens to those within the fault.
class Damage {
 public:
  Damage(const Fault& fault, RobotRecording& robot)
      : fault_(fault), robot_(robot), dice_(fault.seed) {}

  void apply();

 private:
  [[nodiscard]] bool is_hit(Timestamp stamp) const {
    return fault_.lasts_at(robot_.robot.clock.true_s(stamp));
  }
  template <class Reading, class Change>
  void change(std::vector<Reading>& readings, const Change& by) {
    for (Reading& reading : readings)
      if (is_hit(reading.stamp)) by(reading);
  }
  /// Removes a share of the readings.
  template <class Reading>
  void thin(std::vector<Reading>& readings, double share) {
    std::erase_if(readings, [&](const Reading& reading) {
      return is_hit(reading.stamp) && dice_.happens(share);
    });
  }
  template <class Change>
  void change_spots(const Change& by) {
    for (CameraRecording& camera : robot_.cameras) change(camera.spots, by);
  }
  [[nodiscard]] Spot random_spot() {
    return {.u_px = dice_.between(100, 1180),
            .v_px = dice_.between(100, 920),
            .area_px2 = 12.0,
            .peak = 200.0};
  }

  void damage_imu();
  void damage_ranges();
  void damage_cameras();
  void exchange_codes();

  const Fault& fault_;
  RobotRecording& robot_;
  Dice dice_;
};

void Damage::apply() {
  damage_imu();
  damage_ranges();
  damage_cameras();
}

void Damage::damage_imu() {
  std::vector<ImuSample>& imu = robot_.imu;
  const auto hit = std::ranges::find_if(imu, [&](const ImuSample& s) { return is_hit(s.stamp); });
  switch (fault_.kind) {
    case Kind::kImuStuck:
      if (hit == imu.end()) return;
      return change(imu, [first = *hit](ImuSample& s) {
        s.gyro_radps = first.gyro_radps;
        s.accel_mps2 = first.accel_mps2;
      });
    case Kind::kImuSpikes:
      return change(imu, [&](ImuSample& s) {
        if (!dice_.happens(0.05)) return;
        const auto axis = static_cast<Eigen::Index>(dice_.below(3));
        (dice_.happens(0.5) ? s.gyro_radps(axis) += kSpike_radps
                            : s.accel_mps2(axis) += kSpike_mps2);
      });
    case Kind::kImuSaturated:
      return change(imu, [](ImuSample& s) {
        s.gyro_radps(0) = kSaturation_radps;
        s.accel_mps2(2) = kSaturation_mps2;
      });
    case Kind::kImuAxesSwapped:
      return change(imu, [](ImuSample& s) {
        std::swap(s.gyro_radps(0), s.gyro_radps(1));
        std::swap(s.accel_mps2(0), s.accel_mps2(2));
      });
    case Kind::kImuGap:
      return thin(imu, 1.0);
    case Kind::kImuHalfRate:
      return thin(imu, 0.5);
    default:
      return;
  }
}

void Damage::damage_ranges() {
  std::vector<UwbRange>& ranges = robot_.ranges;
  switch (fault_.kind) {
    case Kind::kUwbConstant:
      return change(ranges, [](UwbRange& r) { r.range_m = 3.21; });
    case Kind::kUwbOffset:
      return change(ranges, [](UwbRange& r) { r.range_m += 1.0; });
    case Kind::kUwbNegative:
      return change(ranges, [](UwbRange& r) { r.range_m = -r.range_m; });
    case Kind::kUwbWrongIds:
      return change(ranges, [&](UwbRange& r) {
        r.neighbor = RobotId{static_cast<std::uint16_t>(1 + dice_.below(9))};
      });
    case Kind::kUwbNoSight:
      return change(ranges, [&](UwbRange& r) { r.range_m += dice_.between(0.3, 1.2); });
    case Kind::kUwbSlow:
      return thin(ranges, 0.96);
    case Kind::kUwbGap:
      return thin(ranges, 1.0);
    default:
      return;
  }
}

void Damage::damage_cameras() {
  constexpr double kImageHeight = 1024.0;
  switch (fault_.kind) {
    case Kind::kCameraFrozen: {
      std::optional<std::vector<Spot>> first;
      return change_spots([&](SpotFrame& frame) {
        if (!first) first = frame.spots;
        frame.spots = *first;
      });
    }
    case Kind::kCameraBlack:
      return change_spots([](SpotFrame& frame) { frame.spots.clear(); });
    case Kind::kCameraWhite:
      return change_spots([&](SpotFrame& frame) {
        for (int i = 0; i < 60; ++i) frame.spots.push_back(random_spot());
      });
    case Kind::kCameraLosesFrames:
      for (CameraRecording& camera : robot_.cameras) thin(camera.spots, 0.5);
      return;
    case Kind::kCameraLate:
      return change_spots([](SpotFrame& frame) { frame.stamp += 30ms; });
    case Kind::kCameraMirrors:
      return change_spots([&](SpotFrame& frame) {
        const std::size_t count = frame.spots.size();
        for (std::size_t i = 0; i < count; ++i) {
          Spot image = frame.spots[i];
          image.v_px = kImageHeight - image.v_px;
          frame.spots.push_back(image);
        }
      });
    case Kind::kCameraOtherCodes:
      return exchange_codes();
    default:
      return;
  }
}

/// A board elsewhere blinks as the first visible one does.
void Damage::exchange_codes() {
  change_spots([](SpotFrame& frame) {
    if (frame.spots.empty()) return;
    Spot copy = frame.spots.front();
    copy.u_px = 1280.0 - copy.u_px;
    frame.spots.push_back(copy);
  });
}

}  // namespace

void apply_to_sensors(const Fault& fault, SwarmDataset& dataset) {
  for (RobotRecording& robot : dataset.robots) {
    if (robot.robot.id != fault.robot) continue;
    Damage(fault, robot).apply();
    for (CameraRecording& camera : robot.cameras)
      std::ranges::stable_sort(camera.spots, {}, &SpotFrame::stamp);
  }
}

}  // namespace crepes::faults
