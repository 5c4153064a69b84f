#include "daemon/ctl/view/view.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <optional>

#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/view/access.hpp"
#include "daemon/ctl/view/http_server.hpp"
#include "daemon/ctl/view/listen_address.hpp"
#include "daemon/ctl/view/site.hpp"
#include "daemon/version.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/text_file.hpp"
#include "net/endpoint.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kTick = 40ms;  // 25 pictures a second

Result<Site> live_site(const ViewOptions& options) {
  std::vector<DaemonAddress> daemons{options.daemon};
  for (const std::string& text : options.also) {
    auto daemon = parse_address(text, 1);
    if (!daemon) return tl::unexpected(Error(daemon.error()).with_context("--also"));
    daemons.push_back(std::move(*daemon));
  }
  Site::Live feeds;
  std::vector<CameraFeed> cameras;
  for (std::size_t i = 0; i < daemons.size(); ++i) {
    auto feed = LiveFeed::open(daemons[i]);
    if (!feed) return tl::unexpected(feed.error());
    feeds.push_back(std::move(*feed));
    cameras.emplace_back(i < options.sockets.size() ? options.sockets[i] : "", i == 0);
  }
  return Site(std::move(feeds), std::move(daemons), std::move(cameras), options.config);
}

Result<Site> site_of(const ViewOptions& options) {
  if (options.replay.empty() && !options.swarm.empty())
    return fail(ErrorCode::kUsage,
                "--truth belongs to a replay: crepesctl view REPLAY_DIR --truth "
                "SWARM_DIR");
  if (options.replay.empty()) return live_site(options);
  return RecordedFeed::open(options.replay, options.swarm).map([](RecordedFeed&& feed) {
    return Site(std::move(feed));
  });
}

/// The machine's name, alone and as the local network knows it; lower case.
std::vector<std::string> names_of_machine() {
  std::array<char, 256> buffer{};
  if (::gethostname(buffer.data(), buffer.size() - 1) != 0) return {};
  std::string name(buffer.data());
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return {name, name.substr(0, name.find('.')) + ".local"};
}

/// The first word of the file: whoever reads it may read the page's data.
Result<std::string> token_in(const std::filesystem::path& file) {
  constexpr std::size_t kMinLength = 16;
  auto text = read_text_file(file);
  if (!text) return tl::unexpected(text.error());
  std::string token = text->substr(0, text->find_first_of(" \t\r\n"));
  if (token.size() < kMinLength) {
    return fail(ErrorCode::kFormat,
                fmt::format("{}: a token has at least {} characters, without a blank, on the first "
                            "line",
                            file.string(), kMinLength));
  }
  return token;
}

/// Empty where none is needed: on loopback, unless a file has one.
Result<std::string> token_of(const ViewOptions& options, const DaemonAddress& listen) {
  if (!options.token_file.empty()) return token_in(options.token_file);
  if (Endpoint::parse(listen.address, 1)->is_loopback()) return std::string();
  return random_token();
}

/// A page at an address that means all addresses is best reached by the machine's name.
std::string url_of(const DaemonAddress& listen, std::uint16_t port, const AccessPolicy& policy) {
  const bool is_any = listen.address == "0.0.0.0" || listen.address == "::";
  const std::string host = is_any && !policy.names.empty() ? policy.names.front() : listen.address;
  return fmt::format("http://{}/{}", authority_of(host, port),
                     policy.token.empty() ? "" : "#token=" + policy.token);
}

/// The desktop's browser. Not with a token: other users see the arguments of programs.
Result<std::optional<ChildProcess>> open_browser(const ViewOptions& options,
                                                 const AccessPolicy& policy,
                                                 const std::string& url) {
  if (!options.open) return std::nullopt;
  if (!policy.token.empty())
    return fail(ErrorCode::kUsage, "--open works on loopback without a token only");
  return ChildProcess::start("/usr/bin/env", {"xdg-open", url}, "/dev/null")
      .map([](ChildProcess&& browser) { return std::optional(std::move(browser)); })
      .map_error([](Error e) { return std::move(e).with_context("--open"); });
}

bool is_missing(std::optional<ChildProcess>& browser) {
  return browser && browser->exit_reason() == "exit code 127";  // as env(1) says it
}

}  // namespace

Result<void> view(const ViewOptions& options) {
  const auto listen = parse_address(options.listen, 0);
  if (!listen) return tl::unexpected(Error(listen.error()).with_context("--listen"));
  const auto token = token_of(options, *listen);
  if (!token) return tl::unexpected(token.error());
  const AccessPolicy policy{.token = *token, .names = names_of_machine()};
  Result<Site> site = site_of(options);
  if (!site) return tl::unexpected(site.error());
  const MonotonicClock clock;
  StopSignals stop;
  auto server = HttpServer::open(
      {.address = listen->address, .port = listen->port, .name = "crepes/" + std::string(kVersion)},
      [&](const HttpRequest& request) {
        if (auto refusal = refusal_of(request, policy, Site::access_to(request.path)))
          return *refusal;
        return site->answer(request, clock.now());
      });
  if (!server) return tl::unexpected(server.error());
  const std::string url = url_of(*listen, server->port(), policy);
  auto browser = open_browser(options, policy, url);
  if (!browser) return tl::unexpected(browser.error());
  if (options.on_ready) {
    if (auto announced = options.on_ready(url); !announced) return announced;
  }
  const KeyReader keys;
  server->serve(kTick, [&] {
    site->advance(*server, clock.now());
    return !stop.requested() && keys.next() != 'q' && !is_missing(*browser);
  });
  if (is_missing(*browser))
    return fail(ErrorCode::kNotFound, "--open: xdg-open is not installed (package xdg-utils)");
  return {};
}

}  // namespace crepes
