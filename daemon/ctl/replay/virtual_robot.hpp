/// One robot on virtual time: the daemon's stages without their threads, sockets and devices.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "config/reloading/config_change.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "estimator/core/result.hpp"
#include "estimator/swarm/estimator.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "net/mesh/peer_link.hpp"

namespace crepes {

/// Between poses, whatever rate the robot is configured for: what a replay writes is at 50 Hz.
inline constexpr Duration kReplayTick{20'000'000};

/// A datagram that reaches a robot.
struct VirtualDatagram {
  std::vector<std::uint8_t> bytes;
  Endpoint from;
};
/// Only the name of an image; it is decoded when it is due.
struct PendingImage {
  std::uint8_t camera = 0;
  RecordedPicture image;
};
struct Forward {};  ///< what waits for it
using VirtualInput = std::variant<Event, VirtualDatagram, PendingImage, Forward>;

/// What reached a robot since it was switched on.
struct Handed {
  std::uint64_t datagrams = 0;
  std::uint64_t reports = 0;   ///< datagrams that gave one
  std::uint64_t samples = 0;   ///< of its own IMU
  std::uint64_t ranges = 0;    ///< of its own module, to members
  std::uint64_t bearings = 0;  ///< of its own cameras, to members, read
};

/// Time of the processor by stage.
struct StageTimes {
  double vision_s = 0.0;
  double estimator_s = 0.0;
  double graph_s = 0.0;
  double net_s = 0.0;
};

/// The state that the daemon's threads own, for one robot.
struct VirtualRobot {
  /// A robot that is switched off loses what reaches it; a frozen one finds it when it goes on.
  enum class State : std::uint8_t { kOn, kFrozen, kOff };

  /// `sealed`: datagrams are sealed and signed, with the keys of the replay.
  VirtualRobot(RobotRecording recorded, bool sealed);

  /// Begins anew, as after a reboot.
  void restart();
  /// As a reload while the daemon runs. Refused if a rule is broken; then nothing changes.
  [[nodiscard]] Result<ConfigChange> reload(const Config& wanted);

  [[nodiscard]] RobotId id() const { return recording.robot.id; }
  /// What its clock shows.
  [[nodiscard]] Timestamp local(double true_s) const {
    return recording.robot.clock.local(true_s) + clock_shift;
  }
  /// Share of the channel's time that it used.
  [[nodiscard]] double airtime(double duration_s) const;

  RobotRecording recording;
  Estimator estimator;
  TeamSolver team;
  std::optional<PacketSeal> seal;
  std::optional<PacketSigner> signer;
  MeshTrust trust;
  PeerLink link;
  SpotDetector detector;
  Duration clock_shift{};  ///< what its clock is ahead of the recorded one
  State state = State::kOn;
  std::deque<VirtualInput> held;  ///< while it is frozen; as many as the daemon's queue holds
  Handed handed;
  double next_clock_sample_s = 0.0;
  std::map<RobotId, std::uint64_t> id_mistakes;
  std::uint64_t datagrams_sent = 0;
  std::uint64_t bytes_sent = 0;
  StageTimes cpu;

 private:
  [[nodiscard]] PeerLink new_link() const;
};

}  // namespace crepes
