#include "estimator/team/belief/team_arcs.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "estimator/core/so3.hpp"
#include "estimator/relative/arc_pose.hpp"

namespace crepes {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kVelocity = 3;  // of a motion [p, v, theta]
constexpr int kTheta = 6;
// The share of a position's variance that a pivot may leave.
constexpr double kMostLeft = 0.5;
// A bend lasts as long as its attitude's error. One that lasts for ten seconds weighs as much as
// independent ones of so many times its variance in each interval.
constexpr double kLastingBend = 100.0;

bool is_open(const TeamBelief& belief, const TeamRobot& robot) {
  return robot.motion_index >= 0 &&
         belief.P.diagonal().segment<3>(robot.motion_index + kTheta).sum() >
             TeamArcs::kOpen * TeamArcs::kOpen;
}

/// The variance of where the pivot is in the robot's axes: of dp_N - dp_M + phi x (p_M - p_N).
double variance_of(const TeamBelief& belief, const TeamRobot& robot, const TeamRobot& pivot) {
  const int N = robot.motion_index;
  const int M = pivot.motion_index;
  const Matrix3d by_theta = -hat(pivot.motion.p_F - robot.motion.p_F) * robot.motion.R();
  const MatrixXd& P = belief.P;
  Matrix3d with_theta = P.block<3, 3>(N, N + kTheta);
  double variance = P.block<3, 3>(N, N).trace();
  if (M >= 0) {
    with_theta -= P.block<3, 3>(M, N + kTheta);
    variance += P.block<3, 3>(M, M).trace() - 2.0 * P.block<3, 3>(N, M).trace();
  }
  const Matrix3d of_theta = by_theta * P.block<3, 3>(N + kTheta, N + kTheta);
  return variance + 2.0 * (with_theta * by_theta.transpose()).trace() +
         (of_theta * by_theta.transpose()).trace();
}

}  // namespace

RangeCurvature RelativeSpread::curvature(const Vector3d& direction, double distance_m) const {
  const Eigen::Matrix<double, 3, 2> across = tangent_basis(direction);
  if (levers.empty())
    return curvature_of((across.transpose() * covariance * across).eval(), distance_m);
  MatrixXd form = MatrixXd::Zero(with_turns.rows(), with_turns.cols());
  form.topLeftCorner<3, 3>() = across * across.transpose() / distance_m;
  for (Index first = 3; const Vector3d& lever : levers) {
    form.block<3, 3>(first, first) = turned_twice(direction, lever);
    first += 3;
  }
  const MatrixXd product = form * with_turns;
  return {.mean_m = 0.5 * product.trace(),
          .variance_m2 = kLastingBend * 0.5 * product.cwiseProduct(product.transpose()).sum()};
}

/// An arc after a correction. The attitudes of its motions are not used.
struct TeamArcs::Moved {
  FreeMotion at;
  FreeMotion pivot;
  Matrix3d turned = Matrix3d::Identity();  ///< Exp(phi)
  Vector3d theta = Vector3d::Zero();
};

TeamArcs::TeamArcs(const TeamBelief& belief)
    : TeamArcs(belief, std::vector<bool>(static_cast<std::size_t>(belief.P.rows()), true)) {}

TeamArcs::TeamArcs(const TeamBelief& belief, const std::vector<bool>& corrected) {
  std::vector<const TeamRobot*> known;
  std::vector<const TeamRobot*> open;
  for (const auto& [id, robot] : belief.robots) {
    const bool is_corrected =
        robot.motion_index >= 0 && corrected[static_cast<std::size_t>(robot.motion_index)];
    if (is_corrected && is_open(belief, robot)) {
      open.push_back(&robot);
    } else if (is_corrected || robot.is_trusted) {
      known.push_back(&robot);
    }
  }
  while (!open.empty()) {
    std::optional<Arc> best;
    std::size_t which = 0;
    double least = 0.0;
    for (std::size_t i = 0; i < open.size(); ++i) {
      const TeamRobot& robot = *open[i];
      const double own =
          kMostLeft * belief.P.block<3, 3>(robot.motion_index, robot.motion_index).trace();
      for (const TeamRobot* pivot : known) {
        const double variance = variance_of(belief, robot, *pivot);
        if (variance > own || (best && variance >= least)) continue;
        best = {robot.motion_index, pivot->motion_index, robot.motion, pivot->motion};
        which = i;
        least = variance;
      }
    }
    if (!best) return;
    arcs_.push_back(*best);
    known.push_back(open[which]);
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(which));
  }
}

std::vector<TeamArcs::Moved> TeamArcs::moved(const VectorXd& dx) const {
  std::vector<Moved> all;
  all.reserve(arcs_.size());
  const auto moved_pivot = [&](const Arc& arc) {
    FreeMotion pivot = arc.pivot;
    if (arc.pivot_motion < 0) return pivot;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (arcs_[i].motion == arc.pivot_motion) return all[i].at;
    pivot.p_F += dx.segment<3>(arc.pivot_motion);
    pivot.v_F += dx.segment<3>(arc.pivot_motion + kVelocity);
    return pivot;
  };
  const auto along = [&](const Arc& arc, int part) -> Vector3d {
    const Vector3d own = dx.segment<3>(arc.motion + part);
    return arc.pivot_motion < 0 ? own : own - dx.segment<3>(arc.pivot_motion + part);
  };
  for (const Arc& arc : arcs_) {
    Moved moved{.at = {}, .pivot = moved_pivot(arc)};
    moved.theta = dx.segment<3>(arc.motion + kTheta);
    const Vector3d phi = arc.at.R() * moved.theta;
    moved.turned = so3_exp(phi).toRotationMatrix();
    const Vector3d p = arc.at.p_F - arc.pivot.p_F;
    const Vector3d v = arc.at.v_F - arc.pivot.v_F;
    moved.at.p_F = moved.pivot.p_F + moved.turned * (p + along(arc, 0) - phi.cross(p));
    moved.at.v_F = moved.pivot.v_F + moved.turned * (v + along(arc, kVelocity) - phi.cross(v));
    all.push_back(moved);
  }
  return all;
}

VectorXd TeamArcs::off_tangent(const VectorXd& dx) const {
  VectorXd off = VectorXd::Zero(dx.size());
  const std::vector<Moved> all = moved(dx);
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    const int motion = arcs_[i].motion;
    off.segment<3>(motion) = all[i].at.p_F - arcs_[i].at.p_F - dx.segment<3>(motion);
    off.segment<3>(motion + kVelocity) =
        all[i].at.v_F - arcs_[i].at.v_F - dx.segment<3>(motion + kVelocity);
  }
  return off;
}

/// dp_N = dp_M + phi x (p_N - p_M) + rho, and rho turns with the robot. One column an error.
void TeamArcs::carry_rows(const std::vector<Moved>& from, const std::vector<Moved>& to,
                          MatrixXd& errors) const {
  const MatrixXd before = errors;
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    const int motion = arcs_[i].motion;
    const int pivot = arcs_[i].pivot_motion;
    const Matrix3d turn = to[i].turned * from[i].turned.transpose();
    const Matrix3d reset =
        so3_right_jacobian(to[i].theta) * so3_right_jacobian_inverse(from[i].theta);
    const Matrix3d phi_before = from[i].turned * arcs_[i].at.R();
    const Matrix3d phi = to[i].turned * arcs_[i].at.R() * reset;
    const auto theta = before.middleRows<3>(motion + kTheta);
    const auto carry_part = [&](int part, const Vector3d& arm_before, const Vector3d& arm) {
      const Matrix3d by_theta = turn * hat(arm_before) * phi_before - hat(arm) * phi;
      MatrixXd rows = turn * before.middleRows<3>(motion + part) + by_theta * theta;
      if (pivot >= 0)
        rows += errors.middleRows<3>(pivot + part) - turn * before.middleRows<3>(pivot + part);
      errors.middleRows<3>(motion + part) = rows;
    };
    carry_part(0, from[i].at.p_F - from[i].pivot.p_F, to[i].at.p_F - to[i].pivot.p_F);
    carry_part(kVelocity, from[i].at.v_F - from[i].pivot.v_F, to[i].at.v_F - to[i].pivot.v_F);
    errors.middleRows<3>(motion + kTheta) = reset * theta;
  }
}

VectorXd TeamArcs::carried(const VectorXd& error, const VectorXd& from, const VectorXd& to) const {
  if (empty()) return error;
  MatrixXd carried = error;
  carry_rows(moved(from), moved(to), carried);
  return carried;
}

void TeamArcs::carry(const VectorXd& from, const VectorXd& to, MatrixXd& P) const {
  if (empty()) return;
  const std::vector<Moved> before = moved(from);
  const std::vector<Moved> after = moved(to);
  carry_rows(before, after, P);
  P.transposeInPlace();
  carry_rows(before, after, P);
  P = (0.5 * (P + P.transpose())).eval();
}

Vector3d TeamArcs::along_position(const Arc& arc) { return arc.at.p_F - arc.pivot.p_F; }

/// Along the chain of pivots.
std::vector<TeamArcs::Lever> TeamArcs::levers_of(
    int motion, const std::function<Vector3d(const Arc&)>& arm) const {
  std::vector<Lever> levers;
  for (;;) {
    const auto arc = std::ranges::find(arcs_, motion, &Arc::motion);
    if (arc == arcs_.end()) return levers;
    levers.push_back({arc->motion + kTheta, arc->at.R(), arm(*arc)});
    motion = arc->pivot_motion;
  }
}

bool TeamArcs::contains(int motion) const {
  return std::ranges::find(arcs_, motion, &Arc::motion) != arcs_.end();
}

RelativeSpread TeamArcs::spread(const TeamBelief& belief, RobotId from, RobotId to) const {
  RelativeSpread spread{.covariance = belief.position_covariance(from, to)};
  if (empty()) return spread;
  const int i = belief.robots.at(from).motion_index;
  const int j = belief.robots.at(to).motion_index;
  std::vector<Lever> levers = levers_of(j, &along_position);
  for (const Lever& lever : levers_of(i, &along_position)) {
    const auto same = std::ranges::find(levers, lever.attitude, &Lever::attitude);
    if (same == levers.end()) {
      levers.push_back({lever.attitude, lever.R, -lever.arm});
    } else {
      same->arm -= lever.arm;
    }
  }
  if (levers.empty()) return spread;
  const Index size = 3 + 3 * static_cast<Index>(levers.size());
  spread.with_turns.resize(size, size);
  spread.with_turns.topLeftCorner<3, 3>() = spread.covariance;
  for (Index k = 3; const Lever& lever : levers) {
    spread.levers.push_back(lever.arm);
    Matrix3d with_position = Matrix3d::Zero();
    if (j >= 0) with_position += belief.P.block<3, 3>(j, lever.attitude);
    if (i >= 0) with_position -= belief.P.block<3, 3>(i, lever.attitude);
    with_position = (with_position * lever.R.transpose()).eval();
    spread.with_turns.block<3, 3>(0, k) = with_position;
    spread.with_turns.block<3, 3>(k, 0) = with_position.transpose();
    for (Index l = 3; const Lever& other : levers) {
      spread.with_turns.block<3, 3>(k, l) =
          lever.R * belief.P.block<3, 3>(lever.attitude, other.attitude) * other.R.transpose();
      l += 3;
    }
    k += 3;
  }
  return spread;
}

/// phi x (phi x a) / 2 = A phi phi / 2 is a quadratic form in Gaussian errors, whose covariance
/// with another one is tr(A S B S) / 2.
Bend TeamArcs::bend_of(const TeamBelief& belief, const std::array<std::vector<Lever>, 2>& levers) {
  Bend bend;
  if (levers[0].empty()) return bend;
  const auto size = 3 * static_cast<Index>(levers[0].size());
  MatrixXd S(size, size);
  for (Index k = 0; const Lever& lever : levers[0]) {
    for (Index l = 0; const Lever& other : levers[0]) {
      S.block<3, 3>(k, l) =
          lever.R * belief.P.block<3, 3>(lever.attitude, other.attitude) * other.R.transpose();
      l += 3;
    }
    k += 3;
  }
  std::array<MatrixXd, 6> by_turns;  // A S, one an axis of p and v
  for (std::size_t axis = 0; axis < by_turns.size(); ++axis) {
    MatrixXd form = MatrixXd::Zero(size, size);
    const Vector3d u = Vector3d::Unit(static_cast<Index>(axis % 3));
    for (Index k = 0; const Lever& lever : levers.at(axis / 3)) {
      form.block<3, 3>(k, k) = turned_twice(u, lever.arm);
      k += 3;
    }
    by_turns[axis] = form * S;
  }
  for (Index a = 0; a < 6; ++a) {
    const MatrixXd& of_a = by_turns[static_cast<std::size_t>(a)];
    bend.mean(a) = 0.5 * of_a.trace();
    for (Index b = 0; b < 6; ++b) {
      const MatrixXd& of_b = by_turns[static_cast<std::size_t>(b)];
      bend.covariance(a, b) = 0.5 * of_a.cwiseProduct(of_b.transpose()).sum();
    }
  }
  return bend;
}

Bend TeamArcs::bend(const TeamBelief& belief, RobotId id) const {
  const int motion = belief.robots.at(id).motion_index;
  return bend_of(
      belief,
      {levers_of(motion, &along_position),
       levers_of(motion, [](const Arc& arc) -> Vector3d { return arc.at.v_F - arc.pivot.v_F; })});
}

}  // namespace crepes
