#include "daemon/ctl/live/watch.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/live/watch_screen.hpp"
#include "drivers/base/monotonic_clock.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kMaxSilence = 3s;  ///< a daemon silent for longer does not run

client::Requests requests_for(const std::set<RobotId>& polled) {
  constexpr double kMostPerSecond = 20.0;  // of the 50 requests that a daemon answers
  const double period_s = std::max(1.0, static_cast<double>(polled.size()) / kMostPerSecond);
  client::Requests requests{.polls = {{}}};
  for (const RobotId neighbor : polled)
    requests.polls.push_back({.peer = neighbor.value, .period_s = period_s});
  return requests;
}

/// Exchanges messages with the daemon. Calls `show` after every message or pause; `show` returns
/// whether to continue.
template <class Show>
Result<void> converse(const WatchOptions& options, WatchScreen& screen, const Show& show) {
  Result<client::Connection> daemon = connect(options.daemon, requests_for({}));
  if (!daemon) return tl::unexpected(daemon.error());
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  std::set<RobotId> asked;
  StopSignals stop;
  for (;;) {
    const Timestamp now = clock.now();
    if (stop.requested() || (options.for_s && now - start >= from_seconds(*options.for_s))) break;
    if (std::set<RobotId> polled = screen.polled_neighbors(); polled != asked) {
      asked = std::move(polled);
      daemon->ask(requests_for(asked));
    }
    const auto answer = daemon->receive(50ms);
    if (answer) screen.handle_message(answer->message, clock.now());
    if (!screen.last_message_time() && now - start > kMaxSilence) break;
    if (!show(answer, clock.now())) break;
  }
  if (!screen.last_message_time())
    return tl::unexpected(no_answer_from(options.daemon, daemon->send_fault()));
  return {};
}

/// Whether the screen is complete: poses arrive within a period or two after STATUS, which names
/// all neighbors.
class Completeness {
 public:
  [[nodiscard]] bool reached(const WatchScreen& screen, Timestamp now) {
    constexpr Duration kCollect = 300ms;
    if (screen.has_status() && !since_) since_ = now;
    return since_ && now - *since_ >= kCollect;
  }

 private:
  std::optional<Timestamp> since_;
};

Result<void> stream_json(const WatchOptions& options) {
  WatchScreen screen;
  Completeness complete;
  return converse(options, screen, [&](const std::optional<client::Answer>& answer, Timestamp now) {
    if (answer && !print(answer->text + "\n")) return false;
    return !(options.once && complete.reached(screen, now));
  });
}

Result<void> show_once(const WatchOptions& options) {
  WatchScreen screen;
  Completeness complete;
  return converse(options, screen, [&](const auto& /*answer*/, Timestamp now) {
    if (!complete.reached(screen, now)) return true;
    print(screen.text(now, format_of_output()));
    return false;
  });
}

Result<void> show_live(const WatchOptions& options) {
  WatchScreen screen;
  const StopSignals until_restored;
  const LiveScreen terminal;
  const KeyReader keys;
  const Duration period = terminal.is_terminal() ? 100ms : 1000ms;
  const bool is_interactive = terminal.is_terminal() && keys.is_terminal();
  Timestamp next{};
  return converse(options, screen, [&](const auto& /*answer*/, Timestamp now) {
    while (const auto key = keys.next()) {
      screen.handle_key(*key);
      next = now;
    }
    if (now < next) return !screen.should_quit();
    next = now + period;
    ScreenFormat format = format_of_output();
    format.is_interactive = is_interactive;
    terminal.show(screen.text(now, format));
    return !screen.should_quit();
  });
}

}  // namespace

Result<void> watch(const WatchOptions& options) {
  if (options.json) return stream_json(options);
  return options.once ? show_once(options) : show_live(options);
}

}  // namespace crepes
