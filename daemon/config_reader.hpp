/// Walks a config struct's `visit()` over a YAML mapping: fills it and collects every fault.
///
/// For .cpp files that read YAML alone: yaml-cpp is seen nowhere else.
#pragma once

#include <yaml-cpp/yaml.h>

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config_file.hpp"

namespace crepes {

/// What all readers of one file share.
struct ReadLog {
  std::string file;
  std::vector<ConfigFault> faults;
  std::map<std::string, int, std::less<>> lines;  ///< path of each key in the file -> its line
  std::set<std::string, std::less<>> unread;      ///< paths that have no value from the file

  /// `path` is the culprit; its line is that of the key.
  void fault(const std::string& path, std::string reason) {
    const auto it = lines.find(path);
    faults.push_back({file, it == lines.end() ? 1 : it->second, path, std::move(reason)});
    unread.insert(path);
  }
};

/// Line of a node, counted from 1 (yaml-cpp counts from 0); 0 when it has none.
[[nodiscard]] inline int line_of(const YAML::Node& node) {
  return node.Mark().is_null() ? 0 : node.Mark().line + 1;
}

/// One value out of its node: the reason why not, or empty. What `value` holds then is unspecified.
[[nodiscard]] std::string read_value(const YAML::Node& node, bool& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, int& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, double& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, std::string& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, RobotId& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, Eigen::Vector3d& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, Eigen::Matrix3d& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, std::array<int, 2>& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, std::vector<double>& value);
[[nodiscard]] std::string read_value(const YAML::Node& node,
                                     std::vector<std::array<int, 2>>& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, std::vector<std::string>& value);
[[nodiscard]] std::string read_value(const YAML::Node& node, Pose& value);
template <class T>
[[nodiscard]] std::string read_value(const YAML::Node& node, std::optional<T>& value) {
  return read_value(node, value.emplace());
}

/// The same with bounds on each number.
[[nodiscard]] std::string check_bounds(double value, const Bounds& bounds);
[[nodiscard]] inline std::string check_bounds(const RobotId& value, const Bounds& bounds) {
  return check_bounds(value.value, bounds);
}
template <class T>
[[nodiscard]] std::string check_bounds(const std::optional<T>& value, const Bounds& bounds) {
  return value ? check_bounds(*value, bounds) : "";
}
template <class Numbers>
requires requires(const Numbers& numbers) { numbers.begin(); }
[[nodiscard]] std::string check_bounds(const Numbers& values, const Bounds& bounds) {
  for (const auto value : values) {
    if (std::string reason = check_bounds(value, bounds); !reason.empty()) return reason;
  }
  return "";
}
[[nodiscard]] inline std::string check_bounds(const Eigen::Matrix3d& values, const Bounds& bounds) {
  return check_bounds(Eigen::VectorXd(values.reshaped()), bounds);
}

/// What a node holds, in words: `the text "abc"`, `a list`.
[[nodiscard]] std::string describe(const YAML::Node& node);

/// The visitor for one mapping. `finish()` tells the keys that no field asked for.
class ConfigReader {
 public:
  /// `node` must be a mapping, or the only fault is that it is not.
  ConfigReader(const YAML::Node& node, std::string path, ReadLog& log);

  template <class T>
  void required(std::string_view key, T& value, std::string_view help) {
    read(key, value, help, [](const T&) { return std::string(); });
  }
  template <class T>
  void required(std::string_view key, T& value, Bounds bounds, std::string_view help) {
    read(key, value, help, [&](const T& v) { return check_bounds(v, bounds); });
  }
  template <class T>
  void field(std::string_view key, T& value, std::string_view /*help*/) {
    read(key, value, std::nullopt, [](const T&) { return std::string(); });
  }
  template <class T>
  void field(std::string_view key, T& value, Bounds bounds, std::string_view /*help*/) {
    read(key, value, std::nullopt, [&](const T& v) { return check_bounds(v, bounds); });
  }

  template <class Enum, std::size_t N>
  void choice(std::string_view key, Enum& value, const std::array<Choice<Enum>, N>& choices,
              std::string_view /*help*/) {
    const std::optional<YAML::Node> node = take(key);
    if (!node) return;
    std::string allowed;
    for (const Choice<Enum>& choice : choices) {
      if (node->IsScalar() && node->Scalar() == choice.name) {
        value = choice.value;
        return;
      }
      allowed += (allowed.empty() ? "" : ", ") + std::string(choice.name);
    }
    log_.fault(path_of(key), "expected one of " + allowed + ", found " + describe(*node));
  }

  template <class Section>
  void section(std::string_view key, Section& section, std::string_view /*help*/) {
    if (!is_mapping_) return;
    const std::optional<YAML::Node> node = take(key);
    // An absent section still has required keys to miss.
    ConfigReader reader(node ? *node : YAML::Node(YAML::NodeType::Map), path_of(key), log_);
    section.visit(reader);
    reader.finish();
  }

  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    const std::optional<YAML::Node> node = take(key);
    if (!node) return missing(key, help);
    if (!node->IsSequence()) {
      return log_.fault(path_of(key), "expected a list, found " + describe(*node));
    }
    for (const YAML::Node& element : *node) {
      const std::string path = path_of(key) + "[" + std::to_string(items.size()) + "]";
      log_.lines[path] = line_of(element);
      ConfigReader reader(element, path, log_);
      items.emplace_back().visit(reader);
      reader.finish();
    }
  }

  void ignore_unknown_keys() { entries_.clear(); }
  void finish();

 private:
  struct Missing {
    std::string key;
    std::string help;
  };

  template <class T, class Check>
  void read(std::string_view key, T& value, std::optional<std::string_view> required_help,
            const Check& check) {
    const std::optional<YAML::Node> node = take(key);
    if (!node) {
      if (required_help) missing(key, *required_help);
      return;
    }
    T candidate{};
    std::string reason = read_value(*node, candidate);
    if (reason.empty()) reason = check(candidate);
    if (!reason.empty()) return log_.fault(path_of(key), std::move(reason));
    value = std::move(candidate);
  }

  [[nodiscard]] std::optional<YAML::Node> take(std::string_view key);
  [[nodiscard]] std::string path_of(std::string_view key) const;
  void missing(std::string_view key, std::string_view help);

  std::string path_;
  bool is_mapping_;
  ReadLog& log_;
  std::map<std::string, YAML::Node, std::less<>> entries_;  ///< not yet asked for
  std::vector<std::string> known_;                          ///< asked for and not there
  std::vector<Missing> missing_;
};

}  // namespace crepes
