/// Senders repeat recent measurements because datagrams get lost. This filter passes each once.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <tuple>

#include "estimator/core/measurements.hpp"

namespace crepes {

class RedundancyFilter {
 public:
  /// Removes measurements that were passed before. Stamps must be on the sender's clock, where they
  /// are equal in every copy. Memory is bounded whatever the stamps are.
  void remove_repeated(PeerReport& report);
  /// Measurements that are remembered.
  [[nodiscard]] std::size_t size() const {
    return imu_.size() + bearings_.size() + ranges_.size() + estimates_.size();
  }

 private:
  using Time = std::int64_t;
  /// A board and its mirror image differ only in direction.
  using BearingKey = std::tuple<Time, RobotId, std::array<double, 6>>;  ///< camera and direction

  std::set<std::tuple<Time>> imu_;
  std::set<BearingKey> bearings_;
  std::set<std::tuple<Time, RobotId>> ranges_;
  std::set<std::tuple<Time, RobotId>> estimates_;
};

}  // namespace crepes
