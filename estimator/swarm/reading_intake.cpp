#include "estimator/swarm/reading_intake.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr Duration kRingPeriod = std::chrono::milliseconds{200};
constexpr Duration kWithoutRange = std::chrono::seconds{1};

}  // namespace

ReadingIntake::ReadingIntake(RobotId neighbor, const FilterSettings& settings)
    : settings_(settings), buffer_(settings.lag), outcomes_(neighbor) {}

void ReadingIntake::reconfigure(const FilterSettings& settings) {
  // The waiting readings are meant for the filter of the former profile.
  if (settings.traits != settings_.traits) buffer_.clear();
  settings_ = settings;
  buffer_.set_least_lag(settings.lag);
}

void ReadingIntake::add_report_stamp(Timestamp stamp) {
  last_.heard = std::max(last_.heard, stamp);
}

void ReadingIntake::add_bearing(const Bearing& bearing) {
  last_.seen = std::max(last_.seen, bearing.stamp);
  enqueue({bearing.stamp, MeasurementKind::kBearing,
           DirectionReading{bearing.u_B, bearing.p_B_C, bearing.sigma_rad}});
  if (bearing.distance_m <= 0.0 || bearing.stamp - last_.ranged < kWithoutRange) return;
  // Those of one frame are alternatives: of the board and of its image in a mirror.
  const Duration since = bearing.stamp - ring_distance_;
  if (since != Duration::zero() && since < kRingPeriod) return;
  ring_distance_ = bearing.stamp;
  enqueue({bearing.stamp, MeasurementKind::kRingDistance,
           RingReading{bearing.p_B_C, bearing.distance_m, bearing.distance_sigma_m}});
}

void ReadingIntake::add_peer_bearing(const Bearing& bearing, double sigma_rad) {
  last_.seen_by = std::max(last_.seen_by, bearing.stamp);
  enqueue({bearing.stamp, MeasurementKind::kPeerBearing,
           DirectionReading{bearing.u_B, bearing.p_B_C, sigma_rad}});
}

bool ReadingIntake::add_range(const UwbRange& range, MeasurementKind kind) {
  const auto reading = screen_.accept(range, settings_);
  if (!reading) {
    outcomes_.add(range.stamp, kind, {.verdict = Verdict::kGated}, {range.range_m});
    return false;
  }
  last_.ranged = std::max(last_.ranged, range.stamp);
  enqueue({range.stamp, kind, *reading});
  return true;
}

void ReadingIntake::enqueue(Measurement measurement) {
  const MeasurementKind kind = measurement.kind;
  const Timestamp stamp = measurement.stamp;
  const SensorReading reading = reading_of(measurement);
  const bool is_pose = kind == MeasurementKind::kRawPose || kind == MeasurementKind::kGraphPose;
  if (!is_pose && !settings_.traits.fuses_single_readings) return;
  const std::uint64_t dropped = buffer_.dropped();
  if (!buffer_.push(std::move(measurement))) {
    outcomes_.add(stamp, kind, {.verdict = Verdict::kLate}, reading);
  } else {
    earliest_new_ = std::min(earliest_new_.value_or(stamp), stamp);
  }
  if (buffer_.dropped() > dropped) outcomes_.add(stamp, kind, {.verdict = Verdict::kSkipped});
}

}  // namespace crepes
