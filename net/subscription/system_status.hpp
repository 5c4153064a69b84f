/// The state of the whole daemon, as STATUS reports it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/sensor_totals.hpp"
#include "estimator/core/outputs.hpp"
#include "net/mesh/peer_status.hpp"

namespace crepes {

/// The state of a sensor.
struct SensorStatus {
  std::string name;
  double rate_hz = 0.0;
  bool ok = false;
  std::string message;  ///< the fault and its remedy
  SensorTotals totals{};
  bool is_calibrated = true;  ///< false: a camera whose lens is a guess
};

/// The drops of one queue.
struct QueueStatus {
  std::string name;
  std::uint64_t dropped = 0;
};

/// The active configuration.
struct ConfigStatus {
  int generation = 1;                ///< 1 at start; incremented by each applied reload
  Timestamp since{};                 ///< time of the last applied reload, or of the start
  std::vector<std::string> restart;  ///< changed keys that need a restart
  std::string fault;                 ///< why the last reload was refused; empty if it was not
};

/// The reply to POLL.
struct SystemStatus {
  RobotId self{};
  std::string name;
  Timestamp stamp{};  ///< time of this state
  double uptime_s = 0.0;
  double cpu_s = 0.0;   ///< of all threads since the start
  double rss_mb = 0.0;  ///< resident memory [10^6 bytes]
  ConfigStatus config;
  double config_age_s = 0.0;
  std::vector<SensorStatus> sensors;
  EstimatorStatus estimator;
  std::vector<ClockStatus> clocks;
  std::vector<PeerTraffic> traffic;
  MeshStatus mesh;
  std::vector<QueueStatus> queues;
  std::vector<std::pair<std::string, std::uint64_t>> network;  ///< datagrams and refusals by reason
};

/// The estimator receives reports of a robot once its clock is known. Where datagrams arrive and
/// the clock is unknown, that is the reason, and not that the robot was never heard. A robot whose
/// own IMU does not show gravity sends nothing, so no clock can become known; then that is it.
void name_unknown_clocks(SystemStatus& status);

}  // namespace crepes
