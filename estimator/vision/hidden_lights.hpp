/// Lights that went out of sight, and where they are expected.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/tracking/expected_light.hpp"

namespace crepes {

/// A light as it was when it was last seen.
struct HiddenLight {
  Eigen::Vector3d u_B = Eigen::Vector3d::UnitX();
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< du/dt that own rotation leaves [1/s]
  Timestamp last_seen{};
  BlinkEvidence evidence;
};

/// Predicts the directions of hidden lights for a few seconds, by the gyro and their own motion. A
/// light that appears in a predicted direction continues the evidence of the hidden one. The
/// probability that it is another light grows with the uncertainty of the direction and with the
/// nearness of other hidden lights. The capacity is bounded: the light that has been hidden longest
/// is dropped first. Where the pose of its robot is known, a board is expected there instead,
/// however long ago it was seen.
class HiddenLights {
 public:
  static constexpr std::size_t kCapacity = 32;
  static constexpr Duration kLongest = std::chrono::milliseconds{3000};

  /// The evidence of a light that is visible again.
  struct Return {
    /// Empty: no hidden light, but a board that was read before, by whose pose it is here.
    std::optional<BlinkEvidence> evidence;
    double stranger = 0.0;  ///< the probability that it is another light
    /// The one of `expected` that is here; null if its own past puts the light here.
    const ExpectedLight* by_pose = nullptr;
  };

  /// Expresses all directions in the axes of the body as it is now.
  void rotate_frame(const Eigen::Quaterniond& R_now_before);
  /// Drops what has been hidden for too long. The evidence of what is dropped here or by add() goes
  /// to `unused`.
  void drop_old(Timestamp now, std::vector<BlinkEvidence>& unused);
  void add(HiddenLight light, std::vector<BlinkEvidence>& unused);
  /// Removes and returns the light that `u_B` continues, of those hidden and those `expected` by
  /// poses. Empty if none is expected there, or if several are equally likely.
  [[nodiscard]] std::optional<Return> extract_match(const Eigen::Vector3d& u_B, Timestamp now,
                                                    std::span<const ExpectedLight> expected = {});

 private:
  std::vector<HiddenLight> lights_;
};

}  // namespace crepes
