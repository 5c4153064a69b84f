/// Settings: the filters of the neighbors.
#pragma once

#include <array>
#include <cstdint>

#include "estimator/core/settings_schema.hpp"

namespace crepes {

/// The filter of a neighbor: ours, or that of the paper (IROS 2023).
enum class Profile : std::uint8_t { kTight, kPaper };
inline constexpr std::array kProfiles{Choice{"tight", Profile::kTight},
                                      Choice{"paper", Profile::kPaper}};

/// The filters.
struct EstimatorConfig {
  Profile profile = Profile::kTight;
  double lag_ms = 100.0;
  double output_rate_hz = 50.0;
  double camera_misalignment_deg = 0.17;
  double camera_lens_mrad = 0.6;
  double gate_probability = 0.999;
  double predicted_after_s = 0.5;

  [[nodiscard]] bool operator==(const EstimatorConfig&) const = default;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("profile", profile, kProfiles,
             "tight: fuses every measurement by itself; paper: fuses raw poses");
    v.field("lag_ms", lag_ms, Bounds{5, 500},
            "the least time to wait for late measurements; the longest is 500; poses do not wait");
    v.field("output_rate_hz", output_rate_hz, Bounds{4, 200},
            "poses per second, and the most reports per second to the peers");
    v.field("camera_misalignment_deg", camera_misalignment_deg, Bounds{0, 10},
            "error of T_cam_imu's rotation, one sigma");
    v.field("camera_lens_mrad", camera_lens_mrad, Bounds{0, 20},
            "error of the directions of a lens that no rotation explains, one sigma");
    v.field("gate_probability", gate_probability, Bounds{0.9, 0.9999999},
            "measurements less likely than this are refused");
    v.field("predicted_after_s", predicted_after_s, Bounds{0.05, 60},
            "a pose without a measurement for this long is called predicted");
  }
};

}  // namespace crepes
