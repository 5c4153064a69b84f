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
  double airtime_of_all = 0.5;
  double broadcast_mbps = 6.0;
  int broadcast_repeats = 3;
  std::string key_file;
  std::string robot_key_file;

  [[nodiscard]] bool operator==(const NetConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("interface", interface, "mesh interface to broadcast on; lo reaches this machine only");
    v.field("port", port, Bounds{1, 65535}, "UDP port of peer traffic");
    v.field("report_rate_hz", report_rate_hz, Bounds{4, 200},
            "reports per second, and datagrams as long as the air suffices; at most "
            "estimator.output_rate_hz");
    v.field("airtime_of_all", airtime_of_all, Bounds{0.01, 1.0},
            "share of the channel's time that all robots that hear each other may take together; "
            "each takes an equal part, and never more than 9.5 kB/s and 0.1 kB/s a neighbor");
    v.field("broadcast_mbps", broadcast_mbps, Bounds{1, 1000},
            "rate of broadcasts, the lowest basic rate of the Wi-Fi [Mbit/s]");
    v.field("broadcast_repeats", broadcast_repeats, Bounds{1, 300},
            "how often a datagram is on the air within range: 3 times with batman-adv, and 3 times "
            "for each robot there that forwards it; 1 without");
    v.field("key_file", key_file,
            "the swarm's key, made by crepesctl keygen: datagrams are sealed and unsealed ones "
            "refused; empty: anybody on the mesh can read and write");
    v.field("robot_key_file", robot_key_file,
            "this robot's own key, made by crepesctl keygen: datagrams are signed; its public part "
            "is this robot's swarm.members[].public_key; empty: they are not signed");
  }
};

}  // namespace crepes
