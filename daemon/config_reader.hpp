/// Walks a config struct's `visit()` over a YAML mapping: fills it and collects every fault.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config_node.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// What all readers of one tree share.
struct ReadLog {
  explicit ReadLog(const ConfigNode& tree) : root(tree) {}

  const ConfigNode& root;
  std::vector<ConfigFault> faults;
  std::set<std::string, std::less<>> unread;  ///< paths that have no value from the tree

  /// `path` is the culprit, and stands at `place`.
  void fault(const Place& place, const std::string& path, std::string reason) {
    faults.push_back({place.file, place.line, path, std::move(reason)});
    unread.insert(path);
  }
  void fault(const std::string& path, std::string reason) {
    fault(place_of(root, path), path, std::move(reason));
  }
};

/// One value out of its node: the reason why not, or empty. What `value` holds then is unspecified.
[[nodiscard]] std::string read_value(const ConfigNode& node, bool& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, int& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, double& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, std::string& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, RobotId& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, Eigen::Vector3d& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, Eigen::Matrix3d& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, std::array<int, 2>& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, std::vector<double>& value);
[[nodiscard]] std::string read_value(const ConfigNode& node,
                                     std::vector<std::array<int, 2>>& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, std::vector<std::string>& value);
[[nodiscard]] std::string read_value(const ConfigNode& node, Pose& value);
template <class T>
[[nodiscard]] std::string read_value(const ConfigNode& node, std::optional<T>& value) {
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

/// The visitor for one mapping. `finish()` tells the keys that no field asked for.
class ConfigReader {
 public:
  /// `node` must be a mapping, or the only fault is that it is not.
  ConfigReader(const ConfigNode& node, std::string path, ReadLog& log);

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
    const ConfigNode* const node = take(key);
    if (node == nullptr) return;
    std::string allowed;
    for (const Choice<Enum>& choice : choices) {
      if (node->is_text() && node->text == choice.name) {
        value = choice.value;
        return;
      }
      allowed += (allowed.empty() ? "" : ", ") + std::string(choice.name);
    }
    log_.fault(node->place, path_of(key),
               "expected one of " + allowed + ", found " + describe(*node));
  }

  template <class Section>
  void section(std::string_view key, Section& section, std::string_view /*help*/) {
    if (!node_.is_mapping()) return;
    const ConfigNode* const node = take(key);
    // An absent section still has required keys to miss.
    const ConfigNode absent{.kind = ConfigNode::Kind::kMapping, .place = node_.place};
    ConfigReader reader(node != nullptr ? *node : absent, path_of(key), log_);
    section.visit(reader);
    reader.finish();
  }
  template <class Section>
  void section(std::string_view key, Section& nested, Change /*when*/, std::string_view help) {
    section(key, nested, help);
  }

  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    const ConfigNode* const node = take(key);
    if (node == nullptr) return missing(key, help);
    read_items(*node, key, items);
  }
  template <class Item>
  void optional_list(std::string_view key, std::vector<Item>& items, std::string_view /*help*/) {
    if (const ConfigNode* const node = take(key)) read_items(*node, key, items);
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, Change /*when*/,
            std::string_view help) {
    list(key, items, help);
  }

  /// Has been put in its place before (see config_sources.hpp); here for the sake of its spelling.
  void reference(std::string_view key, std::string_view /*help*/) { static_cast<void>(take(key)); }

  void ignore_unknown_keys() { ignores_unknown_keys_ = true; }
  void finish();

 private:
  struct Missing {
    std::string key;
    std::string help;
  };

  template <class Item>
  void read_items(const ConfigNode& node, std::string_view key, std::vector<Item>& items) {
    if (!node.is_list())
      return log_.fault(node.place, path_of(key), "expected a list, found " + describe(node));
    for (const ConfigNode& element : node.items) {
      const std::string path = path_of(key) + "[" + std::to_string(items.size()) + "]";
      ConfigReader reader(element, path, log_);
      items.emplace_back().visit(reader);
      reader.finish();
    }
  }

  template <class T, class Check>
  void read(std::string_view key, T& value, std::optional<std::string_view> required_help,
            const Check& check) {
    const ConfigNode* const node = take(key);
    if (node == nullptr) {
      if (required_help) missing(key, *required_help);
      return;
    }
    T candidate{};
    std::string reason = read_value(*node, candidate);
    if (reason.empty()) reason = check(candidate);
    if (!reason.empty()) return log_.fault(node->place, path_of(key), std::move(reason));
    value = std::move(candidate);
  }

  /// The value of a key, null where there is none; from now on the key is known.
  [[nodiscard]] const ConfigNode* take(std::string_view key);
  [[nodiscard]] std::optional<std::string> nearest_key(std::string_view key) const;
  [[nodiscard]] std::string path_of(std::string_view key) const;
  void missing(std::string_view key, std::string_view help);

  const ConfigNode& node_;
  std::string path_;
  ReadLog& log_;
  std::vector<std::string> known_;  ///< asked for so far
  std::vector<Missing> missing_;
  bool ignores_unknown_keys_ = false;
};

}  // namespace crepes
