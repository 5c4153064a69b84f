#include "estimator/team/belief/root_change.hpp"

#include <Eigen/SparseCore>
#include <vector>

#include "estimator/core/contract.hpp"

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

/// A robot's motion is that at the keyframe of its own clock, and c' = c - c_R are the clocks ahead
/// of the new root's. The old root has p = v = 0, R = I and c = 0, all without an error. It
/// receives the states that the new root's motion had.
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
  const Eigen::Matrix<double, 1, 1> one(1.0);
  for (auto& [other, robot] : seen.robots) {
    mark(robot.clock_index(), 1);
    if (other == id) continue;  // its clock is what others err from
    const bool is_old_root = other == belief.self;
    const int before = robot.motion_index;
    const int to = is_old_root ? from : before;
    robot.motion_index = to;
    robot.clock_s -= root.clock_s;
    const RootedMotion next = rooted(robot.motion, root.motion, robot.clock_s);
    robot.motion = next.motion;
    mark(to, FreeMotionAt::kMotion);
    map.add(to, from, next.by_root);
    map.add(to, root.clock_index(), -next.by_ahead);
    map.add(robot.clock_index(), root.clock_index(), -one);
    if (is_old_root) continue;
    map.add(to, before, next.by_motion);
    map.add(to, robot.clock_index(), next.by_ahead);
    map.add(robot.clock_index(), robot.clock_index(), one);
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
