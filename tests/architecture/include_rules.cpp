#include "tests/architecture/include_rules.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace crepes {
namespace {

/// A folder and the folders of this repository that it may include. A path without a final slash
/// names a file, without its extension.
struct FolderRule {
  std::string_view folder;
  std::vector<std::string_view> ours;
};

/// Of several rules that match a path, the last one counts: it is the most specific.
const std::vector<FolderRule>& folder_rules() {
  static const std::vector<FolderRule> kRules{
      {"estimator/core/", {"estimator/core/"}},
      {"estimator/relative/", {"estimator/core/", "estimator/relative/"}},
      {"estimator/vision/", {"estimator/core/", "estimator/vision/"}},
      {"estimator/graph/", {"estimator/core/", "estimator/graph/"}},
      {"estimator/calibration/", {"estimator/core/"}},
      {"estimator/calibration/batch/", {"estimator/core/", "estimator/calibration/batch/"}},
      {"estimator/calibration/camera/",
       {"estimator/core/", "estimator/vision/double_sphere", "estimator/calibration/batch/",
        "estimator/calibration/camera/", "estimator/calibration/number_text"}},
      {"estimator/calibration/grid/",
       {"estimator/core/", "estimator/vision/double_sphere", "estimator/vision/kannala_brandt",
        "estimator/calibration/batch/", "estimator/calibration/camera/",
        "estimator/calibration/grid/", "estimator/calibration/number_text"}},
      {"estimator/calibration/imu/",
       {"estimator/core/", "estimator/calibration/imu/", "estimator/calibration/number_text"}},
      {"estimator/calibration/range/",
       {"estimator/core/", "estimator/calibration/range/", "estimator/calibration/number_text"}},
      {"estimator/calibration/swarm/",
       {"estimator/core/", "estimator/calibration/batch/", "estimator/calibration/camera/",
        "estimator/calibration/swarm/", "estimator/calibration/number_text"}},
      {"estimator/team/", {"estimator/core/", "estimator/relative/", "estimator/team/"}},
      {"estimator/team/belief/",
       {"estimator/core/", "estimator/relative/", "estimator/team/belief/"}},
      {"estimator/team/unseen/",
       {"estimator/core/", "estimator/relative/", "estimator/team/belief/",
        "estimator/team/unseen/"}},
      {"estimator/team/readings/",
       {"estimator/core/", "estimator/relative/", "estimator/team/belief/",
        "estimator/team/unseen/", "estimator/team/readings/"}},
      {"estimator/team/trust/",
       {"estimator/core/", "estimator/relative/", "estimator/team/belief/",
        "estimator/team/readings/", "estimator/team/trust/"}},
      {"estimator/swarm/", {"estimator/"}},
      {"drivers/", {"estimator/core/", "firmware/protocol/", "drivers/"}},
      {"drivers/base/", {"estimator/core/", "drivers/base/"}},
      {"drivers/sim/",
       {"estimator/core/", "estimator/vision/camera_model", "estimator/vision/id_library",
        "firmware/protocol/", "drivers/"}},
      {"net/", {"estimator/core/", "drivers/base/", "net/"}},
      {"net/client/", {"net/client/"}},
      {"net/mesh/",
       {"estimator/core/", "drivers/base/", "net/mesh/", "net/endpoint", "net/udp_socket"}},
      // The settings of what it configures, and what the rules between settings ask: whether a
      // calibration, a blink code, an address or a key can be used.
      {"config/",
       {"config/",
        "estimator/core/",
        "drivers/base/",
        "drivers/camera/camera_config",
        "drivers/imu/imu_config",
        "drivers/sim/sim_config",
        "drivers/uwb/uwb_config",
        "estimator/graph/graph_config",
        "estimator/swarm/estimator_config",
        "estimator/swarm/estimator_settings",
        "estimator/vision/vision_config",
        "estimator/vision/camera_model",
        "estimator/vision/id_library",
        "net/endpoint",
        "net/mesh/mesh_config",
        "net/mesh/mesh_trust",
        "net/mesh/packet_seal",
        "net/mesh/packet_signature",
        "net/mesh/send_pacing",
        "net/subscription/subscription_config"}},
      {"config/schema/",
       {"config/schema/", "estimator/core/", "drivers/camera/camera_config",
        "drivers/imu/imu_config", "drivers/sim/sim_config", "drivers/uwb/uwb_config",
        "estimator/graph/graph_config", "estimator/swarm/estimator_config",
        "estimator/swarm/estimator_settings", "estimator/vision/vision_config",
        "estimator/vision/camera_model", "estimator/vision/id_library", "net/endpoint",
        "net/mesh/mesh_config", "net/mesh/mesh_trust", "net/mesh/packet_signature",
        "net/mesh/send_pacing", "net/subscription/subscription_config"}},
      {"config/examples/", {}},
      {"daemon/", {"estimator/", "drivers/", "net/", "config/", "daemon/", "firmware/protocol/"}},
      {"firmware/protocol/", {"firmware/protocol/"}},
      {"firmware/led_board/", {"firmware/"}},
      {"tests/", {"estimator/", "drivers/", "net/", "config/", "daemon/", "firmware/", "tests/"}},
  };
  return kRules;
}

/// A pattern that only some files may contain.
struct WordRule {
  std::regex pattern;
  std::vector<std::string_view> allowed;  ///< path prefixes
  std::string_view reason;
};

std::regex include_of(const std::string& what) {
  return std::regex("^\\s*#\\s*include\\s*<" + what);
}

const std::vector<WordRule>& word_rules() {
  static const std::vector<WordRule> kRules{
      {include_of("(opencv2?|cv)"),
       {"estimator/vision/spot_detector", "drivers/camera/", "drivers/sim/", "daemon/", "tests/"},
       "OpenCV is for spot_detector, drivers/camera, drivers/sim and daemon"},
      {include_of("ceres/"),
       {"estimator/calibration/", "estimator/graph/", "tests/"},
       "Ceres is for estimator/graph and estimator/calibration"},
      {include_of("arv"),
       {"drivers/camera/aravis_", "tests/"},
       "Aravis is for drivers/camera/aravis_*"},
      {include_of("libcamera/"),
       {"drivers/camera/libcamera_device.cpp", "tests/"},
       "libcamera is for drivers/camera/libcamera_device.cpp"},
      {include_of("libwebsockets"),
       {"daemon/ctl/view/http_server.cpp", "tests/"},
       "HTTP is served in daemon/ctl/view/http_server.cpp"},
      {include_of("dlfcn"),
       {"drivers/camera/mindvision_library.cpp", "tests/"},
       "libraries are loaded in drivers/camera/mindvision_library.cpp"},
      {include_of("nlohmann/"),
       {"net/client/", "net/subscription/", "daemon/", "tests/"},
       "JSON is for the subscription in net, and daemon"},
      {include_of("sodium"),
       {"config/keys/mesh_key.cpp", "config/keys/robot_key.cpp", "net/subscription/keyed_hash.cpp",
        "net/mesh/packet_seal.cpp", "net/mesh/packet_signature.cpp", "net/mesh/locked_key.hpp",
        "daemon/", "tests/"},
       "libsodium is for config/keys, net/subscription/keyed_hash.cpp, daemon, and in net/mesh for "
       "packet_seal.cpp, packet_signature.cpp and locked_key.hpp"},
      {include_of("fmt/"),
       {"estimator/calibration/", "estimator/vision/camera_model", "estimator/vision/id_library",
        "config/", "drivers/", "net/", "daemon/", "tests/"},
       "fmt is for the refusals of calibrations, lenses and codes, and for config, drivers, net "
       "and "
       "daemon"},
      {include_of("spdlog/"), {"daemon/", "tests/"}, "spdlog is for daemon"},
      {include_of("yaml-cpp/"),
       {"config/reading/", "daemon/", "tests/"},
       "yaml-cpp is for config/reading and daemon"},
      {include_of("(CLI|systemd)/"), {"daemon/", "tests/"}, "options and systemd are for daemon"},
      {include_of(
           "(fstream|iostream|filesystem|cstdio|sys/|netinet/|arpa/|fcntl|unistd|poll|termios)"),
       {"config/", "drivers/", "net/", "daemon/", "tests/", "estimator/core/contract.hpp"},
       "estimator/ touches no files, sockets or terminals"},
      {include_of("(ctime|time\\.h|sys/time)"),
       {"drivers/", "daemon/", "tests/"},
       "time is read in drivers/base/monotonic_clock.hpp"},
      {include_of("(mutex|shared_mutex|condition_variable|atomic|semaphore|latch|barrier|future)>"),
       {"daemon/stages/bounded_queue.hpp", "daemon/stages/counters.hpp", "tests/"},
       "threads share queues and counters alone"},
      {include_of("thread>"),
       {"daemon/stages/worker.hpp", "tests/"},
       "threads start in daemon/stages/worker.hpp"},
      {std::regex("std::j?thread\\b"),
       {"daemon/stages/worker.hpp", "tests/"},
       "threads start in daemon/stages/worker.hpp"},
      {std::regex("::now\\(\\)"),
       {"config/examples/", "daemon/ctl/calibrate/coverage_file.cpp",
        "drivers/base/monotonic_clock.hpp", "net/client/connection.cpp", "tests/bench/"},
       "time is read in drivers/base/monotonic_clock.hpp"},
      {std::regex("\\bgettimeofday|\\bclock_gettime\\s*\\((?!CLOCK_(THREAD|PROCESS)_CPUTIME_ID)"),
       {"drivers/base/monotonic_clock.hpp", "tests/mesh/slow_clock.c"},
       "time is read in drivers/base/monotonic_clock.hpp"},
      {std::regex("estimator/core/clock\\.hpp"),
       {"drivers/", "net/", "daemon/", "tests/"},
       "estimation holds stamps, never a clock"},
  };
  return kRules;
}

bool starts_with_any(std::string_view path, const std::vector<std::string_view>& prefixes) {
  return std::ranges::any_of(prefixes, [&](std::string_view p) { return path.starts_with(p); });
}

const FolderRule* rule_of(std::string_view path) {
  const FolderRule* found = nullptr;
  for (const FolderRule& rule : folder_rules()) {
    if (path.starts_with(rule.folder)) found = &rule;
  }
  return found;
}

std::optional<std::string> own_include_fault(std::string_view path, const std::string& line) {
  static const std::regex kOwnInclude("^\\s*#\\s*include\\s*\"([^\"]*)\"");
  std::smatch match;
  if (!std::regex_search(line, match, kOwnInclude)) return std::nullopt;
  const std::string included = match[1];
  if (included.find('/') == std::string::npos && !path.starts_with("firmware/"))
    return "includes \"" + included + "\" without its folder";
  const FolderRule* rule = rule_of(path);
  if (rule != nullptr && !starts_with_any(included, rule->ours))
    return std::string(rule->folder) + " may not include " + included;
  return std::nullopt;
}

}  // namespace

std::vector<std::string> violations_in(std::string_view path, std::string_view text) {
  std::vector<std::string> violations;
  if (rule_of(path) == nullptr)
    violations.push_back(std::string(path) + ":1: no rule for this folder");
  std::istringstream lines{std::string(text)};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto report = [&](std::string_view reason) {
      violations.push_back(std::string(path) + ":" + std::to_string(number) + ": " +
                           std::string(reason));
    };
    if (const auto fault = own_include_fault(path, line)) report(*fault);
    const std::string code = line.substr(0, line.find("//"));
    for (const WordRule& rule : word_rules()) {
      if (!starts_with_any(path, rule.allowed) && std::regex_search(code, rule.pattern))
        report(rule.reason);
    }
  }
  return violations;
}

std::vector<std::string> paths_in_rules() {
  std::set<std::string> paths;
  for (const FolderRule& rule : folder_rules()) {
    paths.emplace(rule.folder);
    paths.insert(rule.ours.begin(), rule.ours.end());
  }
  for (const WordRule& rule : word_rules()) paths.insert(rule.allowed.begin(), rule.allowed.end());
  return {paths.begin(), paths.end()};
}

}  // namespace crepes
