#include "daemon/ctl/view/live_feed.hpp"

#include <chrono>

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr double kRarePeriod = 2.0;  ///< s; for what hardly changes
constexpr int kMaxPerTurn = 1000;    ///< messages; a flood must not keep the pages waiting

client::Requests requests_for(LiveFeed::Interest interest, const std::vector<RobotId>& neighbors) {
  if (interest == LiveFeed::Interest::kNone) return {.watch = false};
  if (interest == LiveFeed::Interest::kName) return {.watch = false, .polls = {{}}};
  client::Requests requests{.polls = {{.period_s = 0.5},
                                      {.about = "sensors"},
                                      {.about = "network"},
                                      {.about = "team", .period_s = kRarePeriod}}};
  for (const RobotId neighbor : neighbors) {
    requests.polls.push_back({.peer = neighbor.value});
    requests.polls.push_back({.peer = neighbor.value, .about = "pair", .period_s = kRarePeriod});
  }
  return requests;
}

}  // namespace

Result<LiveFeed> LiveFeed::open(const DaemonAddress& daemon) {
  return connect(daemon, requests_for(Interest::kNone, {}))
      .map([&](client::Connection&& connection) {
        return LiveFeed(std::move(connection), LiveMessages(daemon));
      });
}

void LiveFeed::ask(Interest interest) {
  if (interest == asked_ && messages_.neighbors() == asked_about_) return;
  asked_ = interest;
  asked_about_ = messages_.neighbors();
  daemon_.ask(requests_for(asked_, asked_about_));
}

void LiveFeed::exchange(Timestamp now, Interest interest) {
  ask(interest);
  for (int i = 0; i < kMaxPerTurn; ++i) {
    const auto answer = daemon_.receive(0ms);
    if (!answer) break;
    messages_.add(*answer, now);
  }
}

}  // namespace crepes
