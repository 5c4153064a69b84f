#include "daemon/ctl/view/live_feed.hpp"

#include <chrono>

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kRequestPeriod = 500ms;
constexpr int kMaxPerTurn = 1000;  ///< messages; a flood must not keep the pages waiting

}  // namespace

Result<LiveFeed> LiveFeed::open(const DaemonAddress& daemon) {
  return DaemonClient::open(daemon).map(
      [&](DaemonClient&& client) { return LiveFeed(std::move(client), LiveMessages(daemon)); });
}

/// A request that cannot be sent is repeated soon, like one that gets lost.
void LiveFeed::ask(Timestamp now, Interest interest) {
  next_request_ = now + kRequestPeriod;
  const bool is_second = requests_++ % 2 == 0;
  if (interest == Interest::kName) {
    if (is_second) (void)client_.poll();
    return;
  }
  (void)client_.poll();
  if (!is_second) return;
  (void)client_.watch();
  (void)client_.poll("sensors");
  (void)client_.poll("network");
  for (const RobotId neighbor : messages_.neighbors()) (void)client_.poll(neighbor);
}

void LiveFeed::exchange(Timestamp now, Interest interest) {
  const bool is_wanted = interest == Interest::kAll;
  if (is_wanted && !is_subscribed_) {
    next_request_ = now;
    requests_ = 0;
  }
  if (!is_wanted && is_subscribed_) (void)client_.unwatch();
  is_subscribed_ = is_wanted;
  if (interest != Interest::kNone && now >= next_request_) ask(now, interest);
  for (int i = 0; i < kMaxPerTurn; ++i) {
    const auto answer = client_.receive(0ms);
    if (!answer || !*answer) break;
    messages_.add(**answer, now);
  }
}

}  // namespace crepes
