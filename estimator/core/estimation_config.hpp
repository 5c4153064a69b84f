/// Settings: what is made of the measurements.
#pragma once

#include <array>
#include <cstdint>

#include "estimator/core/config_schema.hpp"

namespace crepes {

enum class SpotDetectorKind : std::uint8_t { kFast, kHough };
inline constexpr std::array kSpotDetectors{Choice{"fast", SpotDetectorKind::kFast},
                                           Choice{"hough", SpotDetectorKind::kHough}};

/// Images to spots to identified bearings.
struct VisionConfig {
  SpotDetectorKind detector = SpotDetectorKind::kFast;
  int threshold = 0;
  double min_area_px2 = 1.5;
  double max_area_px2 = 20000.0;
  int max_spots = 256;
  double bearing_sigma_px = 0.2;
  double gate_px = 8.0;
  double track_timeout_ms = 150.0;
  double max_wrong_id = 5e-7;
  double max_false_robot = 1e-5;
  double flip_rate = 0.02;

  [[nodiscard]] bool operator==(const VisionConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("detector", detector, kSpotDetectors, "fast: ours; hough: the paper's pipeline");
    v.field("threshold", threshold, Bounds{0, 255},
            "grey level that separates spots; 0: automatic");
    v.field("min_area_px2", min_area_px2, Bounds{0, 1000}, "smaller spots are hot pixels");
    v.field("max_area_px2", max_area_px2, Bounds{10, 4e6}, "larger spots are the sun");
    v.field("max_spots", max_spots, Bounds{1, 4096},
            "the brightest so many spots a frame are kept");
    v.field("bearing_sigma_px", bearing_sigma_px, Bounds{0.01, 10}, "one sigma of a spot's center");
    v.field("gate_px", gate_px, Bounds{1, 100},
            "a spot this far from a track's prediction is another's");
    v.field("track_timeout_ms", track_timeout_ms, Bounds{10, 5000}, "a track dark for longer ends");
    v.field("max_wrong_id", max_wrong_id, Bounds{1e-12, 0.1},
            "an ID is given once the probability of all others is below this");
    v.field("max_false_robot", max_false_robot, Bounds{1e-12, 0.1},
            "... and the probability that the source is no board, below this");
    v.field("flip_rate", flip_rate, Bounds{1e-6, 0.3},
            "part of the frames that show the wrong state");
  }
};

enum class Profile : std::uint8_t { kTight, kPaper };
inline constexpr std::array kProfiles{Choice{"tight", Profile::kTight},
                                      Choice{"paper", Profile::kPaper}};

/// The filters.
struct EstimatorConfig {
  Profile profile = Profile::kTight;
  double lag_ms = 100.0;
  double output_rate_hz = 50.0;
  double camera_misalignment_deg = 0.17;
  double gate_probability = 0.999;
  double predicted_after_s = 0.5;
  double forget_after_s = 30.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("profile", profile, kProfiles, "tight: every measurement by itself; paper: raw poses");
    v.field("lag_ms", lag_ms, Bounds{5, 1000}, "how long late data are waited for; poses are not");
    v.field("output_rate_hz", output_rate_hz, Bounds{1, 200}, "poses a second");
    v.field("camera_misalignment_deg", camera_misalignment_deg, Bounds{0, 10},
            "error of T_cam_imu's rotation, one sigma");
    v.field("gate_probability", gate_probability, Bounds{0.9, 0.9999999},
            "measurements less likely than this are refused");
    v.field("predicted_after_s", predicted_after_s, Bounds{0.05, 60},
            "a pose without a measurement for longer is called predicted");
    v.field("forget_after_s", forget_after_s, Bounds{1, 3600}, "a silent neighbor is forgotten");
  }
};

enum class GraphCost : std::uint8_t { kLie, kPaper };
inline constexpr std::array kGraphCosts{Choice{"lie", GraphCost::kLie},
                                        Choice{"paper", GraphCost::kPaper}};

/// The pose graph over the whole team.
struct GraphConfig {
  bool enabled = true;
  double rate_hz = 10.0;
  GraphCost cost = GraphCost::kLie;
  double kernel_scale = 3.0;
  int max_iterations = 20;

  template <class Visitor>
  void visit(Visitor& v) {
    v.field("enabled", enabled, "solve the pose graph");
    v.field("rate_hz", rate_hz, Bounds{0.1, 100}, "solutions a second");
    v.choice("cost", cost, kGraphCosts, "lie: weighted by covariance; paper: ||T X^-1 X - I||_F^2");
    v.field("kernel_scale", kernel_scale, Bounds{0.1, 100},
            "residual norm [sigmas] from which the robust kernel bends");
    v.field("max_iterations", max_iterations, Bounds{1, 1000}, "bound of one solution");
  }
};

}  // namespace crepes
