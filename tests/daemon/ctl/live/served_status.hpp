/// A daemon of which the tools see the status.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/stages/worker.hpp"
#include "net/subscription/subscription_service.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

/// Serves a status at a port of this machine, and no poses.
class ServedStatus {
 public:
  explicit ServedStatus(SystemStatus status)
      : socket_(UdpSocket::bind("127.0.0.1", 0).value()),
        service_(
            {}, "1", [status = std::move(status)] { return status; }, HashKey{}),
        worker_("daemon", [this](const std::stop_token& stop) { serve(stop); }) {}

  [[nodiscard]] DaemonAddress address() const {
    return {.address = "127.0.0.1", .port = socket_.local().port};
  }

 private:
  void serve(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto datagram = socket_.receive(std::chrono::milliseconds{20});
      if (!datagram || !*datagram) continue;
      const std::string request((*datagram)->bytes.begin(), (*datagram)->bytes.end());
      const auto answer =
          service_.answer((*datagram)->from, request, Timestamp{std::chrono::seconds{1000}});
      if (!answer) continue;
      (void)socket_.send_to(std::vector<std::uint8_t>(answer->begin(), answer->end()),
                            (*datagram)->from);
    }
  }

  UdpSocket socket_;
  SubscriptionService service_;
  Worker worker_;
};

}  // namespace crepes
