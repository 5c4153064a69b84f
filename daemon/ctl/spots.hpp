/// What the spot detector and the tracker make of recorded pictures: for setting up exposure and
/// threshold.
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

struct SpotsOptions {
  std::filesystem::path source;              ///< a picture or a folder of pictures
  std::filesystem::path config;              ///< crepesd.yaml of the robot
  std::optional<std::filesystem::path> out;  ///< where to draw; nowhere if left out
  std::optional<std::string> camera;         ///< its name; else that of `cam<k>` in the path, or 0
  std::size_t every = 1;                     ///< draw one picture in so many
  bool json = false;
  std::function<void(const std::string&)> on_text;   ///< lines for standard output
  std::function<void(const std::string&)> on_fault;  ///< pictures that were refused, and why
  std::function<void(double)> on_progress;           ///< 0..1; optional
};

/// Least and most of something.
template <class T>
struct Span {
  T least{};
  T most{};
  bool is_empty = true;

  void add(T value) {
    least = is_empty ? value : std::min(least, value);
    most = is_empty ? value : std::max(most, value);
    is_empty = false;
  }
};

/// Where a recognized robot was seen.
struct RobotSighting {
  RobotId id{};
  std::string name;
  double u_px = 0.0;
  double v_px = 0.0;
};

/// What was found in one picture.
struct PictureFindings {
  std::filesystem::path file;
  Timestamp stamp{};
  Detection detection;
  std::vector<RobotSighting> robots;
};

struct RobotSummary {
  std::string name;
  std::uint64_t pictures = 0;
  double first_s = 0.0;  ///< after the first picture
};

struct SpotsSummary {
  std::uint64_t pictures = 0;
  std::uint64_t refused = 0;
  double duration_s = 0.0;
  bool is_automatic = true;  ///< the threshold
  Span<int> threshold;
  Span<int> background;
  Span<std::size_t> spots;
  std::uint64_t all_spots = 0;
  double most_saturated = 0.0;  ///< share of a picture
  Rejected rejected;
  std::uint64_t good = 0, dark = 0, bright = 0;  ///< pictures by exposure
  std::uint64_t failures = 0;                    ///< of the detector
  std::map<RobotId, RobotSummary> robots;
};

/// Refuses what is no picture, or not of the camera's size, and goes on. An error when there is
/// nothing to look at.
[[nodiscard]] Result<SpotsSummary> inspect_spots(const SpotsOptions& options);

/// What to change when the exposure is hopeless; empty when it is not.
[[nodiscard]] std::string exposure_advice(const SpotsSummary& summary);

/// One line for the drawing.
[[nodiscard]] std::string picture_caption(const PictureFindings& findings);
[[nodiscard]] std::string picture_text(const PictureFindings& findings);
[[nodiscard]] std::string picture_json(const PictureFindings& findings);
[[nodiscard]] std::string summary_text(const SpotsSummary& summary);
[[nodiscard]] std::string summary_json(const SpotsSummary& summary);

}  // namespace crepes
