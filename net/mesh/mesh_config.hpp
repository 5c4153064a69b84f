/// Settings: the mesh.
#pragma once

#include <string>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// Peers on the mesh.
struct NetConfig {
  std::string interface = "bat0";
  int port = 47474;
  double report_rate_hz = 50.0;
  std::string key_file;

  [[nodiscard]] bool operator==(const NetConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("interface", interface, "mesh interface to broadcast on; lo reaches this machine only");
    v.field("port", port, Bounds{1, 65535}, "UDP port of peer traffic");
    v.field("report_rate_hz", report_rate_hz, Bounds{1, 200}, "broadcasts per second");
    v.field("key_file", key_file,
            "the swarm's key, made by crepesctl keygen: datagrams are sealed and unsealed ones "
            "refused; empty: anybody on the mesh can read and write");
  }
};

}  // namespace crepes
