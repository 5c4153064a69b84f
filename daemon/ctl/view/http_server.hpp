/// HTTP for the page: short replies and event streams, on one thread. libwebsockets is in the .cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "daemon/ctl/view/http_message.hpp"
#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// Where the server listens, and its limits.
struct HttpSettings {
  std::string address = "127.0.0.1";                ///< numeric, IPv4 or IPv6
  std::uint16_t port = 8080;                        ///< 0: a free one
  std::string name;                                 ///< of the Server header
  Duration request_time = std::chrono::seconds{5};  ///< in which a request must be complete
};

/// At most 64 connections. For a further one, the oldest without a reply on its way is closed; if
/// there is none, the further one is. A request must be complete within `request_time`, however
/// its bytes trickle in, and 4 kB; a reader that takes nothing for half a minute is closed. Every
/// reply forbids the browser all foreign content (Content-Security-Policy).
class HttpServer {
 public:
  using Answer = std::function<HttpReply(const HttpRequest&)>;

  /// Listens from now on; `answer` is called by `serve` only.
  [[nodiscard]] static Result<HttpServer> open(const HttpSettings& settings, Answer answer);
  HttpServer(HttpServer&&) noexcept;
  HttpServer& operator=(HttpServer&&) noexcept;
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer();

  [[nodiscard]] std::uint16_t port() const;

  /// Serves until `on_tick` returns false; it is called about every `period`.
  void serve(Duration period, const std::function<bool()>& on_tick);

  /// Streams that are open on this topic.
  [[nodiscard]] std::size_t readers(std::size_t topic) const;
  /// Sends `text` to them. A reader that is far behind misses it; when it has taken what waits for
  /// it, its request is answered anew, so it misses no state.
  void publish(std::size_t topic, const std::string& text);

 private:
  struct State;
  explicit HttpServer(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace crepes
