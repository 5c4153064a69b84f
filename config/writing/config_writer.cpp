#include "config/writing/config_writer.hpp"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include "config/schema/nearest_rotation.hpp"

namespace crepes {
namespace {

template <class Numbers>
std::string flow_list(const Numbers& values) {
  std::string text = "[";
  for (const auto& value : values) text += (text.size() > 1 ? ", " : "") + to_yaml(value);
  return text + "]";
}

}  // namespace

std::string to_yaml(bool value) { return value ? "true" : "false"; }

std::string to_yaml(int value) { return std::to_string(value); }

/// The shortest text that reads back to the same number, without an exponent where that is
/// readable.
std::string to_yaml(double value) {
  const double size = std::abs(value);
  const bool is_plain = size == 0 || (size >= 1e-6 && size < 1e12);
  std::array<char, 32> buffer{};
  const std::to_chars_result result =
      std::to_chars(buffer.begin(), buffer.end(), value,
                    is_plain ? std::chars_format::fixed : std::chars_format::general);
  return {buffer.begin(), result.ptr};
}

/// Always quoted, so that no text reads back as something else.
std::string to_yaml(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> escaped{};
      std::snprintf(escaped.data(), escaped.size(), "\\x%02x", static_cast<unsigned>(c));
      text += escaped.data();
      continue;
    }
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

std::string to_yaml(const RobotId& value) { return std::to_string(value.value); }
std::string to_yaml(const Eigen::Vector3d& value) { return flow_list(value); }
std::string to_yaml(const Eigen::Matrix3d& value) {
  return fmt::format("[{}, {}, {}]", flow_list(value.row(0)), flow_list(value.row(1)),
                     flow_list(value.row(2)));
}
std::string to_yaml(const std::array<int, 2>& value) { return flow_list(value); }
std::string to_yaml(const std::vector<double>& value) { return flow_list(value); }
std::string to_yaml(const std::vector<std::string>& value) { return flow_list(value); }

/// Rotations are rounded to 1e-13, so that 90 degree rotations appear as 0 and 1, and so that what
/// is read again is written as the same text.
std::string to_yaml(const Pose& value) {
  static constexpr double kPerUnit = 1e13;
  constexpr int kRounds = 8;
  const auto rounded = [](const Eigen::Matrix3d& R) -> Eigen::Matrix3d {
    return ((R * kPerUnit).array().round() / kPerUnit + 0.0).matrix();
  };
  Eigen::Matrix3d R = rounded(value.R());
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Matrix3d again = rounded(nearest_rotation(R).toRotationMatrix());
    if (again == std::exchange(R, again)) break;
  }
  Eigen::Matrix<double, 3, 4> top;
  top << R, value.p;
  std::string text = "[";
  for (const auto& row : top.rowwise()) text += flow_list(row) + ", ";
  return text + "[0, 0, 0, 1]]";
}

}  // namespace crepes
