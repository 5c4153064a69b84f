/// Settings: the mesh.
#pragma once

#include <string>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// Peers on the mesh.
struct NetConfig {
  std::string interface = "bat0";
  int port = 47474;
  double report_rate_hz = 25.0;
  double air_kbps = 4000.0;
  double broadcast_mbps = 6.0;
  std::string key_file;
  std::string robot_key_file;

  [[nodiscard]] bool operator==(const NetConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("interface", interface, "mesh interface to broadcast on; lo reaches this machine only");
    v.field("port", port, Bounds{1, 65535}, "UDP port of peer traffic");
    v.field("report_rate_hz", report_rate_hz, Bounds{1, 200}, "broadcasts per second");
    v.field("air_kbps", air_kbps, Bounds{50, 100000},
            "what all robots that hear each other may send together, in 1000 bit/s; each takes an "
            "equal share, and never more than 9.5 kB/s and 0.1 kB/s a neighbor");
    v.field("broadcast_mbps", broadcast_mbps, Bounds{1, 54},
            "rate of broadcasts, the lowest basic rate of the Wi-Fi [Mbit/s]: airtime in STATUS");
    v.field("key_file", key_file,
            "the swarm's key, made by crepesctl keygen: datagrams are sealed and unsealed ones "
            "refused; empty: anybody on the mesh can read and write");
    v.field("robot_key_file", robot_key_file,
            "this robot's own key, made by crepesctl keygen: datagrams are signed; its public part "
            "is this robot's swarm.members[].public_key; empty: they are not signed");
  }
};

}  // namespace crepes
