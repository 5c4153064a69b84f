#include "daemon/ctl/watch.hpp"

#include <chrono>

#include "daemon/ctl/live_screen.hpp"
#include "daemon/ctl/watch_screen.hpp"
#include "drivers/monotonic_clock.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kRenewal = 1s;   ///< of WATCH and POLL
constexpr Duration kPatience = 3s;  ///< a daemon silent for longer is not there

Result<void> ask(DaemonClient& client, const WatchScreen& screen) {
  return client.watch().and_then([&] { return client.poll(); }).and_then([&]() -> Result<void> {
    if (const auto neighbor = screen.wanted_details()) return client.poll(*neighbor);
    return {};
  });
}

/// Speaks and listens; `show` is called with what is known after every message or pause and says
/// whether to go on.
template <class Show>
Result<void> converse(const WatchOptions& options, WatchScreen& screen, const Show& show) {
  Result<DaemonClient> client = DaemonClient::open(options.daemon);
  if (!client) return tl::unexpected(client.error());
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  Timestamp renewal = start;
  std::optional<RobotId> asked;
  StopSignals stop;
  for (;;) {
    const Timestamp now = clock.now();
    if (stop.requested() || (options.for_s && now - start >= from_seconds(*options.for_s))) break;
    if (now >= renewal || screen.wanted_details() != asked) {
      if (auto sent = ask(*client, screen); !sent) return sent;
      renewal = now + kRenewal;
      asked = screen.wanted_details();
    }
    const auto answer = client->receive(50ms);
    if (!answer) return tl::unexpected(answer.error());
    if (*answer) screen.on_message((*answer)->message, clock.now());
    if (!screen.heard() && now - start > kPatience) return tl::unexpected(silent(options.daemon));
    if (!show(*answer, clock.now())) break;
  }
  if (!screen.heard()) return tl::unexpected(silent(options.daemon));
  return client->unwatch();
}

Result<void> stream_json(const WatchOptions& options) {
  WatchScreen screen;
  return converse(options, screen, [](const std::optional<DaemonAnswer>& answer, Timestamp) {
    return !answer || print(answer->text + "\n");
  });
}

/// Poses come by themselves within a period or two; STATUS names all neighbors.
Result<void> show_once(const WatchOptions& options) {
  constexpr Duration kCollect = 300ms;
  WatchScreen screen;
  std::optional<Timestamp> first;
  return converse(options, screen, [&](const auto& /*answer*/, Timestamp now) {
    if (!screen.has_status()) return true;
    if (!first) first = now;
    if (now - *first < kCollect) return true;
    print(screen.text(now, false));
    return false;
  });
}

Result<void> show_live(const WatchOptions& options) {
  WatchScreen screen;
  const LiveScreen terminal;
  const KeyReader keys;
  const Duration period = terminal.is_terminal() ? 100ms : 1000ms;
  const bool is_interactive = terminal.is_terminal() && keys.is_terminal();
  Timestamp next{};
  return converse(options, screen, [&](const auto& /*answer*/, Timestamp now) {
    while (const auto key = keys.next()) {
      screen.on_key(*key);
      next = now;
    }
    if (now < next) return !screen.is_quit();
    next = now + period;
    terminal.show(screen.text(now, is_interactive));
    return !screen.is_quit();
  });
}

}  // namespace

Result<void> watch(const WatchOptions& options) {
  if (options.json) return stream_json(options);
  return options.once ? show_once(options) : show_live(options);
}

}  // namespace crepes
