#include "estimator/team/belief/frame_change.hpp"

#include <iterator>
#include <vector>

#include "estimator/team/belief/motion_image.hpp"

namespace crepes {
namespace {

constexpr int kMotionStates = FreeMotionAt::kMotion;  // [p, v, theta]

/// How a robot's errors at the next keyframe follow from those at the last one.
struct Moved {
  int index = 0;
  MotionImage image{};
  MotionMatrix by_self{};  ///< by this robot's motion at the end
  MotionMatrix noise{};
};

/// The new root is this robot at the end of the interval. `robot` receives the new motion.
Moved moved(const FreeMotionAt& end, const FreeMotionAt& self, int self_bias, TeamRobot& robot) {
  const RootedMotion next = rooted(end.motion, self.motion, robot.clock_s);
  const MotionMatrix by_start = by_earlier(robot.motion, end.motion, end.t_s);
  robot.motion = next.motion;
  Moved moved{.index = robot.motion_index, .by_self = next.by_root};
  moved.image.parts = {{robot.motion_index, next.by_motion.lazyProduct(by_start)},
                       {robot.bias_index, next.by_motion.lazyProduct(end.by_bias)},
                       {self_bias, next.by_root.lazyProduct(self.by_bias)},
                       {robot.clock_index(), next.by_ahead}};
  const MotionMatrix turned = next.by_motion.lazyProduct(end.noise);
  moved.noise = turned.lazyProduct(next.by_motion.transpose());
  return moved;
}

/// The covariance at the next keyframe. `self_noise` is what this robot's IMU has added.
void carry(const std::vector<Moved>& all, const MotionMatrix& self_noise, Eigen::MatrixXd& P) {
  std::vector<MotionImage> images;
  images.reserve(all.size());
  for (const Moved& m : all) images.push_back(m.image);
  const Eigen::Index count = kMotionStates * std::ssize(all);
  Eigen::MatrixXd with_all(P.rows(), count);
  set_covariance_with(images, P, with_all);
  Eigen::MatrixXd own(count, count);
  set_covariance_of(images, with_all, own);
  const auto first = [](std::size_t i) { return kMotionStates * static_cast<Eigen::Index>(i); };
  for (std::size_t a = 0; a < all.size(); ++a) {
    P.middleCols<kMotionStates>(all[a].index) = with_all.middleCols<kMotionStates>(first(a));
    P.middleRows<kMotionStates>(all[a].index) =
        with_all.middleCols<kMotionStates>(first(a)).transpose();
  }
  for (std::size_t a = 0; a < all.size(); ++a) {
    const MotionMatrix of_self = all[a].by_self.lazyProduct(self_noise);
    for (std::size_t b = 0; b <= a; ++b) {
      MotionMatrix block = own.block<kMotionStates, kMotionStates>(first(a), first(b));
      block += of_self.lazyProduct(all[b].by_self.transpose());
      if (a == b) {
        block += all[a].noise;
        block = (0.5 * (block + block.transpose())).eval();
      }
      P.block<kMotionStates, kMotionStates>(all[b].index, all[a].index) = block.transpose();
      P.block<kMotionStates, kMotionStates>(all[a].index, all[b].index) = block;
    }
  }
}

}  // namespace

void change_frame(const TeamTrajectories& paths, TeamBelief& belief) {
  const FreeMotionAt& end_of_self = paths.at(belief.self).end();
  const int self_bias = belief.robots.at(belief.self).bias_index;
  std::vector<Moved> all;
  for (auto& [id, robot] : belief.robots) {
    if (robot.motion_index >= 0)
      all.push_back(moved(paths.at(id).end(), end_of_self, self_bias, robot));
  }
  carry(all, end_of_self.noise, belief.P);
}

}  // namespace crepes
