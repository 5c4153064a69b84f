/// The attributes of an IIO device in sysfs.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "estimator/core/result.hpp"

namespace crepes {

/// Files of a device's folder, by name. Errors name the file.
class IioAttributes {
 public:
  explicit IioAttributes(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] bool has(const std::string& name) const;
  /// Without spaces at the ends.
  [[nodiscard]] Result<std::string> text(const std::string& name) const;
  [[nodiscard]] Result<double> number(const std::string& name) const;
  /// Writes the text, unless it is there already.
  [[nodiscard]] Result<void> set(const std::string& name, const std::string& wanted) const;

 private:
  std::filesystem::path folder_;
};

/// Raw numbers to SI units: rad/s or m/s^2, in the axes of the board that the mount matrix names.
struct IioConversion {
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_board_chip = Eigen::Matrix3d::Identity();

  [[nodiscard]] Eigen::Vector3d apply(const Eigen::Vector3d& raw) const {
    return R_board_chip * (raw + offset).cwiseProduct(scale);
  }
};

/// Of the quantity "anglvel" or "accel". Refuses a device without scale, and a mount matrix that is
/// no rotation.
[[nodiscard]] Result<IioConversion> read_conversion(const IioAttributes& device,
                                                    std::string_view quantity);

/// Reads `a, b, c; d, e, f; g, h, i`; empty if it is no rotation.
[[nodiscard]] std::optional<Eigen::Matrix3d> parse_mount_matrix(std::string_view text);

/// The rate [Hz] that a device can have nearest to `wanted_hz`, by
/// `..._sampling_frequency_available`: a list, or `[least step most]`. `wanted_hz` if the text says
/// nothing.
[[nodiscard]] double nearest_rate(std::string_view available, double wanted_hz);

}  // namespace crepes
