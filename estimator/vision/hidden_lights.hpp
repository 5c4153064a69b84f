/// Lights that went out of sight, and where they are expected.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/vision/id_decoder.hpp"

namespace crepes {

/// A light as it was when it was last seen.
struct HiddenLight {
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< du/dt that own rotation leaves [1/s]
  Timestamp last_seen{};
  BlinkEvidence evidence;
};

/// Where a board is, by the pose of its robot, with the phase in which it was blinking.
struct ExpectedLight {
  CodeMatch match;
  Timestamp phase_learned{};
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  double sigma_rad = 0.0;
};

/// Carries hidden lights by the gyro and their own motion, for a few seconds. A light that appears
/// where one of them is expected continues its evidence. The more uncertain the direction has
/// become and the nearer another one is expected, the likelier it is another. Where the pose of its
/// robot is known, a board is expected there instead, however long ago it was seen. Bounded; what
/// has been hidden longest is dropped first.
class HiddenLights {
 public:
  static constexpr std::size_t kCapacity = 32;
  static constexpr Duration kLongest = std::chrono::milliseconds{3000};

  struct Return {
    BlinkEvidence evidence;
    double stranger = 0.0;  ///< the probability that it is another light
    /// The one of `expected` that is here; null if its own past puts the light here.
    const ExpectedLight* by_pose = nullptr;
  };

  /// The body turned: R_now_before.
  void turn(const Eigen::Quaterniond& R_now_before);
  /// Drops what has been hidden for too long. The evidence of what is dropped here or by add() goes
  /// to `unused`.
  void drop_old(Timestamp now, std::vector<BlinkEvidence>& unused);
  void add(HiddenLight light, std::vector<BlinkEvidence>& unused);
  /// The light that `u_B` continues, of those hidden and those `expected` by poses; empty if none
  /// is expected there, or several are alike.
  [[nodiscard]] std::optional<Return> take(const Eigen::Vector3d& u_B, Timestamp now,
                                           std::span<const ExpectedLight> expected = {});

 private:
  std::vector<HiddenLight> lights_;
};

}  // namespace crepes
