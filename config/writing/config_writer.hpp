/// Writes a config struct as YAML through its `visit()`, each key below its help text.
#pragma once

#include <fmt/core.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/schema/config.hpp"

namespace crepes {

/// One value as YAML, on one line.
[[nodiscard]] std::string to_yaml(bool value);
[[nodiscard]] std::string to_yaml(int value);
[[nodiscard]] std::string to_yaml(double value);
[[nodiscard]] std::string to_yaml(const std::string& value);
[[nodiscard]] std::string to_yaml(const RobotId& value);
[[nodiscard]] std::string to_yaml(const Eigen::Vector3d& value);
[[nodiscard]] std::string to_yaml(const Eigen::Matrix3d& value);
[[nodiscard]] std::string to_yaml(const std::array<int, 2>& value);
[[nodiscard]] std::string to_yaml(const std::vector<double>& value);
[[nodiscard]] std::string to_yaml(const std::vector<std::string>& value);
[[nodiscard]] std::string to_yaml(const Pose& value);

/// The visitor for one mapping. Nested mappings have more indentation.
class ConfigWriter {
 public:
  explicit ConfigWriter(std::string indent = "") : indent_(std::move(indent)) {}

  [[nodiscard]] const std::string& text() const { return text_; }

  template <class T>
  void required(std::string_view key, T& value, std::string_view help) {
    write(key, value, fmt::format("{}; required", help));
  }
  template <class T>
  void required(std::string_view key, T& value, Bounds bounds, std::string_view help) {
    write(key, value, fmt::format("{}{}; required", help, range_of(bounds)));
  }
  template <class T>
  void field(std::string_view key, T& value, std::string_view help) {
    write(key, value, std::string(help));
  }
  template <class T>
  void field(std::string_view key, T& value, Bounds bounds, std::string_view help) {
    write(key, value, fmt::format("{}{}", help, range_of(bounds)));
  }

  template <class Enum, std::size_t N>
  void choice(std::string_view key, Enum& value, const std::array<Choice<Enum>, N>& choices,
              std::string_view help) {
    std::string names;
    std::string chosen;
    for (const Choice<Enum>& choice : choices) {
      names += (names.empty() ? "" : " | ") + std::string(choice.name);
      if (choice.value == value) chosen = choice.name;
    }
    comment(fmt::format("{} ({})", help, names));
    line(fmt::format("{}: {}", key, chosen));
  }

  template <class Section>
  void section(std::string_view key, Section& nested, Change when, std::string_view help) {
    section(key, nested, std::string(help) + name_of(when));
  }
  template <class Section>
  void section(std::string_view key, Section& section, std::string_view help) {
    text_ += '\n';
    comment(std::string(help));
    line(std::string(key) + ":");
    nest(section, indent_ + "  ");
  }

  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, Change when, std::string_view help) {
    list(key, items, std::string(help) + name_of(when));
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    text_ += '\n';
    comment(std::string(help) + "; required");
    line(std::string(key) + ":");
    write_items(items);
  }
  /// For an empty list, an example item is written as a comment.
  template <class Item>
  void optional_list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    comment(std::string(help));
    if (!items.empty()) {
      line(std::string(key) + ":");
      return write_items(items);
    }
    Item example;
    ConfigWriter writer(indent_ + "#     ");
    example.visit(writer);
    line(fmt::format("# {}:", key));
    line("#   -");
    text_ += writer.text();
  }

  /// Written as a comment only: the content of the named file is written instead.
  void reference(std::string_view key, std::string_view help) {
    comment(std::string(help));
    comment(std::string(key) + ":");
  }

 private:
  template <class Item>
  void write_items(std::vector<Item>& items) {
    for (Item& item : items) {
      line("  -");
      nest(item, indent_ + "    ");
    }
  }

  template <class T>
  void write(std::string_view key, const T& value, const std::string& help) {
    comment(help);
    line(fmt::format("{}: {}", key, to_yaml(value)));
  }
  /// A missing value is written as a comment.
  template <class T>
  void write(std::string_view key, const std::optional<T>& value, const std::string& help) {
    comment(help);
    line(value ? fmt::format("{}: {}", key, to_yaml(*value)) : fmt::format("# {}:", key));
  }

  template <class Struct>
  void nest(Struct& nested, const std::string& indent) {
    ConfigWriter writer(indent);
    nested.visit(writer);
    text_ += writer.text();
  }

  [[nodiscard]] static std::string name_of(Change when) {
    return when == Change::kLive ? " (live)" : " (restart)";
  }
  [[nodiscard]] static std::string range_of(const Bounds& bounds) {
    return fmt::format(" [{} .. {}]", to_yaml(bounds.min), to_yaml(bounds.max));
  }
  void comment(const std::string& text) { line("# " + text); }
  void line(const std::string& text) { text_ += indent_ + text + '\n'; }

  std::string indent_;
  std::string text_;
};

}  // namespace crepes
