#include "tests/study/true_motion.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"
#include "estimator/core/contract.hpp"

namespace crepes::study {
namespace {

constexpr double kTruthStep = 0.01;  // s; the truth's own

}  // namespace

TrueMotion::TrueMotion(const SwarmTruth& truth, RobotId robot, double duration_s) {
  for (int i = 1; (i + 1) * kTruthStep <= duration_s; ++i) {
    const auto before = truth.pose(robot, (i - 1) * kTruthStep);
    const auto here = truth.pose(robot, i * kTruthStep);
    const auto after = truth.pose(robot, (i + 1) * kTruthStep);
    if (!before || !here || !after) break;
    const Eigen::Vector3d a_W = (after->p - 2.0 * here->p + before->p) / (kTruthStep * kTruthStep);
    samples_.push_back(
        {.v_W_B = (after->p - before->p) / (2.0 * kTruthStep),
         .w_B = so3_log(before->q.conjugate() * after->q) / (2.0 * kTruthStep),
         .f_B = here->q.conjugate() * (a_W + kNominalGravityMps2 * Eigen::Vector3d::UnitZ())});
  }
  CREPES_EXPECT(samples_.size() > 1, "a path of more than a moment");
}

MotionSample TrueMotion::at(double true_s) const {
  const auto last =
      static_cast<double>(samples_.size()) - 1.0;  // samples_[i] is at (i + 1) kTruthStep
  const double place = std::clamp(true_s / kTruthStep - 1.0, 0.0, last);
  const auto index = std::min(static_cast<std::size_t>(place), samples_.size() - 2);
  const double part = place - static_cast<double>(index);
  const MotionSample& a = samples_[index];
  const MotionSample& b = samples_[index + 1];
  const auto between = [part](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return Eigen::Vector3d(from + part * (to - from));
  };
  return {between(a.v_W_B, b.v_W_B), between(a.w_B, b.w_B), between(a.f_B, b.f_B)};
}

}  // namespace crepes::study
