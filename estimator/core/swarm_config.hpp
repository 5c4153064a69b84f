/// Settings: the members of the swarm.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// One robot of the swarm: how it blinks, where its LED ring and antenna are mounted, and how it
/// proves on the mesh that it is itself.
struct MemberConfig {
  RobotId id{};
  std::string name;
  std::optional<std::string> pattern;
  std::optional<double> duty;
  std::optional<int> uwb_id;
  Eigen::Vector3d p_body_led = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_body_uwb = Eigen::Vector3d::Zero();
  std::optional<double> ring_radius_m;
  std::optional<int> ring_leds;
  double range_delay_m = 0.0;
  std::optional<std::string> public_key;
  bool excluded = false;

  [[nodiscard]] bool operator==(const MemberConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("id", id, Bounds{1, 65534}, "robot id");
    v.required("name", name, "robot name, as in outputs");
    v.field("pattern", pattern,
            "blink pattern, one character per slot: 1 lit, 0 dark; either this or duty");
    v.field("duty", duty, Bounds{0.05, 0.95},
            "lit share of swarm.period_ms; either this or pattern");
    v.field("uwb_id", uwb_id, Bounds{0, 2147483647},
            "id of the UWB module; if omitted: the robot id");
    v.field("p_body_led", p_body_led, Bounds{-5, 5},
            "center of the LED ring in the body frame [m]");
    v.field("p_body_uwb", p_body_uwb, Bounds{-5, 5}, "UWB antenna in the body frame [m]");
    v.field(
        "ring_radius_m", ring_radius_m, Bounds{0.005, 1},
        "radius of the LED ring, of a square board half its edge (of four LEDs half its "
        "diagonal); with it, a camera that can tell the LEDs apart measures the distance by the "
        "ring's size; if omitted: not used");
    v.field("ring_leds", ring_leds, Bounds{4, 16},
            "LEDs of the ring; if omitted: of any number but four, which may be a part of a ring");
    v.field(
        "range_delay_m", range_delay_m, Bounds{-5, 5},
        "antenna delay of the UWB module, as crepesctl calibrate range finds it: a pair's ranges "
        "are too long by the sum of its two");
    v.field("public_key", public_key,
            "as crepesctl keygen prints it: only what this robot has signed is believed to be from "
            "it; if omitted: anybody with the swarm's key can speak for it");
    v.field("excluded", excluded,
            "a lost robot: nothing that it sends is read, and its key is believed no more");
  }
};

struct SwarmConfig {
  double slot_ms = 10.0;
  double period_ms = 50.0;
  std::vector<MemberConfig> members;

  [[nodiscard]] bool operator==(const SwarmConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("slot_ms", slot_ms, Bounds{2, 70}, "duration of one slot of a blink pattern");
    v.field("period_ms", period_ms, Bounds{10, 200}, "period of a duty-coded board");
    v.reference("members_file",
                "instead of members: a file with only the section swarm, shared by all robots");
    v.list("members", members, "all robots of the swarm, this one included");
  }
};

}  // namespace crepes
