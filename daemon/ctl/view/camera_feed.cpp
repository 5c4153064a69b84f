#include "daemon/ctl/view/camera_feed.hpp"

#include <fmt/core.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/coverage_file.hpp"
#include "daemon/ctl/view/camera_picture.hpp"
#include "daemon/ctl/view/view_json.hpp"
#include "daemon/recording/recipient.hpp"
#include "daemon/recording/unix_socket.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPicturePeriod = 200ms;  // five pictures a second
constexpr Duration kRetry = 1s;
constexpr Duration kPatience = 2s;
constexpr Duration kCoveragePeriod = 1s;
constexpr int kMaxReads = 32;  // of 64 kB a turn

constexpr const char* kElsewhere =
    "pictures stay on the robot: open the page that its own crepesctl view serves";

}  // namespace

std::map<std::uint8_t, std::string> CameraFeed::exchange(Timestamp now,
                                                         const std::vector<std::uint8_t>& wanted,
                                                         const PoseHistory& poses) {
  std::map<std::uint8_t, std::string> events;
  if (wanted.empty()) {
    daemon_.reset();
    asked_.reset();
    return events;
  }
  connect(now);
  if (daemon_) {
    request_picture(now, wanted);
    if (const auto received = receive(now, poses, events); !received)
      hang_up(received.error().message, now);
  }
  if (now >= next_coverage_) {
    next_coverage_ = now + kCoveragePeriod;
    coverage_ = read_coverage(socket_);
  }
  if (std::string state = greeting(); state != sent_state_) {
    sent_state_ = std::move(state);
    for (const std::uint8_t camera : wanted) events[camera].insert(0, sent_state_);
  }
  return events;
}

void CameraFeed::connect(Timestamp now) {
  if (socket_.empty()) reason_ = kElsewhere;
  if (daemon_ || socket_.empty() || now < retry_at_) return;
  auto socket = connect_unix(socket_, SOCK_NONBLOCK);  // a daemon that hangs accepts nobody
  if (!socket) {
    return hang_up(socket.error().message + ": is crepesd running, with recording.socket set?",
                   now);
  }
  daemon_.emplace(std::move(*socket));
  asked_.reset();
  reason_ = "no picture yet";
}

void CameraFeed::hang_up(std::string reason, Timestamp now) {
  daemon_.reset();
  asked_.reset();
  reason_ = std::move(reason);
  retry_at_ = now + kRetry;
}

/// The camera whose turn it is, if no answer is pending.
void CameraFeed::request_picture(Timestamp now, const std::vector<std::uint8_t>& wanted) {
  if (asked_ && now - asked_->at > kPatience) {
    reason_ = "the camera delivers no pictures: see Health";
    asked_.reset();  // others have their turn
  }
  if (asked_ && std::ranges::count(wanted, asked_->camera) > 0) return;
  const std::uint8_t next = *std::ranges::min_element(
      wanted, {}, [this](std::uint8_t camera) { return last_asked_[camera]; });
  if (now - last_asked_[next] < kPicturePeriod) return;
  last_asked_[next] = now;
  if (const auto sent = daemon_->request(fmt::format("{}{}", kLookRequest, next)); !sent)
    return hang_up(sent.error().message, now);
  asked_ = Request{next, now};
}

Result<void> CameraFeed::receive(Timestamp now, const PoseHistory& poses,
                                 std::map<std::uint8_t, std::string>& events) {
  for (int i = 0; i < kMaxReads && daemon_; ++i) {
    const auto goes_on = daemon_->receive(0);
    if (!goes_on) return tl::unexpected(goes_on.error());
    if (!*goes_on) return fail(ErrorCode::kIo, "the daemon hung up");
    const auto block = daemon_->next();
    if (!block) return tl::unexpected(block.error());
    if (*block) handle_block(**block, now, poses, events);
  }
  return {};
}

void CameraFeed::handle_block(const Block& block, Timestamp now, const PoseHistory& poses,
                              std::map<std::uint8_t, std::string>& events) {
  if (block.kind == "refused") return hang_up(block.content, now);
  if (block.kind == "config") {
    CheckedConfig checked = check_config_text(block.content, "the daemon's configuration");
    if (!checked.faults.empty()) return hang_up(to_string(checked.faults.front()), now);
    config_ = std::move(checked.config);
  }
  if (block.kind != "look" || !config_ || !asked_) return;
  const auto picture = picture_json(block.content, asked_->camera, *config_, poses);
  reason_ = picture ? "" : picture.error().message;
  if (picture) events[asked_->camera] += stream_event("picture", *picture);
  asked_.reset();
}

std::string CameraFeed::greeting() const {
  return stream_event("camera",
                      cameras_json(config_ ? *config_ : Config{}, can_control_, reason_)) +
         stream_event("coverage", coverage_.value_or("{}"));
}

std::optional<pid_t> CameraFeed::daemon_pid() const {
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (!daemon_ || ::getsockopt(daemon_->descriptor(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
      peer.pid <= 0)
    return std::nullopt;
  return peer.pid;
}

}  // namespace crepes
