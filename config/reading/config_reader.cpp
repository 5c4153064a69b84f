#include "config/reading/config_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>

#include "config/reading/spelling.hpp"
#include "config/schema/nearest_rotation.hpp"
#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

constexpr double kOrthonormalWithin = 1e-3;

std::string expected(std::string_view what, const ConfigNode& node) {
  return fmt::format("expected {}, found {}", what, describe(node));
}

/// YAML allows a leading plus.
template <class Number>
bool is_number(const ConfigNode& node, Number& value) {
  std::string_view text = node.text;
  if (text.starts_with('+')) text.remove_prefix(1);
  return node.is_text() && parse_number(text, value).empty();
}

std::string read_numbers(const ConfigNode& node, std::string_view what, std::size_t count,
                         const auto& set) {
  if (!node.is_list() || node.items.size() != count) return expected(what, node);
  for (std::size_t i = 0; i < count; ++i) {
    if (std::string reason = set(i, node.items[i]); !reason.empty()) return reason;
  }
  return "";
}

/// Row by row.
template <int kSize>
std::string read_matrix(const ConfigNode& node, std::string_view what,
                        Eigen::Matrix<double, kSize, kSize>& value) {
  constexpr auto kCount = static_cast<std::size_t>(kSize);
  return read_numbers(node, what, kCount, [&](std::size_t row, const ConfigNode& numbers) {
    return read_numbers(numbers, what, kCount, [&](std::size_t column, const ConfigNode& element) {
      return read_value(element,
                        value(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)));
    });
  });
}

/// A key that an earlier version had.
struct RetiredKey {
  std::string_view path;
  std::string_view reason;
};
constexpr std::array kRetiredKeys{RetiredKey{
    "estimator.forget_after_s", "has no effect; a neighbor without inertial samples is forgotten"}};

}  // namespace

std::string check_bounds(double value, const Bounds& bounds) {
  if (value >= bounds.min && value <= bounds.max) return "";
  const auto text = [](double number) {
    std::array<char, 32> buffer{};
    const std::to_chars_result result = std::to_chars(buffer.begin(), buffer.end(), number);
    return std::string(buffer.begin(), result.ptr);
  };
  return fmt::format("{} is outside [{}, {}]", text(value), text(bounds.min), text(bounds.max));
}

std::string read_value(const ConfigNode& node, bool& value) {
  if (!node.is_text()) return expected("true or false", node);
  value = node.text == "true";
  return value || node.text == "false" ? "" : expected("true or false", node);
}

std::string read_value(const ConfigNode& node, int& value) {
  return is_number(node, value) ? "" : expected("a whole number", node);
}

std::string read_value(const ConfigNode& node, double& value) {
  return is_number(node, value) ? "" : expected("a number", node);
}

std::string read_value(const ConfigNode& node, std::string& value) {
  if (!node.is_text()) return expected("text", node);
  value = node.text;
  return "";
}

std::string read_value(const ConfigNode& node, RobotId& value) {
  int number = 0;
  if (std::string reason = read_value(node, number); !reason.empty()) return reason;
  constexpr Bounds kIds{1, 65534};  // as every id in the schema
  if (std::string reason = check_bounds(number, kIds); !reason.empty()) return reason;
  value = RobotId{static_cast<std::uint16_t>(number)};
  return "";
}

std::string read_value(const ConfigNode& node, Eigen::Vector3d& value) {
  return read_numbers(node, "3 numbers", 3, [&](std::size_t i, const ConfigNode& element) {
    return read_value(element, value[static_cast<Eigen::Index>(i)]);
  });
}

std::string read_value(const ConfigNode& node, Eigen::Matrix3d& value) {
  return read_matrix(node, "a 3x3 matrix as 3 rows of 3 numbers", value);
}

std::string read_value(const ConfigNode& node, std::array<int, 2>& value) {
  return read_numbers(node, "2 whole numbers", 2, [&](std::size_t i, const ConfigNode& element) {
    return read_value(element, value.at(i));
  });
}

std::string read_value(const ConfigNode& node, std::vector<double>& value) {
  if (!node.is_list()) return expected("a list of numbers", node);
  value.resize(node.items.size());
  return read_numbers(
      node, "numbers", node.items.size(),
      [&](std::size_t i, const ConfigNode& element) { return read_value(element, value[i]); });
}

std::string read_value(const ConfigNode& node, std::vector<std::array<int, 2>>& value) {
  if (!node.is_list()) return expected("a list of pairs", node);
  value.resize(node.items.size());
  return read_numbers(
      node, "pairs", node.items.size(),
      [&](std::size_t i, const ConfigNode& element) { return read_value(element, value[i]); });
}

std::string read_value(const ConfigNode& node, std::vector<std::string>& value) {
  if (!node.is_list()) return expected("a list of texts", node);
  value.resize(node.items.size());
  return read_numbers(
      node, "texts", node.items.size(),
      [&](std::size_t i, const ConfigNode& element) { return read_value(element, value[i]); });
}

std::string read_value(const ConfigNode& node, Pose& value) {
  Eigen::Matrix4d T;
  std::string reason = read_matrix(node, "a 4x4 matrix as 4 rows of 4 numbers", T);
  if (!reason.empty()) return reason;
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return "the last row must be 0 0 0 1";

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double off = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kOrthonormalWithin))
    return "the upper left 3x3 is not a rotation: R^T R is not I within 0.001";
  if (R.determinant() < 0) return "the upper left 3x3 mirrors: its determinant is -1";

  value.q = nearest_rotation(R);
  value.p = T.topRightCorner<3, 1>();
  return "";
}

ConfigReader::ConfigReader(const ConfigNode& node, std::string path, ReadLog& log)
    : node_(node), path_(std::move(path)), log_(log) {
  if (!node.is_mapping())
    log_.fault(node.place, path_, expected("a mapping of keys to values", node));
  if (node.is_incomplete) log_.unread.insert(path_);
}

void ConfigReader::finish() {
  for (std::size_t i = 0; i < node_.keys.size() && !ignores_unknown_keys_; ++i) {
    const std::string& key = node_.keys[i];
    if (std::ranges::count(known_, key) > 0) continue;
    const auto* const retired = std::ranges::find(kRetiredKeys, path_of(key), &RetiredKey::path);
    if (retired != kRetiredKeys.end()) {
      const Place& place = node_.items[i].place;
      log_.warnings.push_back({place.file, place.line, path_of(key), std::string(retired->reason)});
      continue;
    }
    std::string reason = "unknown key";
    const auto nearest = nearest_key(key);
    if (nearest) {
      reason += fmt::format("; did you mean {}?", *nearest);
      std::erase_if(missing_, [&](const Missing& missing) { return missing.key == *nearest; });
      log_.unread.insert(path_of(*nearest));
    }
    log_.fault(node_.items[i].place, path_of(key), reason);
  }
  if (node_.is_incomplete) return;
  for (const Missing& missing : missing_)
    log_.fault(node_.place, path_of(missing.key), "is missing: " + missing.help);
}

/// The known key that is missing and has the most similar spelling, if any is similar.
std::optional<std::string> ConfigReader::nearest_key(std::string_view key) const {
  std::vector<std::string> absent;
  std::ranges::copy_if(known_, std::back_inserter(absent),
                       [&](const std::string& known) { return node_.find(known) == nullptr; });
  return nearest_spelling(key, absent);
}

const ConfigNode* ConfigReader::find_known(std::string_view key) {
  known_.emplace_back(key);
  return node_.find(key);
}

std::string ConfigReader::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void ConfigReader::missing(std::string_view key, std::string_view help) {
  if (node_.is_mapping()) missing_.push_back({std::string(key), std::string(help)});
}

}  // namespace crepes
