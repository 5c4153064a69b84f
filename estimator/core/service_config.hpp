/// Settings: the mesh, programs on the robot, the simulated world, messages.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "estimator/core/config_schema.hpp"

namespace crepes {

/// Peers on the mesh.
struct NetConfig {
  std::string interface = "bat0";
  int port = 47474;
  double report_rate_hz = 50.0;
  std::string key_file;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("interface", interface, "mesh interface to broadcast on; lo reaches this machine only");
    v.field("port", port, Bounds{1, 65535}, "UDP port of peer traffic");
    v.field("report_rate_hz", report_rate_hz, Bounds{1, 200}, "broadcasts a second");
    v.field(
        "key_file", key_file,
        "the swarm's key, made by crepesctl keygen: datagrams are sealed, others refused; empty: "
        "anybody on the mesh can read and write");
  }
};

enum class PushFormat : std::uint8_t { kJson, kPlotJuggler };
inline constexpr std::array kPushFormats{Choice{"json", PushFormat::kJson},
                                         Choice{"plotjuggler", PushFormat::kPlotJuggler}};

/// A program that gets poses without asking.
struct PushConfig {
  std::string address = "127.0.0.1";
  int port = 9870;
  double rate_hz = 50.0;
  PushFormat format = PushFormat::kPlotJuggler;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("address", address, "numeric address of one host");
    v.field("port", port, Bounds{1, 65535}, "its UDP port; PlotJuggler's is 9870");
    v.field("rate_hz", rate_hz, Bounds{0.01, 1000}, "poses of each neighbor a second, at most");
    v.choice("format", format, kPushFormats,
             "json: POSE as for subscribers; plotjuggler: numbers alone, all neighbors together");
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

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("listen", listen, "numeric addresses to serve; beyond loopback, clients echo a cookie");
    v.field("port", port, Bounds{1, 65535}, "UDP port");
    v.field("lease_s", lease_s, Bounds{1, 3600}, "a WATCH not renewed for longer ends");
    v.field("max_subscribers", max_subscribers, Bounds{1, 1024}, "further ones get an ERROR");
    v.field("max_per_address", max_per_address, Bounds{1, 1024}, "of them, at one address");
    v.optional_list("push", push, "who gets poses without asking");
  }
};

/// Measurements for `crepesctl record`.
struct RecordingConfig {
  std::string socket = "/run/crepes/record";

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("socket", socket,
            "Unix socket that hands out what the sensors measure; empty: none (a relative path "
            "starts where the daemon was started)");
  }
};

enum class SimScenario : std::uint8_t {
  kTwo,
  kFour,
  kLongRange,
  kAggressive,
  kOccluded,
  kLine,
  kStatic,
};
inline constexpr std::array kSimScenarios{Choice{"two", SimScenario::kTwo},
                                          Choice{"four", SimScenario::kFour},
                                          Choice{"long-range", SimScenario::kLongRange},
                                          Choice{"aggressive", SimScenario::kAggressive},
                                          Choice{"occluded", SimScenario::kOccluded},
                                          Choice{"line", SimScenario::kLine},
                                          Choice{"static", SimScenario::kStatic}};

/// A simulated world instead of devices.
struct SimConfig {
  bool enabled = false;
  SimScenario scenario = SimScenario::kFour;
  int seed = 1;
  double epoch_s = 0.0;
  double clock_offset_s = 0.0;
  double clock_skew_ppm = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "replace all devices by a simulated world");
    v.choice("scenario", scenario, kSimScenarios, "what the robots do");
    v.field("seed", seed, Bounds{0, 2147483647}, "same seed, same world, in every process");
    v.field("epoch_s", epoch_s, Bounds{0, 1e9},
            "the machine's monotonic time at which the world began");
    v.field("clock_offset_s", clock_offset_s, Bounds{-1e6, 1e6},
            "this robot's clock minus world time");
    v.field("clock_skew_ppm", clock_skew_ppm, Bounds{-200, 200},
            "how fast this robot's clock runs");
  }
};

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };
inline constexpr std::array kLogLevels{
    Choice{"debug", LogLevel::kDebug}, Choice{"info", LogLevel::kInfo},
    Choice{"warning", LogLevel::kWarning}, Choice{"error", LogLevel::kError}};

struct LogConfig {
  LogLevel level = LogLevel::kInfo;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("level", level, kLogLevels, "least severity that is written");
  }
};

}  // namespace crepes
