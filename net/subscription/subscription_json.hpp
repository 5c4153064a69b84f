/// The datagrams of the pose subscription: requests and replies, one JSON object each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

/// The longest datagram of the subscription, in either direction.
inline constexpr std::size_t kMaxSubscriptionDatagram = 1200;

/// Starts the delivery of poses, or ends it if `enable` is false.
struct WatchRequest {
  bool enable = true;
  std::optional<double> rate_hz;              ///< positive; empty: every pose
  std::optional<std::vector<RobotId>> peers;  ///< empty: all neighbors
};

/// The part of the state that a STATUS reports.
enum class StatusPart : std::uint8_t { kAll, kSensors, kNetwork, kTeam, kPair };

/// Requests a STATUS, in short or one part of it.
struct PollRequest {
  std::optional<RobotId> peer;  ///< report only this neighbor, in full; with kTeam any robot
  StatusPart about = StatusPart::kAll;
  std::optional<std::string> sensor;  ///< report only this sensor, in full
};

/// A request of a client, parsed.
struct SubscriptionRequest {
  std::variant<WatchRequest, PollRequest> what;
  std::string cookie;  ///< empty: none
};

/// Errors have ErrorCode::kFormat and a message for error_json().
[[nodiscard]] Result<SubscriptionRequest> parse_request(std::string_view datagram);

/// All replies are valid UTF-8 of at most kMaxSubscriptionDatagram bytes, without null or NaN.
[[nodiscard]] std::string version_json(std::string_view release, double lease_s);
[[nodiscard]] std::string cookie_json(std::string_view cookie);
/// `name` is the neighbor's; `sequence` counts this client's poses. `t_pub_ns` is the time when the
/// estimator published the pose, on the clock of `t_ns`.
[[nodiscard]] std::string pose_json(std::uint64_t sequence, RobotId self, std::string_view name,
                                    const NeighborPose& pose);
/// `about` is kAll, kSensors or kNetwork. Omits the least important parts and sets
/// `"truncated":true` when the whole would not fit. `"more":[ids]` lists neighbors that are
/// omitted.
[[nodiscard]] std::string status_json(const SystemStatus& status,
                                      StatusPart about = StatusPart::kAll);
/// Everything about one neighbor; empty if the neighbor is unknown.
[[nodiscard]] std::optional<std::string> peer_status_json(const SystemStatus& status, RobotId peer);
/// Everything about one sensor, by its name in STATUS; empty if there is none.
[[nodiscard]] std::optional<std::string> sensor_status_json(const SystemStatus& status,
                                                            std::string_view sensor);
/// The robots as the team's filter knows them; or one of them in full, empty if it is no member.
[[nodiscard]] std::string team_status_json(const SystemStatus& status);
[[nodiscard]] std::optional<std::string> team_status_json(const SystemStatus& status,
                                                          RobotId robot);
/// What a neighbor's filter knows of the sensors; empty if the neighbor is unknown.
[[nodiscard]] std::optional<std::string> pair_status_json(const SystemStatus& status, RobotId peer);
[[nodiscard]] std::string error_json(std::string_view message);

}  // namespace crepes
