/// Fills a config struct from a YAML mapping through its `visit()`, and collects every fault.
#pragma once

#include <fmt/core.h>

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/reading/config_node.hpp"
#include "config/schema/config.hpp"

namespace crepes {

/// The state that all readers of one tree share.
struct ReadLog {
  explicit ReadLog(const ConfigNode& tree) : root(tree) {}

  const ConfigNode& root;
  std::vector<ConfigFault> faults;
  std::vector<ConfigFault> warnings;          ///< keys without effect
  std::set<std::string, std::less<>> unread;  ///< paths that have no value from the tree

  /// `path` names the faulty value, `place` its position.
  void fault(const Place& place, const std::string& path, std::string reason) {
    faults.push_back({place.file, place.line, path, std::move(reason)});
    unread.insert(path);
  }
  void fault(const std::string& path, std::string reason) {
    fault(place_of(root, path), path, std::move(reason));
  }
};

/// Reads one value from its node. Returns the fault, or an empty text. After a fault `value` is
/// unspecified.
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

/// Checks the bounds of each number. Returns the fault, or an empty text.
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

/// The visitor for one mapping. `finish()` reports the keys that no field has asked for.
class ConfigReader {
 public:
  /// If `node` is not a mapping, that is the only fault.
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
    const ConfigNode* const node = find_known(key);
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
               fmt::format("expected one of {}, found {}", allowed, describe(*node)));
  }

  template <class Section>
  void section(std::string_view key, Section& section, std::string_view /*help*/) {
    if (!node_.is_mapping()) return;
    const ConfigNode* const node = find_known(key);
    // An absent section may still have required keys.
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
    const ConfigNode* const node = find_known(key);
    if (node == nullptr) return missing(key, help);
    read_items(*node, key, items);
  }
  template <class Item>
  void optional_list(std::string_view key, std::vector<Item>& items, std::string_view /*help*/) {
    if (const ConfigNode* const node = find_known(key)) read_items(*node, key, items);
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, Change /*when*/,
            std::string_view help) {
    list(key, items, help);
  }

  /// config_sources.hpp has resolved it already. It is listed here so that its spelling is known.
  void reference(std::string_view key, std::string_view /*help*/) {
    static_cast<void>(find_known(key));
  }

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
      const std::string path = fmt::format("{}[{}]", path_of(key), items.size());
      ConfigReader reader(element, path, log_);
      items.emplace_back().visit(reader);
      reader.finish();
    }
  }

  template <class T, class Check>
  void read(std::string_view key, T& value, std::optional<std::string_view> required_help,
            const Check& check) {
    const ConfigNode* const node = find_known(key);
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

  /// The value of a key, or null. From now on the key counts as known.
  [[nodiscard]] const ConfigNode* find_known(std::string_view key);
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
