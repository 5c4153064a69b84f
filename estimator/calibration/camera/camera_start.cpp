#include "estimator/calibration/camera/camera_start.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/vision/double_sphere.hpp"

namespace crepes {
namespace {

constexpr double kLongestStep_s = 0.05;  // two frames at 40 Hz
constexpr std::size_t kLeastSteps = 200;
constexpr double kBoardDistance_m = 3.0;
constexpr double kLevelling_s = 5.0;

std::size_t sample_at(std::span<const ImuSample> imu, Timestamp t) {
  const auto found = std::ranges::lower_bound(imu, t, {}, &ImuSample::stamp);
  return static_cast<std::size_t>(found - imu.begin());
}

/// The pairs of successive sightings of one board.
template <class Visit>
void for_each_step(std::span<const BoardSighting> sightings, const Visit& visit) {
  std::vector<const BoardSighting*> last;
  for (const BoardSighting& sighting : sightings) {
    if (last.size() <= sighting.board) last.resize(sighting.board + 1, nullptr);
    const BoardSighting* const before = last[sighting.board];
    last[sighting.board] = &sighting;
    if (before == nullptr) continue;
    const double dt = to_seconds(sighting.stamp - before->stamp);
    if (dt > 0.0 && dt <= kLongestStep_s) visit(*before, sighting, dt);
  }
}

}  // namespace

LensVector generic_lens(int width, int height, double fov_rad) {
  LensVector lens;
  lens << -0.2, 0.6, 1.0, 1.0, 0.0, 0.0;
  const double half = 0.5 * fov_rad;
  const Vector3<double> rim(std::sin(half), 0.0, std::cos(half));
  const auto m = project_double_sphere<double>(lens, rim);
  const double radius = m ? m->x() : 1.0;
  const double f = 0.5 * std::min(width, height) / radius;
  lens.tail<4>() << f, f, 0.5 * (width - 1), 0.5 * (height - 1);
  return lens;
}

std::optional<Eigen::Vector3d> direction_of(const LensVector& lens, const Eigen::Vector2d& uv) {
  const DoubleSphere sphere(lens[0], lens[1]);
  return sphere.unproject({(uv.x() - lens[4]) / lens[2], (uv.y() - lens[5]) / lens[3]}, nullptr);
}

std::optional<HandEye> align_camera(std::span<const ImuSample> imu,
                                    std::span<const BoardSighting> sightings,
                                    const LensVector& lens) {
  using Matrix12 = Eigen::Matrix<double, 12, 12>;
  using Vector12 = Eigen::Matrix<double, 12, 1>;
  Matrix12 H = Matrix12::Zero();
  Vector12 g = Vector12::Zero();
  std::size_t count = 0;
  for_each_step(sightings, [&](const BoardSighting& from, const BoardSighting& to, double dt) {
    const auto u0 = direction_of(lens, from.uv);
    const auto u1 = direction_of(lens, to.uv);
    const std::size_t i = sample_at(imu, from.stamp + (to.stamp - from.stamp) / 2);
    if (!u0 || !u1 || i >= imu.size()) return;
    const Eigen::Matrix3d U = hat((*u0 + *u1).normalized());
    Eigen::Matrix<double, 3, 12> J;
    for (int k = 0; k < 3; ++k) J.middleCols<3>(3L * k) = U * imu[i].gyro_radps[k];
    J.rightCols<3>() = -U;
    H += J.transpose() * J;
    g += J.transpose() * ((*u1 - *u0) / dt);
    ++count;
  });
  if (count < kLeastSteps) return std::nullopt;
  H.diagonal().array() += 1e-6 * H.trace();
  const Vector12 x = H.ldlt().solve(g);
  return hand_eye_of(Eigen::Map<const Eigen::Matrix3d>(x.data()), x.tail<3>());
}

HandEye hand_eye_of(const Eigen::Matrix3d& A, const Eigen::Vector3d& c) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d D = Eigen::Matrix3d::Identity();
  D(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Matrix3d R = svd.matrixU() * D * svd.matrixV().transpose();
  return {.q_C_B = Eigen::Quaterniond(R), .gyro_bias = R.transpose() * c};
}

CameraState first_state(const CameraProblem& problem, std::span<const ImuSample> imu,
                        std::size_t boards, const CameraConstants& guess,
                        const Eigen::Vector3d& gyro_bias) {
  CameraState state{.constants = guess, .knots = {}};
  const std::size_t first = problem.sample_of(0);
  Eigen::Quaterniond q = shortest_rotation(imu[first].accel_mps2, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> toward(boards, Eigen::Vector3d::Zero());
  auto sighting = problem.sightings().begin();
  std::size_t knot = 0;
  for (std::size_t i = first; i < imu.size() && knot < problem.knots(); ++i) {
    if (i > first) {
      const double dt = to_seconds(imu[i].stamp - imu[i - 1].stamp);
      q = q * so3_exp((imu[i].gyro_radps - gyro_bias) * dt);
      const Eigen::Vector3d up = (q * imu[i].accel_mps2).normalized();
      q = so3_exp(up.cross(Eigen::Vector3d::UnitZ()) * (dt / kLevelling_s)) * q;
      q.normalize();
    }
    for (; sighting != problem.sightings().end() && sighting->stamp <= imu[i].stamp; ++sighting) {
      if (const auto u_C = direction_of(guess.lens, sighting->uv))
        toward[sighting->board] += q * (guess.q_C_B.conjugate() * *u_C);
    }
    if (i != problem.sample_of(knot)) continue;
    state.knots.push_back({.q_W_B = q,
                           .v_W = Eigen::Vector3d::Zero(),
                           .p_W = Eigen::Vector3d::Zero(),
                           .gyro_bias = gyro_bias,
                           .accel_bias = Eigen::Vector3d::Zero()});
    ++knot;
  }
  for (const Eigen::Vector3d& direction : toward) {
    state.constants.p_W.push_back(direction.norm() > 0.0
                                      ? Eigen::Vector3d(kBoardDistance_m * direction.normalized())
                                      : Eigen::Vector3d(kBoardDistance_m, 0.0, 0.0));
  }
  return state;
}

}  // namespace crepes
