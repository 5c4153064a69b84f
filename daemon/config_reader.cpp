#include "daemon/config_reader.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace crepes {
namespace {

constexpr double kOrthonormalWithin = 1e-3;

std::string expected(std::string_view what, const YAML::Node& node) {
  return "expected " + std::string(what) + ", found " + describe(node);
}

/// Decimal, whole text, independent of the locale; a leading plus is YAML's.
template <class Number>
bool parse_number(std::string_view text, Number& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

std::string read_numbers(const YAML::Node& node, std::string_view what, std::size_t count,
                         const auto& set) {
  if (!node.IsSequence() || node.size() != count) return expected(what, node);
  for (std::size_t i = 0; i < count; ++i) {
    if (std::string reason = set(i, node[i]); !reason.empty()) return reason;
  }
  return "";
}

/// Levenshtein distance: how many letters to insert, delete or replace.
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Row by row.
template <int kSize>
std::string read_matrix(const YAML::Node& node, std::string_view what,
                        Eigen::Matrix<double, kSize, kSize>& value) {
  constexpr auto kCount = static_cast<std::size_t>(kSize);
  return read_numbers(node, what, kCount, [&](std::size_t row, const YAML::Node& numbers) {
    return read_numbers(numbers, what, kCount, [&](std::size_t column, const YAML::Node& element) {
      return read_value(element,
                        value(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)));
    });
  });
}

}  // namespace

std::string describe(const YAML::Node& node) {
  constexpr std::size_t kShown = 40;
  if (node.IsScalar()) {
    const std::string& text = node.Scalar();
    return '"' + text.substr(0, kShown) + (text.size() > kShown ? "..." : "") + '"';
  }
  if (node.IsSequence()) return "a list of " + std::to_string(node.size());
  return node.IsMap() ? "a mapping" : "nothing";
}

std::string check_bounds(double value, const Bounds& bounds) {
  if (value >= bounds.min && value <= bounds.max) return "";
  const auto text = [](double number) {
    std::array<char, 32> buffer{};
    const std::to_chars_result result = std::to_chars(buffer.begin(), buffer.end(), number);
    return std::string(buffer.begin(), result.ptr);
  };
  return text(value) + " is outside [" + text(bounds.min) + ", " + text(bounds.max) + "]";
}

std::string read_value(const YAML::Node& node, bool& value) {
  if (!node.IsScalar()) return expected("true or false", node);
  value = node.Scalar() == "true";
  return value || node.Scalar() == "false" ? "" : expected("true or false", node);
}

std::string read_value(const YAML::Node& node, int& value) {
  return node.IsScalar() && parse_number(node.Scalar(), value) ? ""
                                                               : expected("a whole number", node);
}

std::string read_value(const YAML::Node& node, double& value) {
  const bool good = node.IsScalar() && parse_number(node.Scalar(), value) && std::isfinite(value);
  return good ? "" : expected("a number", node);
}

std::string read_value(const YAML::Node& node, std::string& value) {
  if (!node.IsScalar()) return expected("text", node);
  value = node.Scalar();
  return "";
}

std::string read_value(const YAML::Node& node, RobotId& value) {
  int number = 0;
  if (std::string reason = read_value(node, number); !reason.empty()) return reason;
  constexpr Bounds kHeld{0, std::numeric_limits<std::uint16_t>::max()};
  if (std::string reason = check_bounds(number, kHeld); !reason.empty()) return reason;
  value = RobotId{static_cast<std::uint16_t>(number)};
  return "";
}

std::string read_value(const YAML::Node& node, Eigen::Vector3d& value) {
  return read_numbers(node, "3 numbers", 3, [&](std::size_t i, const YAML::Node& element) {
    return read_value(element, value[static_cast<Eigen::Index>(i)]);
  });
}

std::string read_value(const YAML::Node& node, Eigen::Matrix3d& value) {
  return read_matrix(node, "a 3x3 matrix as 3 rows of 3 numbers", value);
}

std::string read_value(const YAML::Node& node, std::array<int, 2>& value) {
  return read_numbers(node, "2 whole numbers", 2, [&](std::size_t i, const YAML::Node& element) {
    return read_value(element, value.at(i));
  });
}

std::string read_value(const YAML::Node& node, std::vector<double>& value) {
  if (!node.IsSequence()) return expected("a list of numbers", node);
  value.resize(node.size());
  return read_numbers(node, "numbers", node.size(), [&](std::size_t i, const YAML::Node& element) {
    return read_value(element, value[i]);
  });
}

std::string read_value(const YAML::Node& node, std::vector<std::array<int, 2>>& value) {
  if (!node.IsSequence()) return expected("a list of pairs", node);
  value.resize(node.size());
  return read_numbers(node, "pairs", node.size(), [&](std::size_t i, const YAML::Node& element) {
    return read_value(element, value[i]);
  });
}

std::string read_value(const YAML::Node& node, std::vector<std::string>& value) {
  if (!node.IsSequence()) return expected("a list of texts", node);
  value.resize(node.size());
  return read_numbers(node, "texts", node.size(), [&](std::size_t i, const YAML::Node& element) {
    return read_value(element, value[i]);
  });
}

std::string read_value(const YAML::Node& node, Pose& value) {
  Eigen::Matrix4d T;
  std::string reason = read_matrix(node, "a 4x4 matrix as 4 rows of 4 numbers", T);
  if (!reason.empty()) return reason;
  if (T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return "the last row must be 0 0 0 1";

  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double off = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kOrthonormalWithin))
    return "the upper left 3x3 is not a rotation: R^T R is not I within 0.001";
  if (R.determinant() < 0) return "the upper left 3x3 mirrors: its determinant is -1";

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  value.q = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
  value.p = T.topRightCorner<3, 1>();
  return "";
}

ConfigReader::ConfigReader(const YAML::Node& node, std::string path, ReadLog& log)
    : path_(std::move(path)), is_mapping_(node.IsMap()), log_(log) {
  if (!is_mapping_) {
    log_.fault(path_, expected("a mapping of keys to values", node));
    return;
  }
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) {
      log_.fault(path_, expected("a key", entry.first));
      continue;
    }
    const std::string& key = entry.first.Scalar();
    const auto [it, inserted] = log_.lines.emplace(path_of(key), line_of(entry.first));
    if (inserted) {
      entries_.emplace(key, entry.second);
    } else {
      log_.fault(path_of(key), "is given again in line " + std::to_string(line_of(entry.first)));
    }
  }
}

void ConfigReader::finish() {
  for (const auto& entry : entries_) {
    const std::string& key = entry.first;
    const auto nearest =
        std::ranges::min_element(known_, {}, [&](const auto& k) { return edits_between(k, key); });
    std::string reason = "unknown key";
    if (nearest != known_.end() && edits_between(*nearest, key) <= 1 + key.size() / 3) {
      reason += "; did you mean " + *nearest + "?";
      std::erase_if(missing_, [&](const Missing& missing) { return missing.key == *nearest; });
      log_.unread.insert(path_of(*nearest));
    }
    log_.fault(path_of(key), reason);
  }
  for (const Missing& missing : missing_) {
    const std::string path = path_of(missing.key);
    log_.lines.emplace(path, log_.lines.contains(path_) ? log_.lines[path_] : 1);
    log_.fault(path, "is missing: " + missing.help);
  }
}

std::optional<YAML::Node> ConfigReader::take(std::string_view key) {
  const auto it = entries_.find(key);
  if (it == entries_.end()) {
    known_.emplace_back(key);
    return std::nullopt;
  }
  return entries_.extract(it).mapped();
}

std::string ConfigReader::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : path_ + '.' + std::string(key);
}

void ConfigReader::missing(std::string_view key, std::string_view help) {
  if (is_mapping_) missing_.push_back({std::string(key), std::string(help)});
}

}  // namespace crepes
