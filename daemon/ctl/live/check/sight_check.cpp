#include "daemon/ctl/live/check/sight_check.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>

#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

void check_foreign(const RobotObservation& seen, CheckSection& section) {
  const std::uint64_t more = growth(seen.before.estimator, seen.after.estimator, "foreign_boards");
  if (more == 0) return;
  section.doubt(fmt::format("{} lights blink nearly as a member, but are none", more),
                "another swarm is in view: give one of the two patterns of another length "
                "(crepesctl codebook)");
}

/// What an accelerometer at rest measures.
void check_gravity(const client::Status& status, CheckSection& section) {
  constexpr double kAtRest = 0.05;    // rad/s
  constexpr double kTolerance = 0.1;  // m/s^2
  constexpr double kMilli = 1e-3;
  const client::Status::Sensor* const imu = sensor_of(status, "imu");
  if (imu == nullptr || total(imu->counts, "force_mmps2") == 0) return;
  const double force = kMilli * static_cast<double>(total(imu->counts, "force_mmps2"));
  const double turn = kMilli * static_cast<double>(total(imu->counts, "turn_mradps"));
  const std::string text = fmt::format("gravity measures {} m/s^2", fixed(force, 2));
  if (turn > kAtRest) {
    section.doubt(text + " while the robot turns", "hold it still and check again");
  } else if (std::abs(force - kNominalGravityMps2) > kTolerance) {
    section.doubt(text, "hold it still and check again; if it stays so: crepesctl calibrate imu");
  } else {
    section.good(text);
  }
}

void check_agreement(const RobotObservation& seen, const client::Status::Neighbor& neighbor,
                     CheckSection& section) {
  constexpr double kContradiction = 0.2;
  constexpr std::uint64_t kEnough = 10;
  struct Kind {
    const char* key;
    const char* words;
    const char* advice;
  };
  constexpr std::array kKinds{
      Kind{"bearing", "directions to {}", "crepesctl calibrate camera; measure p_body_led of both"},
      Kind{"range", "ranges to {}",
           "crepesctl calibrate range; measure p_body_uwb of both; is "
           "something between the antennas?"}};
  for (const Kind& kind : kKinds) {
    const MeasurementFlow flow = flow_of(seen, neighbor, kind.key);
    const std::uint64_t judged = flow.fused + flow.gated;  // all others met no estimate
    if (judged < kEnough) continue;
    const double share = static_cast<double>(flow.gated) / static_cast<double>(judged);
    const std::string text = fmt::format(
        "{}: {} % contradict the estimate",
        fmt::format(fmt::runtime(kind.words), name_of_neighbor(neighbor)), fixed(100.0 * share, 1));
    if (share > kContradiction) {
      section.doubt(text, kind.advice);
    } else {
      section.good(text);
    }
  }
}

}  // namespace

void check_board(const RobotObservation& seen, CheckSection section) {
  bool is_seen = false;
  std::string unseen_by;
  for (const auto& neighbor : seen.after.neighbors) {
    if (is_silent(neighbor)) continue;  // see mesh
    const MeasurementFlow flow = flow_of(seen, neighbor, "peer_bearing");
    if (flow.all > 0) {
      section.good(fmt::format("{} sees our board, {} times a second", name_of_neighbor(neighbor),
                               fixed(static_cast<double>(flow.all) / seen.duration_s, 0)));
      is_seen = true;
    } else {
      unseen_by += (unseen_by.empty() ? "" : ", ") + name_of_neighbor(neighbor);
    }
  }
  check_foreign(seen, section);
  if (is_seen) return;
  if (unseen_by.empty())
    return section.doubt("no neighbor is heard that could see our board", "see mesh, below");
  section.doubt(fmt::format("our board is not seen by {}", unseen_by),
                "turn the other robot's camera to this one; are the LEDs on? crepesctl led get");
}

void check_calibration(const RobotObservation& seen, CheckSection section) {
  const std::string advice = "crepesctl calibrate, and see calibration.md";
  const std::string as_it_says = "as it says; see troubleshooting.md";
  for (const client::Status::Sensor& sensor : seen.after.sensors)
    if (!sensor.calibrated) section.fault(sensor.name + ": " + sensor.message, advice);
  check_gravity(seen.after, section);
  for (const auto& neighbor : seen.after.neighbors) check_agreement(seen, neighbor, section);
  for (const std::string& fault : seen.after.faults)
    section.fault("the team says of this robot: " + fault, as_it_says);
  for (const auto& neighbor : seen.after.neighbors) {
    for (const std::string& fault : neighbor.faults) {
      section.doubt(fmt::format("the team says of {}: {}", name_of_neighbor(neighbor), fault),
                    "there: " + as_it_says);
    }
  }
}

}  // namespace crepes
