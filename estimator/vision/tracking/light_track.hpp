/// One light over successive frames: its direction, its latest spot and what it blinks.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/light_direction.hpp"
#include "estimator/vision/tracking/light_sighting.hpp"

namespace crepes {

/// A light that BlinkTracker follows. Directions are in the body frame, stamps in body time.
struct LightTrack {
  LightDirection light;
  Eigen::Vector3d seen_B = Eigen::Vector3d::UnitX();   ///< where it was last, turned since
  Eigen::Vector3d steady_B = Eigen::Vector3d::Zero();  ///< its rate over some 50 ms, less noisy
  Timestamp exposed{};                                 ///< of its row in the frame at hand
  LightSighting seen;                                  ///< the latest
  Timestamp last_seen{};
  Duration unseen{};          ///< in frames since; those that were lost do not count
  bool is_ambiguous = false;  ///< since then it may have been in a spot with another
  int hits = 0;
  BlinkEvidence evidence;
  std::vector<Bearing> predicted;  ///< until its blinking is read

  /// Of a light in its first frame. `sigma_px`: least sigma of the center of a spot.
  [[nodiscard]] static LightTrack at(const LightSighting& sighting, Timestamp stamp,
                                     double sigma_px);

  /// To the next frame after `dt_s`, in which the body axes have turned.
  void predict(const Eigen::Quaterniond& R_now_before, double dt_s);
  /// To `stamp`, by its own steady motion since it was last seen.
  void extrapolate(Timestamp stamp);
  /// By the light's spot in the frame at `stamp`.
  void correct(const LightSighting& sighting, Timestamp stamp, double sigma_px);
  /// It is in the spot of another light: its direction is not measured.
  void merge(Timestamp stamp);

  /// Whether it has been seen in few frames: it may have been a flicker.
  [[nodiscard]] bool is_new() const;
  /// How far from the predicted direction its spot may be. `gate_px`: beside uncertainty and size.
  [[nodiscard]] double gate_rad(double gate_px) const;
  /// Whether what is seen after an absence is not what was: it could be either of two, or it is not
  /// where the gyro and its own motion have carried it. `longest_dark`: longer is an absence.
  [[nodiscard]] bool is_continued_by_another(const LightSighting& sighting, Timestamp stamp,
                                             Duration longest_dark) const;
};

}  // namespace crepes
