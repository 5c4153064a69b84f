/// The pose subscription's datagrams: requests in, answers out, one JSON object each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// No datagram of the subscription is longer, in either direction.
inline constexpr std::size_t kMaxSubscriptionDatagram = 1200;

/// "Send me poses from now on", or with `enable` false, "no more".
struct WatchRequest {
  bool enable = true;
  std::optional<double> rate_hz;              ///< positive; as fast as poses come where left out
  std::optional<std::vector<RobotId>> peers;  ///< everyone where left out
};

/// What a STATUS is about.
enum class StatusPart : std::uint8_t { kAll, kSensors, kNetwork };

/// "What is your state?", in short or in one part.
struct PollRequest {
  std::optional<RobotId> peer;  ///< everything about this neighbor, and nothing else
  StatusPart about = StatusPart::kAll;
};

struct SubscriptionRequest {
  std::variant<WatchRequest, PollRequest> what;
  std::string cookie;  ///< empty where there is none
};

/// Errors are of ErrorCode::kFormat, with a message that suits error_json().
[[nodiscard]] Result<SubscriptionRequest> parse_request(std::string_view datagram);

/// All answers are valid UTF-8 of at most kMaxSubscriptionDatagram bytes, without null or NaN.
[[nodiscard]] std::string version_json(std::string_view release, double lease_s);
[[nodiscard]] std::string cookie_json(std::string_view cookie);
/// `name` is the neighbor's; `sequence` counts this client's poses. `t_pub_ns` is when the
/// estimator gave the pose away, on the clock of `t_ns`.
[[nodiscard]] std::string pose_json(std::uint64_t sequence, RobotId self, std::string_view name,
                                    const NeighborPose& pose);
/// Drops the least important parts, and says `"truncated":true`, where it would not fit; neighbors
/// that are left out are named by `"more":[ids]`.
[[nodiscard]] std::string status_json(const SystemStatus& status,
                                      StatusPart about = StatusPart::kAll);
/// All about one neighbor; empty if it is not known.
[[nodiscard]] std::optional<std::string> peer_status_json(const SystemStatus& status, RobotId peer);
[[nodiscard]] std::string error_json(std::string_view message);

}  // namespace crepes
