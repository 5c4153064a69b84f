#include "daemon/ctl/calibrate/imu_fragment.hpp"

#include <fmt/core.h>

#include <Eigen/LU>

#include "config/writing/config_writer.hpp"

namespace crepes {
namespace {

// In force is v_B = R A (v_S - b), A = T K. With v_true = M (v_B - b_found):
//   R^T v_true = R^T M R A (v_S - b - (R A)^-1 b_found)
TriadEstimate triad_of_sensor(const TriadEstimate& found, const TriadConfig& in_force,
                              const Eigen::Matrix3d& R_B_S) {
  const Eigen::Matrix3d A = R_B_S * in_force.misalignment * in_force.scale.asDiagonal();
  const Eigen::Matrix3d A_inverse = A.inverse();
  const auto variance = [](const auto& sigma) { return sigma.array().square().matrix().eval(); };
  TriadEstimate triad = found;
  triad.M = R_B_S.transpose() * found.M * A;
  triad.bias = in_force.bias + A_inverse * found.bias;
  triad.M_sigma = (variance(R_B_S).transpose() * variance(found.M_sigma) * variance(A)).cwiseSqrt();
  triad.bias_sigma = (variance(A_inverse) * variance(found.bias_sigma)).cwiseSqrt();
  return triad;
}

}  // namespace

ImuTriads of_sensor(const ImuTriads& found, const ImuDeviceConfig& in_force) {
  const Eigen::Matrix3d R_B_S = in_force.T_body_imu.R();
  return {triad_of_sensor(found.accelerometer, in_force.accelerometer, R_B_S),
          triad_of_sensor(found.gyroscope, in_force.gyroscope, R_B_S)};
}

std::string triad_text(std::string_view name, const TriadEstimate& triad) {
  const Eigen::Vector3d scale = triad.scale();
  const Eigen::Matrix3d misalignment = triad.misalignment();
  return fmt::format("  {}:\n    bias: {}\n    scale: {}\n    misalignment: {}\n", name,
                     to_yaml(triad.bias), to_yaml(scale), to_yaml(misalignment));
}

}  // namespace crepes
