#include "estimator/relative/raw_pose.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <optional>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

// Smallest horizontal part of a direction with a usable heading: 6 degrees from the vertical.
constexpr double kMinHorizontal = 0.1;
constexpr double kMinRange = 0.10;         // m; below it the mountings set the direction
constexpr double kMaxContradiction = 5.0;  // sigma
// Each iteration reduces the error by about mounting over range, more slowly near the vertical.
constexpr int kIterations = 10;

struct Solution {
  Pose T_B_N;
  Eigen::Vector3d p_N_B;
};

double horizontal(const Eigen::Vector3d& v) { return std::hypot(v.x(), v.y()); }
double heading(const Eigen::Vector3d& v) { return std::atan2(v.y(), v.x()); }

// R_L_B: levels the body, by pitch and roll alone as Z-Y-X Euler angles define them.
Eigen::Quaterniond leveling(const Eigen::Vector3d& up) {
  const double roll = std::atan2(up.y(), up.z());
  const double pitch = std::atan2(-up.x(), std::hypot(up.y(), up.z()));
  return Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

// The s > 0 with |offset + s u| = range.
std::optional<double> along(const Eigen::Vector3d& u, const Eigen::Vector3d& offset, double range) {
  const double half = u.dot(offset);
  const double inside = half * half - offset.squaredNorm() + range * range;
  if (inside < 0.0) return std::nullopt;
  const double s = -half + std::sqrt(inside);
  return s > 0.0 ? std::optional(s) : std::nullopt;
}

// Position of `other`'s body in `seer`'s from the seer's direction and the range:
//   c + s u = p + R m   and   |p + R q - a| = range.
std::optional<Eigen::Vector3d> position(const Sighting& seer, const Mounting& other,
                                        const Eigen::Matrix3d& R_seer_other, double range_m) {
  const Eigen::Vector3d ring = seer.mounting.camera - R_seer_other * other.led;
  const std::optional<double> s =
      along(seer.u, ring + R_seer_other * other.antenna - seer.mounting.antenna, range_m);
  if (!s) return std::nullopt;
  return ring + *s * seer.u;
}

std::variant<Solution, NoPoseReason> solve(const MutualSighting& m) {
  if (m.range_m < kMinRange) return NoPoseReason::kTooClose;
  const Eigen::Quaterniond q_L_B = leveling(m.B.up);
  const Eigen::Quaterniond q_L_N = leveling(m.N.up);
  const Eigen::Vector3d u_N_level = q_L_N * m.N.u;
  if (horizontal(u_N_level) < kMinHorizontal) return NoPoseReason::kNearVertical;

  // The first pass uses -u_B for the line from N's camera to our ring: the paper's formula.
  Eigen::Vector3d back_B = -m.B.u;
  Solution solution;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d back_level = q_L_B * back_B.normalized();
    if (horizontal(back_level) < kMinHorizontal) return NoPoseReason::kNearVertical;
    const double psi = heading(back_level) - heading(u_N_level);
    const Eigen::Quaterniond q_B_N =
        q_L_B.conjugate() * Eigen::AngleAxisd(psi, Eigen::Vector3d::UnitZ()) * q_L_N;
    const Eigen::Matrix3d R_B_N = q_B_N.toRotationMatrix();

    const auto p_B_N = position(m.B, m.N.mounting, R_B_N, m.range_m);
    const auto p_N_B = position(m.N, m.B.mounting, R_B_N.transpose(), m.range_m);
    if (!p_B_N || !p_N_B) return NoPoseReason::kNoRange;
    solution = {{*p_B_N, q_B_N}, *p_N_B};
    back_B = m.B.mounting.led - solution.T_B_N * m.N.mounting.camera;
    if (back_B.norm() < kMinRange) return NoPoseReason::kTooClose;
  }
  return solution;
}

// Whether both robots measure the same elevation of the line from N's camera to B's ring.
bool elevations_agree(const MutualSighting& m, const Solution& solution) {
  const Eigen::Vector3d line_B = m.B.mounting.led - solution.T_B_N * m.N.mounting.camera;
  const double elevation_B = std::asin(m.B.up.dot(line_B.normalized()));
  const double elevation_N = std::asin(m.N.up.dot(m.N.u));
  const auto square = [](double x) { return x * x; };
  const double variance = square(m.B.bearing_sigma_rad) + square(m.N.bearing_sigma_rad) +
                          square(m.B.tilt_sigma_rad) + square(m.N.tilt_sigma_rad);
  return square(elevation_B - elevation_N) <= square(kMaxContradiction) * variance;
}

// The inputs as a vector of nine independent errors: two across each unit vector, and the range.
constexpr int kInputs = 9;
Eigen::Vector3d turned(const Eigen::Vector3d& u, double a, double b) {
  return (u + tangent_basis(u) * Eigen::Vector2d(a, b)).normalized();
}
MutualSighting disturbed(const MutualSighting& m, int input, double step) {
  MutualSighting moved = m;
  const double a = input % 2 == 0 ? step : 0.0;
  const double b = input % 2 == 0 ? 0.0 : step;
  switch (input / 2) {
    case 0:
      moved.B.u = turned(m.B.u, a, b);
      break;
    case 1:
      moved.N.u = turned(m.N.u, a, b);
      break;
    case 2:
      moved.B.up = turned(m.B.up, a, b);
      break;
    case 3:
      moved.N.up = turned(m.N.up, a, b);
      break;
    default:
      moved.range_m += step;
  }
  return moved;
}

using InputJacobian = Eigen::Matrix<double, 9, kInputs>;

// Derivative of the solution itself, by central differences.
std::optional<InputJacobian> input_jacobian(const MutualSighting& m, const Solution& at) {
  constexpr double kStep = 1e-5;  // rad and m; rounding and curvature both stay below 1e-9
  InputJacobian J;
  for (int i = 0; i < kInputs; ++i) {
    const auto plus = solve(disturbed(m, i, kStep));
    const auto minus = solve(disturbed(m, i, -kStep));
    const auto* high = std::get_if<Solution>(&plus);
    const auto* low = std::get_if<Solution>(&minus);
    if (high == nullptr || low == nullptr) return std::nullopt;
    J.col(i) << high->T_B_N.p - low->T_B_N.p, high->p_N_B - low->p_N_B,
        so3_log(at.T_B_N.q.conjugate() * high->T_B_N.q) -
            so3_log(at.T_B_N.q.conjugate() * low->T_B_N.q);
    J.col(i) /= 2.0 * kStep;
  }
  return J;
}

Eigen::Matrix<double, 9, 9> covariance(const MutualSighting& m, const InputJacobian& J) {
  Eigen::Matrix<double, kInputs, 1> sigma;
  sigma << m.B.bearing_sigma_rad, m.B.bearing_sigma_rad, m.N.bearing_sigma_rad,
      m.N.bearing_sigma_rad, m.B.tilt_sigma_rad, m.B.tilt_sigma_rad, m.N.tilt_sigma_rad,
      m.N.tilt_sigma_rad, m.range_sigma_m;
  const InputJacobian scaled = J * sigma.asDiagonal();
  return scaled * scaled.transpose();
}

// The true pose follows from corrected inputs: the direction Exp(-m) u, the vertical
// up - b / g - S up, and the range minus its bias.
CalibrationJacobian calibration_jacobian(const MutualSighting& m, const InputJacobian& J) {
  Eigen::Matrix<double, 6, kInputs> J_pose;
  J_pose << J.topRows<3>(), J.bottomRows<3>();
  const auto by_turn = [&](int column, const Eigen::Vector3d& u) -> Eigen::Matrix<double, 6, 3> {
    return J_pose.middleCols<2>(column) * tangent_basis(u).transpose() * hat(u);
  };
  const auto by_force = [&](int column, const Eigen::Vector3d& up) -> Eigen::Matrix<double, 6, 3> {
    return J_pose.middleCols<2>(column) * tangent_basis(up).transpose() / -kGravityMps2;
  };
  const auto by_scale = [&](int column, const Eigen::Vector3d& up) {
    Eigen::Matrix<double, 6, 9> J_scale;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      J_scale.middleCols<3>(3 * axis) = kGravityMps2 * up(axis) * by_force(column, up);
    return J_scale;
  };
  return {.by_misalignment_B = by_turn(0, m.B.u),
          .by_misalignment_N = by_turn(2, m.N.u),
          .by_accel_bias_B = by_force(4, m.B.up),
          .by_accel_bias_N = by_force(6, m.N.up),
          .by_accel_scale_B = by_scale(4, m.B.up),
          .by_accel_scale_N = by_scale(6, m.N.up),
          .by_range_bias = -J_pose.col(8)};
}

}  // namespace

GaussianPose RawPose::gaussian() const {
  GaussianPose result{.pose = T_B_N, .covariance = Matrix6d::Zero()};
  result.covariance.topLeftCorner<3, 3>() = covariance.topLeftCorner<3, 3>();
  result.covariance.topRightCorner<3, 3>() = covariance.topRightCorner<3, 3>();
  result.covariance.bottomLeftCorner<3, 3>() = covariance.bottomLeftCorner<3, 3>();
  result.covariance.bottomRightCorner<3, 3>() = covariance.bottomRightCorner<3, 3>();
  return result;
}

std::variant<RawPose, NoPoseReason> compute_raw_pose(const MutualSighting& sighting) {
  const auto solved = solve(sighting);
  if (const auto* reason = std::get_if<NoPoseReason>(&solved)) return *reason;
  const auto& solution = std::get<Solution>(solved);
  if (!elevations_agree(sighting, solution)) return NoPoseReason::kUncertain;
  const auto J = input_jacobian(sighting, solution);
  if (!J) return NoPoseReason::kNearVertical;
  return RawPose{solution.T_B_N, solution.p_N_B, covariance(sighting, *J),
                 calibration_jacobian(sighting, *J)};
}

std::vector<GaussianPose> poses_by_heading(const Sighting& seer, const Sighting& seen,
                                           double range_m, double range_sigma_m, int count) {
  const auto square = [](double x) { return x * x; };
  const double step = 2.0 * std::numbers::pi / count;
  const Eigen::Quaterniond q_seer_L = leveling(seer.up).conjugate();
  const Eigen::Quaterniond q_L_seen = leveling(seen.up);
  const Eigen::Matrix3d along = seer.u * seer.u.transpose();
  const Eigen::Matrix3d vertical = seen.up * seen.up.transpose();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();

  std::vector<GaussianPose> poses;
  for (int i = 0; i < count; ++i) {
    GaussianPose pose;
    pose.pose.q = q_seer_L * Eigen::AngleAxisd(i * step, Eigen::Vector3d::UnitZ()) * q_L_seen;
    const auto p = position(seer, seen.mounting, pose.pose.R(), range_m);
    if (!p) return {};
    pose.pose.p = *p;
    pose.covariance.topLeftCorner<3, 3>() =
        square(range_sigma_m) * along + square(range_m * seer.bearing_sigma_rad) * (I - along);
    pose.covariance.bottomRightCorner<3, 3>() =
        (square(seer.tilt_sigma_rad) + square(seen.tilt_sigma_rad)) * (I - vertical) +
        square(step / 1.5) * vertical;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace crepes
