#include "tests/faults/sensor_faults.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace crepes::faults {
namespace {

constexpr double kSpike_radps = 30.0;
constexpr double kSpike_mps2 = 80.0;
constexpr double kSaturation_radps = 34.9;
constexpr double kSaturation_mps2 = 156.9;
constexpr double kImageWidth = 1280.0;
constexpr double kImageHeight = 1024.0;
constexpr std::size_t kLateSamples = 2;  // 20 ms
constexpr std::size_t kLateFrames = 2;   // 33 ms

/// The value of `count` readings before.
template <class Value>
Value delayed(std::deque<Value>& earlier, Value now, std::size_t count) {
  earlier.push_back(std::move(now));
  if (earlier.size() > count + 1) earlier.pop_front();
  return earlier.front();
}

}  // namespace

bool SensorFault::change(Event& event) {
  if (auto* const sample = std::get_if<ImuSample>(&event)) return change(*sample);
  if (auto* const range = std::get_if<UwbRange>(&event)) return change(*range);
  if (auto* const frame = std::get_if<SpotFrame>(&event)) return change(*frame);
  return true;
}

bool SensorFault::change(ImuSample& sample) {
  const Timestamp stamp = sample.stamp;
  switch (fault_.kind) {
    case Kind::kImuStuck:
      if (!first_sample_) first_sample_ = sample;
      sample = *first_sample_;
      break;
    case Kind::kImuSpikes:
      if (dice_.happens(0.1 * fault_.rate)) {
        const auto axis = static_cast<Eigen::Index>(dice_.below(3));
        (dice_.happens(0.5) ? sample.gyro_radps(axis) += kSpike_radps
                            : sample.accel_mps2(axis) += kSpike_mps2);
      }
      break;
    case Kind::kImuSaturated:
      sample.gyro_radps(0) = kSaturation_radps;
      sample.accel_mps2(2) = kSaturation_mps2;
      break;
    case Kind::kImuAxesSwapped:
      std::swap(sample.gyro_radps(0), sample.gyro_radps(1));
      std::swap(sample.accel_mps2(0), sample.accel_mps2(2));
      break;
    case Kind::kImuGap:
      return false;
    case Kind::kImuHalfRate:
      return dice_.happens(0.5);
    case Kind::kImuSlow:
      return averages(sample);
    case Kind::kImuScaled:
      sample.gyro_radps *= 1.0 + fault_.rate;
      break;
    case Kind::kImuLate:
      sample = delayed(earlier_samples_, sample, kLateSamples);
      break;
    default:
      break;
  }
  sample.stamp = stamp;
  return true;
}

/// As a sensor that is set to a lower rate: means over longer intervals.
bool SensorFault::averages(ImuSample& sample) {
  summed_.push_back(sample);
  if (static_cast<double>(summed_.size()) < std::ceil(6.0 * fault_.rate)) return false;
  ImuSample mean{.stamp = sample.stamp};
  for (const ImuSample& each : summed_) {
    mean.gyro_radps += each.gyro_radps / static_cast<double>(summed_.size());
    mean.accel_mps2 += each.accel_mps2 / static_cast<double>(summed_.size());
  }
  summed_.clear();
  sample = mean;
  return true;
}

bool SensorFault::change(UwbRange& range) {
  switch (fault_.kind) {
    case Kind::kUwbConstant:
      range.range_m = 3.21;
      return true;
    case Kind::kUwbOffset:
      range.range_m += 1.5 * fault_.rate;
      return true;
    case Kind::kUwbNegative:
      range.range_m = -range.range_m;
      return true;
    case Kind::kUwbWrongIds:
      range.neighbor = RobotId{static_cast<std::uint16_t>(1 + dice_.below(9))};
      return true;
    case Kind::kUwbNoSight:
      range.range_m += dice_.between(0.3, 0.3 + 1.2 * fault_.rate);
      return true;
    case Kind::kUwbSlow:
      return dice_.happens(0.04);
    case Kind::kUwbGap:
      return false;
    default:
      return true;
  }
}

bool SensorFault::change(SpotFrame& frame) {
  switch (fault_.kind) {
    case Kind::kCameraFrozen:
      if (!first_spots_) first_spots_ = frame.spots;
      frame.spots = *first_spots_;
      return true;
    case Kind::kCameraBlack:
      frame.spots.clear();
      return true;
    case Kind::kCameraWhite:
      for (int i = 0; i < 100 * fault_.rate; ++i) frame.spots.push_back(random_spot());
      return true;
    case Kind::kCameraLosesFrames:
      return !dice_.happens(0.8 * fault_.rate);
    case Kind::kCameraLate:
      frame.spots = delayed(earlier_spots_, std::move(frame.spots), kLateFrames);
      return true;
    case Kind::kCameraMirrors:
      for (std::size_t i = 0, count = frame.spots.size(); i < count; ++i) {
        frame.spots.push_back(frame.spots[i]);
        frame.spots.back().v_px = kImageHeight - frame.spots.back().v_px;
      }
      return true;
    case Kind::kCameraOtherCodes:  // a board elsewhere blinks as the first visible one does
      if (frame.spots.empty()) return true;
      frame.spots.push_back(frame.spots.front());
      frame.spots.back().u_px = kImageWidth - frame.spots.back().u_px;
      return true;
    default:
      return true;
  }
}

Spot SensorFault::random_spot() {
  return {.u_px = dice_.between(100, kImageWidth - 100),
          .v_px = dice_.between(100, kImageHeight - 104),
          .area_px2 = 12.0,
          .peak = 200.0};
}

bool SensorFaults::operator()(RobotId robot, double true_s, Event& event) {
  return std::ranges::all_of(faults_, [&](SensorFault& fault) {
    return !fault.hits(robot, true_s) || fault.change(event);
  });
}

}  // namespace crepes::faults
