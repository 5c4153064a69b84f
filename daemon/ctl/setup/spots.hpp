/// Runs the spot detector and the tracker on recorded pictures, for setting exposure and threshold.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {

/// Options of `crepesctl spots`.
struct SpotsOptions {
  std::filesystem::path source;  ///< a robot's folder, a folder of pictures or a picture
  std::filesystem::path config;  ///< crepesd.yaml of the robot
  std::optional<std::filesystem::path> out;  ///< for bearings.csv and drawings; if empty, none
  std::optional<std::string> camera;  ///< its name; if empty, `cam<k>` in the path selects it, or 0
  std::size_t every = 1;              ///< draw every n-th picture
  bool json = false;
  std::function<void(const std::string&)> on_text;   ///< lines for standard output
  std::function<void(const std::string&)> on_fault;  ///< pictures and rows refused, and why
  std::function<void(double)> on_progress;           ///< 0..1; optional
};

/// The smallest and the largest of the values added.
template <class T>
struct Extent {
  T min{};
  T max{};
  bool is_empty = true;

  void add(T value) {
    min = is_empty ? value : std::min(min, value);
    max = is_empty ? value : std::max(max, value);
    is_empty = false;
  }
};

/// The position of a recognized robot in a picture.
struct RobotSighting {
  RobotId id{};
  std::string name;
  Bearing bearing;
  double u_px = 0.0;
  double v_px = 0.0;
};

/// The results for one picture.
struct PictureFindings {
  std::filesystem::path file;
  Timestamp stamp{};
  Detection detection;
  std::vector<RobotSighting> robots;
};

/// How often one robot was seen.
struct RobotSummary {
  std::string name;
  std::uint64_t pictures = 0;
  double first_s = 0.0;  ///< after the first picture
};

/// What was found in all pictures.
struct SpotsSummary {
  std::uint64_t pictures = 0;
  bool is_of_spots = false;  ///< of spots.csv, which says nothing of threshold and exposure
  double slot_ms = 10.0;     ///< of the members' patterns
  std::uint64_t refused = 0;
  double duration_s = 0.0;
  bool is_automatic = true;  ///< the threshold
  Extent<int> threshold;
  Extent<int> background;
  Extent<std::size_t> spots;
  std::uint64_t all_spots = 0;
  double most_saturated = 0.0;  ///< largest share of a picture
  Rejected rejected;
  std::uint64_t good = 0, dark = 0, bright = 0;  ///< pictures by exposure
  std::uint64_t failures = 0;                    ///< of the detector
  std::map<RobotId, RobotSummary> robots;
};

/// Refuses files that are not pictures or do not have the camera's size, and continues. An error if
/// no picture can be used. Of a robot's folder the gyro guides the tracker, and spots.csv stands in
/// for pictures that were not recorded.
[[nodiscard]] Result<SpotsSummary> inspect_spots(const SpotsOptions& options);

/// What to change if the exposure is unusable; empty otherwise.
[[nodiscard]] std::string exposure_advice(const SpotsSummary& summary);

/// Why nobody may have been recognized; empty otherwise.
[[nodiscard]] std::string identity_advice(const SpotsSummary& summary);

/// One line for the drawing.
[[nodiscard]] std::string picture_caption(const PictureFindings& findings);
[[nodiscard]] std::string picture_text(const PictureFindings& findings);
[[nodiscard]] std::string picture_json(const PictureFindings& findings);
[[nodiscard]] std::string summary_text(const SpotsSummary& summary);
[[nodiscard]] std::string summary_json(const SpotsSummary& summary);

}  // namespace crepes
