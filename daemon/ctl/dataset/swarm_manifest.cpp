#include "daemon/ctl/dataset/swarm_manifest.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/number_text.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes {
namespace {

/// Thrown and caught in this file only, beside yaml-cpp's own exceptions.
struct Fault {
  int line;
  std::string message;
};

int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

YAML::Node child(const YAML::Node& parent, const std::string& key) {
  if (!parent.IsMap())
    throw Fault{line_of(parent), fmt::format("not a map, so it has no '{}'", key)};
  const YAML::Node node = parent[key];
  if (!node) throw Fault{line_of(parent), fmt::format("'{}' is missing", key)};
  return node;
}

double number(const YAML::Node& parent, const std::string& key, double min, double max) {
  const YAML::Node node = child(parent, key);
  double value = 0.0;
  if (!node.IsScalar() || !parse_number(node.Scalar(), value).empty())
    throw Fault{line_of(node), key + ": not a finite number"};
  if (value < min || value > max) {
    throw Fault{line_of(node), fmt::format("{}: outside [{}, {}]", key, YAML::Dump(YAML::Node(min)),
                                           YAML::Dump(YAML::Node(max)))};
  }
  return value;
}

/// A name that is safe as the name of a file or directory.
std::string plain_name(const YAML::Node& parent, const std::string& key) {
  const YAML::Node node = child(parent, key);
  std::string name = node.IsScalar() ? node.Scalar() : "";
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  });
  if (name.empty() || name.front() == '.' || !plain)
    throw Fault{line_of(node), key + ": not a plain name"};
  return name;
}

SwarmRobot robot_from(const YAML::Node& node) {
  constexpr double kLongestOffset = 3.9e9;  // s; datagrams carry stamps of up to 4e9
  constexpr double kMaxId = 65534.0;
  SwarmRobot robot;
  const double id = number(node, "id", 1.0, kMaxId);
  if (id != std::floor(id)) throw Fault{line_of(node), "id: not a whole number"};
  robot.id = RobotId{static_cast<std::uint16_t>(id)};
  robot.name = plain_name(node, "name");
  robot.dir = child(node, "dir").as<std::string>();
  const YAML::Node clock = child(node, "clock");
  robot.clock.offset_s = number(clock, "offset_s", -kLongestOffset, kLongestOffset);
  robot.clock.skew_ppm = number(clock, "skew_ppm", -1e4, 1e4);
  return robot;
}

SwarmManifest manifest_from(const YAML::Node& root) {
  constexpr double kLongestRecording = 1e6;  // s
  constexpr double kLongestDelay = 1e5;      // ms
  SwarmManifest manifest;
  manifest.scenario = child(root, "scenario").as<std::string>();
  manifest.duration_s = number(root, "duration_s", 0.0, kLongestRecording);
  const YAML::Node network = child(root, "network");
  manifest.network.latency_ms = number(network, "latency_ms", 0.0, kLongestDelay);
  manifest.network.jitter_ms = number(network, "jitter_ms", 0.0, kLongestDelay);
  manifest.network.loss = number(network, "loss", 0.0, 1.0);
  manifest.network.seed = child(network, "seed").as<std::uint64_t>();
  const YAML::Node robots = child(root, "robots");
  if (!robots.IsSequence() || robots.size() == 0)
    throw Fault{line_of(robots), "robots: not a list of robots"};
  for (const YAML::Node& node : robots) {
    SwarmRobot robot = robot_from(node);
    for (const SwarmRobot& other : manifest.robots) {
      if (other.id == robot.id || other.name == robot.name) {
        throw Fault{line_of(node),
                    fmt::format("robot {}: its id or name is another's too", robot.name)};
      }
    }
    manifest.robots.push_back(std::move(robot));
  }
  return manifest;
}

}  // namespace

bool is_named(const SwarmRobot& robot, const std::string& name_or_id) {
  return name_or_id == robot.name || name_or_id == std::to_string(robot.id.value);
}

std::string robot_text(const SwarmRobot& robot) {
  std::string text =
      fmt::format("- {{id: {}, name: {}, dir: {}, clock: {{offset_s: ", robot.id.value, robot.name,
                  robot.dir.string());
  append_number(text, robot.clock.offset_s);
  text += ", skew_ppm: ";
  append_number(text, robot.clock.skew_ppm);
  return text + "}}\n";
}

std::string manifest_text(const SwarmManifest& manifest) {
  std::string text = "scenario: " + manifest.scenario;
  const auto number = [&text](const char* before, auto value) {
    text += before;
    append_number(text, value);
  };
  number("\nseed: ", manifest.network.seed);
  number("\nduration_s: ", manifest.duration_s);
  number("\nnetwork: {latency_ms: ", manifest.network.latency_ms);
  number(", jitter_ms: ", manifest.network.jitter_ms);
  number(", loss: ", manifest.network.loss);
  number(", seed: ", manifest.network.seed);
  text += "}\nrobots:\n";
  for (const SwarmRobot& robot : manifest.robots) text += robot_text(robot);
  return text;
}

Result<SwarmManifest> load_manifest(const std::filesystem::path& dir) {
  const std::filesystem::path file = dir / "swarm.yaml";
  const auto fault = [&file](int line, const std::string& message) {
    return fail(ErrorCode::kFormat, fmt::format("{}:{}: {}", file.string(), line, message));
  };
  const Result<std::string> text = read_text_file(file);
  std::error_code status;
  if (!text && std::filesystem::exists(dir / "report.json", status)) {
    return fail(ErrorCode::kNotFound, file.string() + ": no such file; " + dir.string() +
                                          " is the output of a replay, not a data set");
  }
  if (!text && std::filesystem::exists(dir / "crepesd.yaml", status)) {
    return fail(ErrorCode::kNotFound, file.string() + ": no such file; " + dir.string() +
                                          " is one robot's folder, the data set is above it");
  }
  if (!text) return tl::unexpected(text.error());
  try {
    const YAML::Node root = YAML::Load(*text);
    if (root.IsNull()) return fault(1, "the file is empty");
    return manifest_from(root);
  } catch (const Fault& e) {
    return fault(e.line, e.message);
  } catch (const YAML::Exception& e) {
    return fault(e.mark.line + 1, e.msg);
  }
}

}  // namespace crepes
