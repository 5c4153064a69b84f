#include "drivers/iio/iio_attributes.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>

#include "drivers/base/number_text.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/base/unique_fd.hpp"

namespace crepes {
namespace {

constexpr std::string_view kSpaces = " \t\r\n";
constexpr std::uintmax_t kLongestAttribute = 4096;  // the kernel's limit

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kSpaces);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpaces) - begin + 1);
}

/// The numbers between spaces and any of `separators`; empty if anything else is there.
std::vector<double> numbers_in(std::string_view text, std::string_view separators) {
  const std::string between = std::string(kSpaces) + std::string(separators);
  std::vector<double> numbers;
  for (std::size_t at = text.find_first_not_of(between); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(between, at), text.size());
    double number = 0.0;
    if (!parse_number(text.substr(at, end - at), number).empty()) return {};
    numbers.push_back(number);
    at = text.find_first_not_of(between, end);
  }
  return numbers;
}

tl::unexpected<Error> not_written(const std::string& path, const std::string& wanted, int error) {
  std::string_view hint;
  if (error == EACCES || error == EROFS)
    hint = "; see \"Linux IIO\" in sensors.md for the permission";
  if (error == EBUSY) hint = "; does another program use it?";
  return fail(error == ENODEV || error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo,
              fmt::format("{}: cannot be set to {}: {}{}", path, wanted,
                          std::generic_category().message(error), hint));
}

/// The number of `in_<quantity>_<axis>_<what>`, or of what all axes share.
Result<double> axis_number(const IioAttributes& device, std::string_view quantity, char axis,
                           std::string_view what) {
  const std::string own = fmt::format("in_{}_{}_{}", quantity, axis, what);
  return device.number(device.has(own) ? own : fmt::format("in_{}_{}", quantity, what));
}

}  // namespace

bool IioAttributes::has(const std::string& name) const {
  std::error_code failed;
  return std::filesystem::exists(folder_ / name, failed);
}

Result<std::string> IioAttributes::text(const std::string& name) const {
  return read_text_file(folder_ / name, kLongestAttribute).map([](const std::string& text) {
    return std::string(trimmed(text));
  });
}

Result<double> IioAttributes::number(const std::string& name) const {
  const Result<std::string> read = text(name);
  if (!read) return tl::unexpected(read.error());
  double value = 0.0;
  const std::string_view fault = parse_number(*read, value);
  if (fault.empty()) return value;
  return fail(ErrorCode::kFormat,
              fmt::format("{}: \"{}\" is {}", (folder_ / name).string(), *read, fault));
}

Result<void> IioAttributes::set(const std::string& name, const std::string& wanted) const {
  if (const Result<std::string> now = text(name); now && *now == wanted) return {};
  const std::string path = folder_ / name;
  const UniqueFd file{::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC)};
  if (!file) return not_written(path, wanted, errno);
  if (::write(file.get(), wanted.data(), wanted.size()) < 0)
    return not_written(path, wanted, errno);
  return {};
}

std::optional<Eigen::Matrix3d> parse_mount_matrix(std::string_view text) {
  constexpr double kTolerance = 1e-3;  // entries are decimals written by hand
  const std::vector<double> numbers = numbers_in(text, ",;");
  if (numbers.size() != 9) return std::nullopt;
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix3d>(numbers.data()).transpose();
  const Eigen::Matrix3d residual = R * R.transpose() - Eigen::Matrix3d::Identity();
  if (!(residual.cwiseAbs().maxCoeff() < kTolerance) || R.determinant() < 0.0) return std::nullopt;
  return R;
}

Result<IioConversion> read_conversion(const IioAttributes& device, std::string_view quantity) {
  constexpr std::array kAxes{'x', 'y', 'z'};
  IioConversion conversion;
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const Result<double> scale = axis_number(device, quantity, kAxes.at(i), "scale");
    if (!scale) return tl::unexpected(scale.error());
    conversion.scale[axis] = *scale;
    conversion.offset[axis] = axis_number(device, quantity, kAxes.at(i), "offset").value_or(0.0);
  }
  for (const std::string& name : {fmt::format("in_{}_mount_matrix", quantity),
                                  std::string("in_mount_matrix"), std::string("mount_matrix")}) {
    if (!device.has(name)) continue;
    const Result<std::string> text = device.text(name);
    const auto R = text ? parse_mount_matrix(*text) : std::nullopt;
    if (!R) {
      return fail(ErrorCode::kFormat,
                  fmt::format("{}: \"{}\" is no rotation", (device.folder() / name).string(),
                              text.value_or("")));
    }
    conversion.R_board_chip = *R;
    return conversion;
  }
  return conversion;
}

double nearest_rate(std::string_view available, double wanted_hz) {
  const std::string_view text = trimmed(available);
  const bool is_interval = text.starts_with('[');
  const std::vector<double> rates = numbers_in(text, "[]");
  if (is_interval && rates.size() == 3) {
    const double step = std::max(rates[1], 1e-9);
    const double steps = std::round((std::clamp(wanted_hz, rates[0], rates[2]) - rates[0]) / step);
    return rates[0] + step * steps;
  }
  const auto off = [&](double rate) {
    return rate > 0.0 ? std::abs(std::log(rate / wanted_hz)) : std::numeric_limits<double>::max();
  };
  const auto best = std::ranges::min_element(rates, {}, off);
  return best == rates.end() ? wanted_hz : *best;
}

}  // namespace crepes
