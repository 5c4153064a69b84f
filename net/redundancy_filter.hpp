/// Senders repeat recent measurements because datagrams get lost; this passes each one once.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <tuple>

#include "estimator/core/measurements.hpp"

namespace crepes {

class RedundancyFilter {
 public:
  /// Removes from `report` what was passed before. Stamps must be the sender's own: they are the
  /// same in every copy.
  void apply(PeerReport& report);

 private:
  using Time = std::int64_t;
  /// A board and its mirror image differ by their direction alone.
  using BearingKey = std::tuple<Time, RobotId, std::array<double, 6>>;  ///< camera and direction

  std::set<std::tuple<Time>> imu_;
  std::set<BearingKey> bearings_;
  std::set<std::tuple<Time, RobotId>> ranges_;
  std::set<std::tuple<Time, RobotId>> estimates_;
};

}  // namespace crepes
