#include "tests/architecture/include_rules.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <sstream>

namespace crepes {
namespace {

/// A folder and all that it may include of ours; files named where one alone may.
struct FolderRule {
  std::string_view folder;
  std::vector<std::string_view> ours;
};

/// The most specific rule of a path is the last that fits.
const std::vector<FolderRule>& folder_rules() {
  static const std::vector<FolderRule> kRules{
      {"estimator/core/", {"estimator/core/"}},
      {"estimator/relative/", {"estimator/core/", "estimator/relative/"}},
      {"estimator/vision/", {"estimator/core/", "estimator/vision/"}},
      {"estimator/graph/", {"estimator/core/", "estimator/graph/"}},
      {"estimator/swarm/", {"estimator/"}},
      {"drivers/", {"estimator/core/", "firmware/protocol/", "drivers/"}},
      {"drivers/sim/",
       {"estimator/core/", "estimator/vision/camera_model", "estimator/vision/id_library",
        "firmware/protocol/", "drivers/"}},
      {"net/", {"estimator/core/", "net/"}},
      {"daemon/", {"estimator/", "drivers/", "net/", "daemon/", "firmware/protocol/"}},
      {"firmware/protocol/", {"firmware/protocol/"}},
      {"firmware/led_board/", {"firmware/"}},
      {"tests/", {"estimator/", "drivers/", "net/", "daemon/", "firmware/", "tests/"}},
  };
  return kRules;
}

/// A pattern in a line that only some files may have.
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
       {"estimator/vision/spot_detector", "estimator/vision/hough", "drivers/camera/",
        "drivers/sim/", "daemon/", "tests/"},
       "OpenCV is for spot_detector, drivers/camera, drivers/sim and daemon"},
      {include_of("ceres/"), {"estimator/graph/", "tests/"}, "Ceres is for estimator/graph"},
      {include_of("arv"),
       {"drivers/camera/aravis_", "tests/"},
       "Aravis is for drivers/camera/aravis_*"},
      {include_of("dlfcn"),
       {"drivers/camera/mindvision_library.cpp", "tests/"},
       "libraries are loaded in drivers/camera/mindvision_library.cpp"},
      {include_of("nlohmann/"),
       {"net/json_parts", "net/pose_push.cpp", "net/status_json.cpp", "net/subscription_",
        "daemon/", "tests/"},
       "JSON is for the subscription in net, and daemon"},
      {include_of("sodium"),
       {"net/keyed_hash.cpp", "net/packet_seal.cpp", "daemon/", "tests/"},
       "libsodium is for net/keyed_hash.cpp, net/packet_seal.cpp and daemon"},
      {include_of("(spdlog|yaml-cpp)/"),
       {"daemon/", "tests/"},
       "spdlog and yaml-cpp are for daemon"},
      {include_of("(CLI|systemd)/"), {"daemon/", "tests/"}, "options and systemd are for daemon"},
      {include_of(
           "(fstream|iostream|filesystem|cstdio|sys/|netinet/|arpa/|fcntl|unistd|poll|termios)"),
       {"drivers/", "net/", "daemon/", "tests/", "estimator/core/contract.hpp"},
       "estimator/ touches no files, sockets or terminals"},
      {include_of("(ctime|time\\.h|sys/time)"),
       {"drivers/", "daemon/", "tests/"},
       "time is read in drivers/monotonic_clock.hpp"},
      {include_of("(mutex|shared_mutex|condition_variable|atomic|semaphore|latch|barrier|future)>"),
       {"daemon/bounded_queue.hpp", "daemon/counters.hpp", "tests/"},
       "threads share queues and counters alone"},
      {include_of("thread>"),
       {"daemon/worker.hpp", "tests/"},
       "threads start in daemon/worker.hpp"},
      {std::regex("std::j?thread\\b"),
       {"daemon/worker.hpp", "tests/"},
       "threads start in daemon/worker.hpp"},
      {std::regex("::now\\(\\)"),
       {"drivers/monotonic_clock.hpp", "tests/bench/"},
       "time is read in drivers/monotonic_clock.hpp"},
      {std::regex("\\bgettimeofday|\\bclock_gettime\\s*\\((?!CLOCK_(THREAD|PROCESS)_CPUTIME_ID)"),
       {"drivers/monotonic_clock.hpp"},
       "time is read in drivers/monotonic_clock.hpp"},
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
    const auto tell = [&](std::string_view reason) {
      violations.push_back(std::string(path) + ":" + std::to_string(number) + ": " +
                           std::string(reason));
    };
    if (const auto fault = own_include_fault(path, line)) tell(*fault);
    const std::string code = line.substr(0, line.find("//"));
    for (const WordRule& rule : word_rules()) {
      if (!starts_with_any(path, rule.allowed) && std::regex_search(code, rule.pattern))
        tell(rule.reason);
    }
  }
  return violations;
}

}  // namespace crepes
