#include "estimator/team/unseen/range_track.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <iterator>

namespace crepes {
namespace {

/// The plane that is nearest to the centers of spheres.
struct CenterPlane {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

  explicit CenterPlane(const RangeSpheres& ranges) {
    const auto n = static_cast<double>(ranges.spheres.size());
    for (const auto& [p, radius] : ranges.spheres) center += p / n;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const auto& [p, radius] : ranges.spheres)
      spread += (p - center) * (p - center).transpose();
    normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  }
};

/// Gauss's method, damped, from `from` on.
Eigen::Vector3d trilaterated(const RangeSpheres& ranges, Eigen::Vector3d from) {
  constexpr int kIterations = 20;
  constexpr double kDamping = 1e-3;
  constexpr double kLeastDistance = 0.1;  // m
  constexpr double kFound = 1e-4;         // m
  for (int i = 0; i < kIterations; ++i) {
    Eigen::Matrix3d H = kDamping * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const auto& [center, radius] : ranges.spheres) {
      const Eigen::Vector3d d = from - center;
      const double distance = std::max(d.norm(), kLeastDistance);
      const Eigen::Vector3d u = d / distance;
      H += u * u.transpose();
      b += u * (radius - distance);
    }
    const Eigen::Vector3d step = H.ldlt().solve(b);
    from += step;
    if (step.norm() < kFound) break;
  }
  return from;
}

/// On one side of the plane of the beacons.
Eigen::Vector3d beginning_of(const RangeSpheres& first, double side) {
  const CenterPlane plane(first);
  double radius = 0.0;
  for (const auto& [p, r] : first.spheres) radius += r / static_cast<double>(first.spheres.size());
  return plane.center + side * radius * plane.normal;
}

/// Linear regressions over the times of a track.
class Lines {
 public:
  using Points = Eigen::Matrix<double, Eigen::Dynamic, 3>;

  explicit Lines(const RangeTrack& times) : design_(std::ssize(times), 2) {
    for (Eigen::Index i = 0; i < design_.rows(); ++i)
      design_.row(i) << 1.0, times[static_cast<std::size_t>(i)].t_s;
    factors_.compute(design_.transpose() * design_);
  }

  static Points points_of(const RangeTrack& track) {
    Points points(std::ssize(track), 3);
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      points.row(i) = track[static_cast<std::size_t>(i)].p.transpose();
    return points;
  }
  [[nodiscard]] Eigen::Matrix<double, 2, 3> of(const Points& points) const {
    return factors_.solve(design_.transpose() * points);
  }
  [[nodiscard]] Points rest_of(const Points& points) const { return points - design_ * of(points); }

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 2> design_;
  Eigen::LDLT<Eigen::Matrix2d> factors_;
};

}  // namespace

RangeTrack range_track(const std::vector<RangeSpheres>& all, double side) {
  RangeTrack track;
  for (const RangeSpheres& ranges : all) {
    const Eigen::Vector3d from = track.empty() ? beginning_of(ranges, side) : track.back().p;
    track.push_back({ranges.t_s, trilaterated(ranges, from)});
  }
  return track;
}

RangeTrack mirrored(RangeTrack track, const std::vector<RangeSpheres>& all) {
  for (std::size_t i = 0; i < track.size(); ++i) {
    const CenterPlane plane(all[i]);
    track[i].p -= 2.0 * plane.normal.dot(track[i].p - plane.center) * plane.normal;
  }
  return track;
}

Eigen::Quaterniond attitude_along(const RangeTrack& track, const RangeTrack& path) {
  const Lines lines(track);
  const Lines::Points bent = lines.rest_of(Lines::points_of(track));
  const Lines::Points own = lines.rest_of(Lines::points_of(path));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(bent.transpose() * own,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d handed = Eigen::Matrix3d::Identity();
  handed(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d R = svd.matrixU() * handed * svd.matrixV().transpose();
  return Eigen::Quaterniond(R).normalized();
}

FreeMotion motion_along(const RangeTrack& track, const RangeTrack& path,
                        const Eigen::Quaterniond& attitude) {
  const Eigen::Matrix3d R = attitude.toRotationMatrix();
  const Lines lines(track);
  const Eigen::Matrix<double, 2, 3> line =
      lines.of(Lines::points_of(track) - Lines::points_of(path) * R.transpose());
  return {line.row(0).transpose(), line.row(1).transpose(), attitude};
}

}  // namespace crepes
