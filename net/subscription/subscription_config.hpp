/// Settings: poses for other programs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// How a pose is written for a program that does not ask.
enum class PushFormat : std::uint8_t { kJson, kPlotJuggler };
inline constexpr std::array kPushFormats{Choice{"json", PushFormat::kJson},
                                         Choice{"plotjuggler", PushFormat::kPlotJuggler}};

/// A program that receives poses without a request.
struct PushConfig {
  std::string address = "127.0.0.1";
  int port = 9870;
  double rate_hz = 50.0;
  PushFormat format = PushFormat::kPlotJuggler;

  [[nodiscard]] bool operator==(const PushConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("address", address, "numeric address of one host");
    v.field("port", port, Bounds{1, 65535}, "its UDP port; PlotJuggler's is 9870");
    v.field("rate_hz", rate_hz, Bounds{0.01, 1000},
            "maximum number of poses of each neighbor per second");
    v.choice("format", format, kPushFormats,
             "json: POSE as for subscribers; plotjuggler: numbers only, all neighbors together");
  }
};

/// Poses for other programs.
struct SubscriptionConfig {
  std::vector<std::string> listen{"127.0.0.1", "::1"};
  int port = 47475;
  double lease_s = 10.0;
  int max_subscribers = 32;
  int max_per_address = 4;
  std::vector<PushConfig> push;

  [[nodiscard]] bool operator==(const SubscriptionConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("listen", listen, "numeric addresses to serve; beyond loopback, clients echo a cookie");
    v.field("port", port, Bounds{1, 65535}, "UDP port");
    v.field("lease_s", lease_s, Bounds{1, 3600}, "a WATCH that is not renewed for this long ends");
    v.field("max_subscribers", max_subscribers, Bounds{1, 1024},
            "maximum number of subscribers; further ones receive an ERROR");
    v.field("max_per_address", max_per_address, Bounds{1, 1024},
            "maximum number of subscribers at one address");
    v.optional_list("push", push, "clients that receive poses without a request");
  }
};

}  // namespace crepes
