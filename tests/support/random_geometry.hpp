/// Random vectors, rotations and poses from an explicit seed.
#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <numbers>
#include <random>

#include "estimator/core/pose.hpp"

namespace crepes::test {

class RandomGeometry {
 public:
  explicit RandomGeometry(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int index(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
  double normal(double sigma = 1.0) { return sigma * normal_(engine_); }

  template <int N>
  Eigen::Matrix<double, N, 1> normal_vector(double sigma = 1.0) {
    Eigen::Matrix<double, N, 1> v;
    for (double& x : v) x = normal(sigma);
    return v;
  }
  Eigen::Vector3d vector(double sigma = 1.0) { return normal_vector<3>(sigma); }
  Eigen::Vector3d direction() { return vector().normalized(); }
  Eigen::Quaterniond rotation() {
    // One draw a statement: compilers for amd64 and arm64 evaluate operands in another order.
    const Eigen::Vector3d axis = direction();
    const double angle = uniform(0.0, std::numbers::pi);
    return so3_exp(angle * axis).normalized();
  }
  Pose pose(double sigma_m = 3.0) { return {vector(sigma_m), rotation()}; }

  /// Positive definite, with standard deviations about `sigma`.
  template <int N>
  Eigen::Matrix<double, N, N> covariance(double sigma) {
    Eigen::Matrix<double, N, N> A;
    for (double& x : A.reshaped()) x = normal(sigma);
    return A * A.transpose() / N + 0.1 * sigma * sigma * Eigen::Matrix<double, N, N>::Identity();
  }
  /// A draw from the normal distribution with this covariance.
  template <int N>
  Eigen::Matrix<double, N, 1> draw(const Eigen::Matrix<double, N, N>& covariance) {
    const Eigen::Matrix<double, N, N> L = covariance.llt().matrixL();
    return L * normal_vector<N>();
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace crepes::test
