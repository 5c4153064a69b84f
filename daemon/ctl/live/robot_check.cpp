#include "daemon/ctl/live/robot_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "daemon/ctl/live/light_advice.hpp"
#include "daemon/ctl/live/pose_advice.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "net/mesh/mesh_counters.hpp"

namespace crepes {
namespace {

using Findings = std::vector<CheckFinding>;
using SensorLine = client::Status::Sensor;
using Counts = client::Status::Totals;

std::uint64_t total(const Counts& totals, const std::string& name) {
  const auto found = totals.find(name);
  return found == totals.end() ? 0 : found->second;
}

/// By how much a total grew. A daemon that restarted in between counts from zero.
std::uint64_t growth(const Counts& before, const Counts& after, const std::string& name) {
  const std::uint64_t first = total(before, name);
  const std::uint64_t last = total(after, name);
  return last > first ? last - first : 0;
}

/// For example "missed 3, incomplete 1": what grew.
std::string growth_text(const Counts& before, const Counts& after) {
  std::string text;
  for (const auto& [name, value] : after) {
    const std::uint64_t more = growth(before, after, name);
    if (more > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, more);
  }
  return text;
}

template <class T, class Key, class Member>
const T* find_in(const std::vector<T>& items, const Key& key, Member member) {
  const auto found = std::ranges::find(items, key, member);
  return found == items.end() ? nullptr : &*found;
}

const SensorLine* sensor_of(const client::Status& status, const std::string& name) {
  return find_in(status.sensors, name, &SensorLine::name);
}

constexpr std::string_view kSpots = " spots";

bool is_spots(const SensorLine& sensor) { return sensor.name.ends_with(kSpots); }

std::string name_of_neighbor(const client::Status::Neighbor& neighbor) {
  return neighbor.name.empty() ? fmt::format("robot {}", neighbor.peer) : neighbor.name;
}

/// Collects the findings of one section.
class Section {
 public:
  Section(std::string about, Findings& findings) : about_(std::move(about)), findings_(findings) {}

  void good(std::string text) { add(CheckVerdict::kGood, std::move(text), ""); }
  void doubt(std::string text, std::string advice) {
    add(CheckVerdict::kDoubt, std::move(text), std::move(advice));
  }
  void fault(std::string text, std::string advice) {
    add(CheckVerdict::kFault, std::move(text), std::move(advice));
  }

 private:
  void add(CheckVerdict verdict, std::string text, std::string advice) {
    findings_.push_back({about_, verdict, std::move(text), std::move(advice)});
  }

  std::string about_;
  Findings& findings_;
};

void check_sensors(const RobotObservation& seen, Section section) {
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

void check_rate(const std::string& name, double rate_hz, double wanted_hz, Section& section) {
  constexpr double kLeast = 0.9;
  constexpr double kMost = 1.1;
  const std::string text =
      fmt::format("{}: {} of {} Hz", name, fixed(rate_hz, 1), fixed(wanted_hz, 0));
  if (rate_hz >= kLeast * wanted_hz && rate_hz <= kMost * wanted_hz) return section.good(text);
  section.doubt(text, rate_hz < wanted_hz
                          ? "the device is set otherwise, or the computer or its cable is too slow"
                          : "set the key to what the device does");
}

void check_spot_rate(const SensorLine& spots, const client::Status& status, Section& section) {
  constexpr double kSlow = 20e3;  // us from a picture to its spots
  constexpr double kShare = 0.9;
  const SensorLine* const camera =
      sensor_of(status, spots.name.substr(0, spots.name.size() - kSpots.size()));
  const auto delay_us = static_cast<double>(total(spots.counts, "delay_p99_us"));
  if (camera != nullptr && spots.rate_hz < kShare * camera->rate_hz) {
    section.doubt(fmt::format("{}: {} Hz, the camera has {}", spots.name, fixed(spots.rate_hz, 1),
                              fixed(camera->rate_hz, 1)),
                  "the computer is too slow: end other programs, or lower rate_hz");
  } else if (delay_us > kSlow) {
    section.doubt(
        fmt::format("{}: {} ms from picture to spots", spots.name, fixed(1e-3 * delay_us, 1)),
        "the computer is too slow, or the picture too bright");
  } else {
    section.good(fmt::format("{}: {} Hz, {} ms", spots.name, fixed(spots.rate_hz, 1),
                             fixed(1e-3 * delay_us, 1)));
  }
}

void check_rates(const RobotObservation& seen, Section section) {
  for (const SensorLine& sensor : seen.after.sensors) {
    if (sensor.name == "mesh") continue;  // it has a section of its own
    if (is_spots(sensor)) {
      check_spot_rate(sensor, seen.after, section);
    } else if (sensor.rate_hz <= 0.0) {
      section.fault(sensor.name + ": silent", "see sensors, above");
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

void check_clocks(const RobotObservation& seen, Section section) {
  constexpr double kCoarse = 1e-3;  // s
  constexpr double kBadSkew = 100.0;
  for (const auto& neighbor : seen.after.neighbors) {
    const std::string name = name_of_neighbor(neighbor);
    if (!neighbor.reports || neighbor.reports->received == 0) continue;  // see mesh
    const auto* const clock =
        find_in(seen.after.clocks, neighbor.peer, &client::Status::Clock::peer);
    if (clock == nullptr) {
      section.fault(name + ": clock offset unknown",
                    "wait two seconds; if it stays so, packets arrive in one direction only");
      continue;
    }
    const std::string text = fmt::format("{}: known to {} ms, {} ppm", name,
                                         fixed(1e3 * clock->sigma_s, 3), fixed(clock->skew_ppm, 1));
    if (clock->sigma_s > kCoarse) {
      section.doubt(text, "many packets are late or lost: see mesh, below");
    } else if (std::abs(clock->skew_ppm) > kBadSkew) {
      section.doubt(text, "one of the two computers has a bad clock, or steps it: see chrony");
    } else {
      section.good(text);
    }
  }
}

void check_picture(const SensorLine& spots, Section& section) {
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

/// How many measurements of a kind came, and how many of them were refused as unlikely.
struct Flow {
  std::uint64_t all = 0;
  std::uint64_t gated = 0;
};

Flow flow_of(const RobotObservation& seen, const client::Status::Neighbor& now,
             const std::string& kind) {
  const auto* const then =
      find_in(seen.before.neighbors, now.peer, &client::Status::Neighbor::peer);
  const auto after = now.measurements.find(kind);
  if (after == now.measurements.end()) return {};
  const auto before = then == nullptr ? after : then->measurements.find(kind);
  const bool is_new = then == nullptr || before == then->measurements.end();
  const Counts none;
  Flow flow;
  for (const auto& [verdict, value] : after->second) {
    const std::uint64_t more = growth(is_new ? none : before->second, after->second, verdict);
    flow.all += more;
    if (verdict == "gated") flow.gated += more;
  }
  return flow;
}

void check_board(const RobotObservation& seen, Section section) {
  bool is_seen = false;
  std::string unseen_by;
  for (const auto& neighbor : seen.after.neighbors) {
    if (!neighbor.reports || neighbor.reports->received == 0) continue;
    const Flow flow = flow_of(seen, neighbor, "peer_bearing");
    if (flow.all > 0) {
      section.good(fmt::format("{} sees our board, {} times a second", name_of_neighbor(neighbor),
                               fixed(static_cast<double>(flow.all) / seen.duration_s, 0)));
      is_seen = true;
    } else {
      unseen_by += (unseen_by.empty() ? "" : ", ") + name_of_neighbor(neighbor);
    }
  }
  if (is_seen) return;
  section.doubt(unseen_by.empty() ? "no neighbor is heard that could see our board"
                                  : fmt::format("our board is not seen by {}", unseen_by),
                "turn the other robot's camera to this one; are the LEDs on? crepesctl led get");
}

void check_keys(const client::Status::Mesh& mesh, Section& section) {
  const std::string keys = "crepesctl keygen makes keys: see MESH.md";
  if (!mesh.sealed) {
    section.doubt("not sealed: whoever is on the mesh can read and forge", keys);
  } else if (!mesh.warning.empty()) {
    section.doubt(mesh.warning, keys);
  } else {
    section.good(mesh.signs ? "sealed and signed" : "sealed");
  }
}

void check_air(const client::Status::Mesh& mesh, Section& section) {
  constexpr double kBusy = 0.5;
  constexpr double kFull = 0.9;
  const std::string text =
      fmt::format("{} % of the air by all that are heard", fixed(100.0 * mesh.airtime_of_all, 1));
  const std::string advice =
      "raise the Wi-Fi's basic rate and net.broadcast_mbps, or lower net.airtime_of_all";
  if (mesh.airtime_of_all > kFull) return section.fault(text, advice);
  if (mesh.airtime_of_all > kBusy) return section.doubt(text, advice);
  section.good(text);
}

void check_link(const client::Status::Neighbor& neighbor, Section& section) {
  constexpr double kLossy = 0.2;
  constexpr double kLost = 0.6;
  constexpr double kSilent = 2.0;  // s
  const std::string name = name_of_neighbor(neighbor);
  if (!neighbor.reports || neighbor.reports->received == 0) {
    return section.fault(name + ": never heard",
                         std::string(advice_for(NoPoseReason::kNeverHeard)));
  }
  if (neighbor.reports->age_s > kSilent) {
    return section.fault(
        fmt::format("{}: silent for {} s", name, fixed(neighbor.reports->age_s, 0)),
        std::string(advice_for(NoPoseReason::kSilent)));
  }
  const std::string text =
      fmt::format("{}: {} % lost", name, fixed(100.0 * neighbor.reports->loss, 0));
  const std::string advice = "come nearer, or use another channel";
  if (neighbor.reports->loss > kLost) return section.fault(text, advice);
  if (neighbor.reports->loss > kLossy) return section.doubt(text, advice);
  section.good(text);
}

void check_mesh(const RobotObservation& seen, Section section) {
  if (seen.after.mesh) {
    check_keys(*seen.after.mesh, section);
    check_air(*seen.after.mesh, section);
  }
  if (seen.after.neighbors.empty())
    section.doubt("no other robot is a member of the swarm", "add it to swarm.members");
  for (const auto& neighbor : seen.after.neighbors) check_link(neighbor, section);
  std::string refused;
  for (std::size_t i = 0; i < kMeshCounterCount; ++i) {
    const auto counter = static_cast<MeshCounter>(i);
    const std::string name(name_of(counter));
    const std::uint64_t more = growth(seen.before.network, seen.after.network, name);
    if (more > 0 && is_refusal(counter))
      refused += fmt::format("{}{} {}", refused.empty() ? "" : ", ", name, more);
  }
  if (!refused.empty()) {
    section.doubt(fmt::format("in {} s, {}", fixed(seen.duration_s, 0), refused),
                  "another key, or another version, is on the mesh: see troubleshooting.md");
  }
}

/// What an accelerometer at rest measures.
void check_gravity(const client::Status& status, Section& section) {
  constexpr double kAtRest = 0.05;    // rad/s
  constexpr double kTolerance = 0.1;  // m/s^2
  constexpr double kMilli = 1e-3;
  const SensorLine* const imu = sensor_of(status, "imu");
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
                     Section& section) {
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
    const Flow flow = flow_of(seen, neighbor, kind.key);
    if (flow.all < kEnough) continue;
    const double share = static_cast<double>(flow.gated) / static_cast<double>(flow.all);
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

void check_calibration(const RobotObservation& seen, Section section) {
  const std::string advice = "crepesctl calibrate, and see calibration.md";
  for (const SensorLine& sensor : seen.after.sensors)
    if (!sensor.calibrated) section.fault(sensor.name + ": " + sensor.message, advice);
  check_gravity(seen.after, section);
  for (const auto& neighbor : seen.after.neighbors) check_agreement(seen, neighbor, section);
  for (const std::string& fault : seen.after.faults)
    section.fault("the team says of this robot: " + fault, advice);
  for (const auto& neighbor : seen.after.neighbors) {
    for (const std::string& fault : neighbor.faults) {
      section.doubt(fmt::format("the team says of {}: {}", name_of_neighbor(neighbor), fault),
                    "there: " + advice);
    }
  }
}

/// "12 deg to the left"; a direction in a plane, positive to the left.
std::string side_text(double deg) {
  constexpr double kStraight = 5.0;
  if (std::abs(deg) < kStraight) return "straight ahead";
  return fmt::format("{} deg to the {}", fixed(std::abs(deg), 0), deg > 0 ? "left" : "right");
}

}  // namespace

std::string_view name_of(CheckVerdict verdict) {
  constexpr std::array<std::string_view, 3> kNames{"good", "doubt", "fault"};
  return kNames.at(static_cast<std::size_t>(verdict));
}

std::vector<CheckFinding> check_exposure(const client::Status& status) {
  Findings findings;
  Section section("exposure", findings);
  for (const SensorLine& sensor : status.sensors)
    if (is_spots(sensor)) check_picture(sensor, section);
  return findings;
}

std::vector<CheckFinding> check_robot(const RobotObservation& seen) {
  Findings findings;
  check_sensors(seen, {"sensors", findings});
  check_rates(seen, {"rates", findings});
  check_clocks(seen, {"clocks", findings});
  std::ranges::move(check_exposure(seen.after), std::back_inserter(findings));
  check_board(seen, {"board", findings});
  check_mesh(seen, {"mesh", findings});
  check_calibration(seen, {"calibration", findings});
  return findings;
}

std::string places_text(const std::map<RobotId, client::Pose>& poses) {
  constexpr double kUpsideDown = 90.0;  // deg
  std::string text;
  for (const auto& [id, message] : poses) {
    const NeighborPose pose = neighbor_pose_of(message);
    const Pose& T_B_N = pose.T_B_N.pose;
    const double bearing = kDegPerRad * std::atan2(T_B_N.p.y(), T_B_N.p.x());
    const double height = T_B_N.p.z();
    const Eigen::Vector3d up_N = T_B_N.R().col(2);
    const Eigen::Vector3d up = pose.up_B.value_or(Eigen::Vector3d::UnitZ());
    const double lean = kDegPerRad * std::acos(std::clamp(up_N.dot(up), -1.0, 1.0));
    text += fmt::format("  {} is {} m away, {}, {} m {} along our z{}\n", message.name,
                        fixed(T_B_N.p.norm(), 2), side_text(bearing), fixed(std::abs(height), 2),
                        height < 0 ? "below" : "above", lean > kUpsideDown ? ", upside down" : "");
  }
  return text;
}

}  // namespace crepes
