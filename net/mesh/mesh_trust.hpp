/// Which robots must sign their datagrams, and which are not heard.
#pragma once

#include <map>
#include <set>

#include "estimator/core/measurements.hpp"
#include "net/mesh/packet_signature.hpp"

namespace crepes {

struct MeshTrust {
  std::map<RobotId, PublicKey> keys;  ///< what these robots send is signed with their key
  std::set<RobotId> excluded;         ///< nothing that these robots send is read

  [[nodiscard]] bool operator==(const MeshTrust&) const = default;
};

}  // namespace crepes
