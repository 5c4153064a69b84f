#include "estimator/team/belief/root_change.hpp"

#include <Eigen/SparseCore>
#include <vector>

#include "estimator/core/contract.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

/// The errors of the new states by those of the old ones.
class ErrorMap {
 public:
  explicit ErrorMap(Eigen::Index size) : size_(size) {}

  template <class Block>
  void add(int to, int from, const Eigen::MatrixBase<Block>& block) {
    for (int row = 0; row < block.rows(); ++row) {
      for (int col = 0; col < block.cols(); ++col)
        entries_.emplace_back(to + row, from + col, block(row, col));
    }
  }
  [[nodiscard]] Eigen::MatrixXd image_of(const Eigen::MatrixXd& P) const {
    Eigen::SparseMatrix<double> map(size_, size_);
    map.setFromTriplets(entries_.begin(), entries_.end());  // entries of one place add up
    const Eigen::MatrixXd half = map * P;
    const Eigen::MatrixXd all = half * map.transpose();
    return 0.5 * (all + all.transpose());
  }

 private:
  Eigen::Index size_;
  std::vector<Eigen::Triplet<double>> entries_;
};

}  // namespace

/// With R the new root, which moves with v_R and whose clock is ahead by c_R, and c that of another
/// robot, both ahead of the old root,
///   p' = R_R^T (p - p_R + (c - c_R) v_R),  v' = R_R^T (v - v_R),  R' = R_R^T R,  c' = c - c_R,
/// because a robot's motion is that at the keyframe of its own clock. As in `change_frame`,
///   dp' = R_R^T (dp - dp_R + (c - c_R) dv_R + v_R (dc - dc_R)) + [p']x dtheta_R,
///   dv' = R_R^T (dv - dv_R) + [v']x dtheta_R,  dtheta' = dtheta - R'^T dtheta_R.
/// The old root has p = v = 0, R = I and c = 0, all without an error. It receives the states that
/// the new root's motion had.
TeamBelief seen_from(RobotId id, const TeamBelief& belief) {
  const TeamRobot root = belief.robots.at(id);
  const int from = root.motion_index;
  CREPES_EXPECT(from >= 0, "the new root has no place");
  TeamBelief seen = belief;
  seen.self = id;
  ErrorMap map(belief.P.rows());
  std::vector<bool> changes(static_cast<std::size_t>(belief.P.rows()), false);
  const auto mark = [&](int index, int count) {
    for (int i = index; i < index + count; ++i) changes[static_cast<std::size_t>(i)] = true;
  };
  const Eigen::Matrix3d R_R_F = root.motion.R().transpose();
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 1, 1> one(1.0);
  for (auto& [other, robot] : seen.robots) {
    mark(robot.clock_index(), 1);
    if (other == id) continue;  // its clock is what others err from
    const bool is_old_root = other == belief.self;
    const TeamRobot before = robot;
    const double ahead_s = before.clock_s - root.clock_s;
    if (is_old_root) robot.motion_index = from;
    robot.clock_s = ahead_s;
    robot.motion.p_F = R_R_F * (before.motion.p_F - root.motion.p_F + ahead_s * root.motion.v_F);
    robot.motion.v_F = R_R_F * (before.motion.v_F - root.motion.v_F);
    robot.motion.q_F_B = (root.motion.q_F_B.conjugate() * before.motion.q_F_B).normalized();

    const int to = robot.motion_index;
    const Eigen::Vector3d by_clock = R_R_F * root.motion.v_F;
    mark(to, FreeMotionAt::kMotion);
    map.add(to, from, -R_R_F);
    map.add(to, from + 3, ahead_s * R_R_F);
    map.add(to, from + 6, hat(robot.motion.p_F));
    map.add(to, root.clock_index(), -by_clock);
    map.add(to + 3, from + 3, -R_R_F);
    map.add(to + 3, from + 6, hat(robot.motion.v_F));
    map.add(to + 6, from + 6, -robot.motion.R().transpose());
    map.add(robot.clock_index(), root.clock_index(), -one);
    if (is_old_root) continue;
    map.add(to, before.motion_index, R_R_F);
    map.add(to, before.clock_index(), by_clock);
    map.add(to + 3, before.motion_index + 3, R_R_F);
    map.add(to + 6, before.motion_index + 6, identity);
    map.add(robot.clock_index(), before.clock_index(), one);
  }
  for (int i = 0; i < belief.P.rows(); ++i)
    if (!changes[static_cast<std::size_t>(i)]) map.add(i, i, one);

  seen.P = map.image_of(belief.P);
  TeamRobot& self = seen.robots.at(id);
  self.motion = {};
  self.motion_index = -1;
  self.clock_s = 0.0;
  seen.P(self.clock_index(), self.clock_index()) = TeamBelief::kLeastVariance;
  return seen;
}

}  // namespace crepes
