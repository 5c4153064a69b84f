#include "estimator/calibration/camera/lens_conversion.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/vision/double_sphere.hpp"

namespace crepes {
namespace {

/// A radius of the normalized image, and the angle to the axis that is seen there.
struct RadialPoint {
  double radius;
  double angle_rad;
};

/// Evenly spaced radii from the center to the farthest corner, or to the end of the lens.
std::vector<RadialPoint> radial_points(const LensVector& lens, int width, int height) {
  constexpr int kPoints = 400;
  const DoubleSphere sphere(lens[0], lens[1]);
  const double x = std::max(lens[4], width - 1 - lens[4]) / lens[2];
  const double y = std::max(lens[5], height - 1 - lens[5]) / lens[3];
  const double corner = std::hypot(x, y);
  std::vector<RadialPoint> points;
  for (int i = 1; i <= kPoints; ++i) {
    const double radius = corner * i / kPoints;
    const auto u_C = sphere.unproject({radius, 0.0}, nullptr);
    if (!u_C) break;
    points.push_back({radius, std::atan2(u_C->x(), u_C->z())});
  }
  return points;
}

using Polynomial = Eigen::Matrix<double, 5, 1>;

/// t, t^3, ..., t^9
Polynomial powers_of(double angle_rad) {
  Polynomial powers;
  double power = angle_rad;
  for (double& element : powers) {
    element = power;
    power *= angle_rad * angle_rad;
  }
  return powers;
}

Polynomial fit(const std::vector<RadialPoint>& points) {
  const auto rows = static_cast<Eigen::Index>(points.size());
  Eigen::Matrix<double, Eigen::Dynamic, 5> A(rows, 5);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto& [radius, angle_rad] = points[static_cast<std::size_t>(i)];
    const double weight = std::sqrt(radius);  // a ring's area grows with its radius
    A.row(i) = weight * powers_of(angle_rad).transpose();
    b[i] = weight * radius;
  }
  return A.colPivHouseholderQr().solve(b);
}

}  // namespace

KannalaBrandtFit to_kannala_brandt(const LensVector& lens, int width, int height) {
  const std::vector<RadialPoint> points = radial_points(lens, width, height);
  const Polynomial c = fit(points);
  KannalaBrandtFit found;
  found.pinhole << lens[2] * c[0], lens[3] * c[0], lens[4], lens[5];
  for (std::size_t i = 0; i < found.k.size(); ++i)
    found.k.at(i) = c[static_cast<Eigen::Index>(i) + 1] / c[0];
  double sum = 0.0;
  double weights = 0.0;
  for (const auto& [radius, angle_rad] : points) {
    const double off = std::max(lens[2], lens[3]) * (c.dot(powers_of(angle_rad)) - radius);
    sum += radius * off * off;
    weights += radius;
    found.max_px = std::max(found.max_px, std::abs(off));
  }
  found.rms_px = std::sqrt(sum / weights);
  return found;
}

}  // namespace crepes
