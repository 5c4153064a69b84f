#include "estimator/team/belief/sight_places.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kMostPosition = 0.5;           // m; sigma along any axis
constexpr double kMostAttitude = radians(8.0);  // rad; sigma about any axis
constexpr double kSpeed = 1.0;                  // m/s; from a bearing to the end of the interval
constexpr double kMostChi2 = 10.0;              // for each dimension that is left over
constexpr double kNearest = 0.1;                // m

/// A bearing of `observer`, turned with its body to the end of the interval.
struct Ray {
  RobotId observer{};
  RobotId neighbor{};
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();
  double sigma_rad = 0.0;
  double moved_m = 0.0;  ///< until then, one sigma
};

using Pair = std::pair<RobotId, RobotId>;

/// What the body turns from then on, by its gyroscope.
Eigen::Quaterniond turn_until_end(const TeamInterval& interval, const TeamMember& member,
                                  Timestamp stamp) {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Timestamp begin = interval.from;
  for (const ImuMean& mean : member.imu) {
    const Timestamp end = std::min(begin + TeamInterval::kStep, interval.to);
    if (end > stamp)
      turn = turn * so3_exp(to_seconds(end - std::max(begin, stamp)) * mean.gyro_radps);
    begin = end;
  }
  return turn;
}

/// The latest bearing of each pair. None of a pair whose latest ones differ: a robot and its mirror
/// image.
std::map<Pair, Ray> rays_of(const TeamInterval& interval) {
  std::map<Pair, std::pair<const Bearing*, bool>> latest;
  for (const TeamBearing& reading : interval.bearings) {
    const Bearing& z = reading.bearing;
    if (!interval.contains(z.stamp)) continue;
    auto& [best, is_ambiguous] = latest[{reading.observer, z.neighbor}];
    if (best == nullptr || z.stamp > best->stamp) {
      best = &z;
      is_ambiguous = false;
    } else if (z.stamp == best->stamp) {
      is_ambiguous = true;
    }
  }
  std::map<Pair, Ray> rays;
  for (const auto& [pair, found] : latest) {
    const auto& [z, is_ambiguous] = found;
    const TeamMember* member = interval.member(pair.first);
    if (is_ambiguous || member == nullptr) continue;
    const double sigma = std::hypot(z->sigma_rad, interval.settings.priors.misalignment_rad);
    rays[pair] = {.observer = pair.first,
                  .neighbor = pair.second,
                  .u_B = turn_until_end(interval, *member, z->stamp).conjugate() * z->u_B,
                  .p_B_C = z->p_B_C,
                  .sigma_rad = sigma,
                  .moved_m = kSpeed * to_seconds(interval.to - z->stamp)};
  }
  return rays;
}

struct Position {
  Eigen::Vector3d p_F = Eigen::Vector3d::Zero();  ///< of the LEDs
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Where the rays of these trusted robots meet.
std::optional<Position> meeting_point(const std::vector<Ray>& rays, const TeamBelief& belief) {
  constexpr int kPasses = 3;  // the first does not know the distances
  Position found;
  double chi2 = 0.0;
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double square = 0.0;
    for (const Ray& ray : rays) {
      const GaussianPose from = belief.pose(ray.observer);
      const Eigen::Vector3d origin = from.pose.p + from.pose.q * ray.p_B_C;
      const Eigen::Vector3d d = from.pose.q * ray.u_B;
      const double distance = pass == 0 ? 1.0 : (found.p_F - origin).dot(d);
      if (distance < kNearest) return std::nullopt;
      const double turned2 = from.covariance.bottomRightCorner<3, 3>().trace() / 3.0;
      const double variance = distance * distance * (ray.sigma_rad * ray.sigma_rad + turned2) +
                              from.covariance.topLeftCorner<3, 3>().trace() / 3.0 +
                              ray.moved_m * ray.moved_m;
      const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - d * d.transpose()) / variance;
      A += across;
      b += across * origin;
      square += origin.dot(across * origin);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> information(A);
    if (!(information.eigenvalues()(0) * kMostPosition * kMostPosition > 1.0)) return std::nullopt;
    found.p_F = A.ldlt().solve(b);
    found.covariance = A.inverse();
    chi2 = square - found.p_F.dot(b);
  }
  const double left_over = 2.0 * static_cast<double>(rays.size()) - 3.0;
  return chi2 < kMostChi2 * left_over ? std::optional(found) : std::nullopt;
}

struct Attitude {
  Eigen::Quaterniond q_F_B = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< body axes
};

/// How a robot with its LEDs at this place is turned that sees these trusted ones. Where its
/// cameras are from its LEDs follows from that, so it counts as an error of the place.
std::optional<Attitude> attitude_by(const std::vector<Ray>& rays, const Position& at,
                                    const Eigen::Vector3d& p_B_led, const TeamInterval& interval,
                                    const TeamBelief& belief) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  std::vector<std::pair<Eigen::Vector3d, double>> goals;
  for (const Ray& ray : rays) {
    const GaussianPose to = belief.pose(ray.neighbor);
    const Eigen::Vector3d d =
        to.pose.p + to.pose.q * interval.member(ray.neighbor)->p_body_led - at.p_F;
    const double distance = d.norm();
    if (distance < kNearest) return std::nullopt;
    const double moved2 = (to.covariance.topLeftCorner<3, 3>() + at.covariance).trace() / 3.0 +
                          (ray.p_B_C - p_B_led).squaredNorm() + ray.moved_m * ray.moved_m;
    const double variance = ray.sigma_rad * ray.sigma_rad + moved2 / (distance * distance);
    B += d / distance * ray.u_B.transpose() / variance;
    information += (Eigen::Matrix3d::Identity() - ray.u_B * ray.u_B.transpose()) / variance;
    goals.emplace_back(d / distance, variance);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(information);
  if (!(axes.eigenvalues()(0) * kMostAttitude * kMostAttitude > 1.0)) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Matrix3d R =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  double chi2 = 0.0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    chi2 += (R * rays[i].u_B - goals[i].first).squaredNorm() / goals[i].second;
  const double left_over = 2.0 * static_cast<double>(rays.size()) - 3.0;
  if (!(chi2 < kMostChi2 * left_over)) return std::nullopt;
  return Attitude{Eigen::Quaterniond(R), information.inverse()};
}

}  // namespace

std::map<RobotId, TeamPlace> places_by_sight(const TeamInterval& interval,
                                             const TeamBelief& belief) {
  std::set<RobotId> open;
  for (const TeamMember& member : interval.members)
    if (!belief.robots.contains(member.robot)) open.insert(member.robot);
  for (const RelativePoseEdge& edge : interval.edges) {
    if (belief.robots.contains(edge.from)) open.erase(edge.to);
    if (belief.robots.contains(edge.to)) open.erase(edge.from);
  }
  std::map<RobotId, TeamPlace> places;
  if (open.empty()) return places;
  const auto is_trusted = [&](RobotId id) {
    const auto robot = belief.robots.find(id);
    return robot != belief.robots.end() && robot->second.is_trusted;
  };
  const std::map<Pair, Ray> rays = rays_of(interval);
  for (const RobotId id : open) {
    std::vector<Ray> of_it;
    std::vector<Ray> by_it;
    for (const auto& [pair, ray] : rays) {
      if (pair.second == id && is_trusted(pair.first)) of_it.push_back(ray);
      if (pair.first == id && is_trusted(pair.second)) by_it.push_back(ray);
    }
    if (of_it.size() < 2 || by_it.size() < 2) continue;
    const auto leds = meeting_point(of_it, belief);
    if (!leds) continue;
    const Eigen::Vector3d& p_B_led = interval.member(id)->p_body_led;
    const auto attitude = attitude_by(by_it, *leds, p_B_led, interval, belief);
    if (!attitude) continue;
    TeamPlace place{.T_S_N = {leds->p_F - attitude->q_F_B * p_B_led, attitude->q_F_B},
                    .last_sighting = interval.to};
    const double speed = interval.settings.priors.speed_mps;
    place.covariance.topLeftCorner<3, 3>() = leds->covariance;
    place.covariance.diagonal().segment<3>(3).setConstant(speed * speed);
    place.covariance.bottomRightCorner<3, 3>() = attitude->covariance;
    places.emplace(id, place);
  }
  return places;
}

}  // namespace crepes
