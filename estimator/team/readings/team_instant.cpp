#include "estimator/team/readings/team_instant.hpp"

#include <iterator>

namespace crepes {
namespace {

MotionImage image_at(const TeamRobot& robot, const FreeMotionAt& at) {
  MotionImage image;
  if (robot.motion_index >= 0)
    image.parts.push_back({robot.motion_index, by_earlier(robot.motion, at.motion, at.t_s)});
  image.parts.push_back({robot.bias_index, at.by_bias});
  return image;
}

}  // namespace

InstantStates::InstantStates(const TeamBelief& belief, double time_s)
    : t_s(time_s), of_belief(static_cast<std::size_t>(belief.P.rows()), -1) {
  for (const auto& [id, robot] : belief.robots) {
    if (robot.motion_index < 0) self_motion = size;
    for (int i = 0; i < FreeMotionAt::kMotion; ++i, ++size) {
      const int state = robot.motion_index + i;
      if (robot.motion_index >= 0) of_belief[static_cast<std::size_t>(state)] = size;
    }
  }
  const auto add = [this](int state, int count) {
    for (int i = state; i < state + count; ++i) {
      of_belief[static_cast<std::size_t>(i)] = size++;
      constants.push_back(i);
    }
  };
  for (const auto& [id, robot] : belief.robots) {
    add(robot.delay_index(), 1);
    add(robot.clock_index(), 1);
    for (const TeamCamera& camera : robot.cameras) add(camera.index, TeamCamera::kStates);
  }
  for (const auto& [pair, range] : belief.ranges) add(range.index, 1);
}

TeamInstant::TeamInstant(const TeamBelief& belief, const TeamTrajectories& paths, double t_s)
    : states_(belief, t_s) {
  motions_.reserve(belief.robots.size());
  for (const auto& [id, robot] : belief.robots)
    motions_.push_back(image_at(robot, paths.at(id).nearest(t_s)));
  const Eigen::Index count = states_.size - std::ssize(states_.constants);
  with_belief_.resize(belief.P.rows(), states_.size);
  auto with_motions = with_belief_.leftCols(count);
  set_covariance_with(motions_, belief.P, with_motions);
  with_belief_.rightCols(states_.size - count) = belief.P(Eigen::all, states_.constants);
  covariance_.resize(states_.size, states_.size);
  set_covariance_of(motions_, with_motions, covariance_.topLeftCorner(count, count));
  covariance_.bottomRows(states_.size - count) = with_belief_(states_.constants, Eigen::all);
  covariance_.topRightCorner(count, states_.size - count) =
      covariance_.bottomLeftCorner(states_.size - count, count).transpose();
}

Eigen::VectorXd TeamInstant::image_of(const Eigen::VectorXd& dx) const {
  Eigen::VectorXd dy = Eigen::VectorXd::Zero(states_.size);
  for (Eigen::Index first = 0; const MotionImage& motion : motions_) {
    auto of_motion = dy.segment<FreeMotionAt::kMotion>(first);
    for (const MotionImage::Part& part : motion.parts)
      of_motion += part.by * dx.segment(part.from, part.by.cols());
    first += FreeMotionAt::kMotion;
  }
  dy.tail(std::ssize(states_.constants)) = dx(states_.constants);
  return dy;
}

}  // namespace crepes
