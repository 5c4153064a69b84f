#include "daemon/ctl/live/check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/live/check/robot_check.hpp"
#include "daemon/ctl/live/full_status.hpp"
#include "daemon/ctl/live/neighbor_view.hpp"
#include "daemon/ctl/live/own_board.hpp"
#include "daemon/ctl/live/screen_text.hpp"
#include "daemon/ctl/live/walk_around.hpp"
#include "drivers/base/monotonic_clock.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

/// The newest pose of each neighbor within some seconds.
Result<std::map<RobotId, client::Pose>> watch_poses(const DaemonAddress& daemon,
                                                    double duration_s) {
  constexpr std::chrono::milliseconds kPatience{50};
  const MonotonicClock clock;
  Result<client::Connection> connection = connect(daemon, {});
  if (!connection) return tl::unexpected(connection.error());
  std::map<RobotId, client::Pose> poses;
  for (const Timestamp end = clock.now() + from_seconds(duration_s); clock.now() < end;) {
    const auto answer = connection->receive(kPatience);
    if (!answer) continue;
    if (const auto* heard = std::get_if<client::Pose>(&answer->message))
      poses[RobotId{heard->peer}] = *heard;
  }
  return poses;
}

Result<RobotObservation> observe(const CheckOptions& options) {
  RobotObservation seen;
  if (!options.config.empty()) {
    Result<Config> config = load_config(options.config);
    if (!config) return tl::unexpected(config.error());
    seen.config = std::move(*config);
  }
  const MonotonicClock clock;
  Result<FullStatus> before = request_full_status(options.daemon);
  if (!before) return tl::unexpected(before.error());
  const Timestamp start = clock.now();
  auto poses = watch_poses(options.daemon, options.duration_s);
  if (!poses) return tl::unexpected(poses.error());
  Result<FullStatus> after = request_full_status(options.daemon);
  if (!after) return tl::unexpected(after.error());
  seen.before = std::move(before->message);
  seen.after = std::move(after->message);
  seen.config_state = config_state_of(after->json);
  seen.duration_s = to_seconds(clock.now() - start);
  seen.poses = std::move(*poses);
  return seen;
}

std::string text_of(const std::vector<CheckFinding>& findings, const RobotObservation& seen) {
  constexpr std::size_t kColumns = 100;
  constexpr std::size_t kText = 9;     // where a finding's text begins
  constexpr std::size_t kAdvice = 12;  // and an advice's
  std::string text;
  std::string about;
  for (const CheckFinding& finding : findings) {
    if (finding.about != about) text += finding.about + "\n";
    about = finding.about;
    const std::string said = wrapped(finding.text, kColumns, kText, kText);
    text += fmt::format("  {:<5}  {}\n", name_of(finding.verdict), said);
    if (finding.advice.empty()) continue;
    text += fmt::format("{:>{}}{}\n", "-> ", kAdvice,
                        wrapped(finding.advice, kColumns, kAdvice, kAdvice));
  }
  const std::string places = places_text(seen.poses);
  if (places.empty()) return text;
  return text + "\nCompare, and walk one robot around the other:\n" + places;
}

Json json_of(const std::vector<CheckFinding>& findings, const client::Status& status,
             bool is_good) {
  Json json{{"ok", is_good}, {"self", status.self}, {"findings", Json::array()}};
  for (const CheckFinding& finding : findings) {
    Json one{{"about", finding.about},
             {"verdict", std::string(name_of(finding.verdict))},
             {"text", finding.text}};
    if (!finding.advice.empty()) one["advice"] = finding.advice;
    json["findings"].push_back(std::move(one));
  }
  return json;
}

/// Behind the last one of its section.
void add(std::vector<CheckFinding>& findings, CheckFinding finding) {
  const auto last =
      std::ranges::find(findings.rbegin(), findings.rend(), finding.about, &CheckFinding::about);
  findings.insert(last.base(), std::move(finding));
}

/// What the members are: with --config from there.
Result<SwarmConfig> members_of(const CheckOptions& options, const RobotObservation& seen) {
  if (seen.config) return seen.config->swarm;
  return fail(ErrorCode::kUsage,
              "--led: --config must name the daemon's configuration, which has " +
                  options.led_port + "'s pattern");
}

/// The newest pose of a neighbor, watched for a second each time.
Result<std::vector<CheckFinding>> walk(const CheckOptions& options, const client::Status& status) {
  const std::optional<RobotId> id = neighbor_named(status, options.walk);
  if (!id) return fail(ErrorCode::kUsage, "--walk: there is no neighbor " + options.walk);
  const auto pose_now = [&]() -> std::optional<client::Pose> {
    const auto poses = watch_poses(options.daemon, 1.0);
    if (!poses || !poses->contains(*id)) return std::nullopt;
    return poses->at(*id);
  };
  return walk_around(options.walk, options.distance_m, pose_now, std::cin, std::cerr);
}

}  // namespace

Result<CheckReport> check(const CheckOptions& options) {
  const Result<RobotObservation> seen = observe(options);
  if (!seen) return tl::unexpected(seen.error());
  std::vector<CheckFinding> findings = check_robot(*seen);
  if (!options.led_port.empty()) {
    const auto swarm = members_of(options, *seen);
    if (!swarm) return tl::unexpected(swarm.error());
    add(findings, check_own_board(options.led_port, *swarm, RobotId{seen->after.self}));
  }
  if (!options.walk.empty()) {
    const auto walked = walk(options, seen->after);
    if (!walked) return tl::unexpected(walked.error());
    findings.insert(findings.end(), walked->begin(), walked->end());
  }
  CheckReport report;
  report.is_good = std::ranges::count(findings, CheckVerdict::kFault, &CheckFinding::verdict) == 0;
  report.text = options.json ? json_line(json_of(findings, seen->after, report.is_good))
                             : text_of(findings, *seen);
  return report;
}

}  // namespace crepes
