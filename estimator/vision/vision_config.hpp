/// Settings: images to spots to identified bearings.
#pragma once

#include <array>
#include <cstdint>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The algorithm that finds spots.
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
  double stamp_sigma_ms = 0.5;
  double gate_px = 8.0;
  double track_timeout_ms = 150.0;
  double max_wrong_id = 5e-7;
  double max_false_robot = 1e-5;
  double flip_rate = 0.02;

  [[nodiscard]] bool operator==(const VisionConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("detector", detector, kSpotDetectors,
             "fast: our detector; hough: the paper's pipeline");
    v.field("threshold", threshold, Bounds{0, 255},
            "grey level that separates spots; 0: automatic");
    v.field("min_area_px2", min_area_px2, Bounds{0, 1000},
            "smaller spots are taken for hot pixels");
    v.field("max_area_px2", max_area_px2, Bounds{10, 4e6}, "larger spots are taken for the sun");
    v.field("max_spots", max_spots, Bounds{1, 4096},
            "maximum number of spots per frame; the brightest are kept");
    v.field("bearing_sigma_px", bearing_sigma_px, Bounds{0.01, 10},
            "least sigma of a spot's center; one that jitters has more");
    v.field("stamp_sigma_ms", stamp_sigma_ms, Bounds{0, 20},
            "stamps of pictures and of inertial samples disagree by so much, one sigma; it adds "
            "to directions as the robot turns");
    v.field("gate_px", gate_px, Bounds{1, 100},
            "a spot farther from a track's prediction does not belong to the track");
    v.field("track_timeout_ms", track_timeout_ms, Bounds{10, 5000},
            "a track that stays dark for this long ends");
    v.field("max_wrong_id", max_wrong_id, Bounds{1e-12, 0.1},
            "an ID is assigned once the probability of all others is below this");
    v.field("max_false_robot", max_false_robot, Bounds{1e-12, 0.1},
            "... and the probability that the source is not a board is below this");
    v.field("flip_rate", flip_rate, Bounds{1e-6, 0.3},
            "share of the frames that show the wrong state");
  }
};

}  // namespace crepes
