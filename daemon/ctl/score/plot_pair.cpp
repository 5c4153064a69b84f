#include "daemon/ctl/score/plot_pair.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/ctl/score/svg_chart.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/relative/chi_square.hpp"

namespace crepes {
namespace {

constexpr std::size_t kBuckets = 220;  // per line, to keep the page small
constexpr std::size_t kSlow = 100;     // points of a slowly changing line
constexpr std::size_t kMostPoints = 400;
constexpr std::size_t kMostPathPoints = 1000;
constexpr double kMaxLineGap = 0.3;  // s; a longer one breaks a line
constexpr std::array kAxes{"x", "y", "z"};
// Of the page's style sheet, light or dark.
constexpr std::array kAxisColors{"var(--axis-x)", "var(--axis-y)", "var(--axis-z)"};
constexpr std::string_view kErrorColor = "var(--accent)";
constexpr std::string_view kGatedColor = "var(--bad)";
constexpr std::string_view kTruthColor = "var(--soft)";
constexpr std::string_view kObserverColor = "var(--axis-y)";
constexpr std::array<std::string_view, 3> kModeColors{"var(--direct)", "var(--graph)",
                                                      "var(--predicted)"};

std::string heading(const std::string& text, const std::string& remark = {}) {
  return fmt::format("<h3>{}</h3>\n{}", text,
                     remark.empty() ? "" : fmt::format("<p>{}</p>\n", remark));
}

std::string group(const std::vector<SvgChart>& charts) {
  std::string html = "<div class='charts'>\n";
  for (const SvgChart& chart : charts) html += chart.svg() + "\n";
  return html + "</div>\n";
}

Series thinned(const Series& series, std::size_t most) {
  if (series.size() <= most) return series;
  Series thin;
  for (std::size_t i = 0; i < most; ++i) thin.push_back(series[i * series.size() / most]);
  return thin;
}

/// One of the six components of the pose's error [m, deg], and its three sigma.
SvgChart component_chart(const PairData& pair, Eigen::Index component) {
  const bool turn = component >= 3;
  const double unit = turn ? kDegPerRad : 1.0;
  Series errors;
  Series bound;
  for (const NeighborPose& pose : pair.poses) {
    const double t = pair.seconds(pose.stamp);
    bound.push_back({t, 3.0 * unit * std::sqrt(pose.T_B_N.covariance(component, component))});
    if (!pair.truth) continue;
    if (const auto truth = pair.truth(pose.stamp))
      errors.push_back({t, unit * pose_difference(pose.T_B_N.pose, *truth)(component)});
  }
  const std::string axis = kAxes.at(static_cast<std::size_t>(component % 3));
  const std::string what = turn ? "orientation " : "position ";
  SvgChart chart({.title = what + axis + (pair.truth ? " error" : " uncertainty"),
                  .x = "time [s]",
                  .y = turn ? "deg" : "m"});
  chart.set_gap(kMaxLineGap);
  chart.set_x_range(0.0, pair.duration_s);
  bound = decimated(bound, kBuckets);
  if (pair.truth) {
    Series zero = bound;
    for (ChartPoint& point : zero) point.y = 0.0;
    chart.add_band(zero, bound, kErrorColor, "3 sigma");
    chart.add_line(decimated(errors, kBuckets), kErrorColor, "truth minus estimate");
  } else {
    chart.add_line(bound, kErrorColor, "3 sigma");
  }
  // The large errors before the filter settles would hide all later values.
  std::vector<double> reach;
  for (const ChartPoint& point : bound) reach.push_back(point.y);
  for (const ChartPoint& point : errors) reach.push_back(std::abs(point.y));
  std::sort(reach.begin(), reach.end());
  if (reach.empty()) return chart;
  const double high = 1.3 * reach[(reach.size() - 1) * 97 / 100] + 1e-6;
  chart.set_y_range(pair.truth ? -high : 0.0, high);
  return chart;
}

/// Where both robots went: in the world, or with no truth the neighbor in the observer's body.
struct Paths {
  std::vector<Eigen::Vector3d> observer;
  std::vector<Eigen::Vector3d> neighbor;
  std::vector<Eigen::Vector3d> estimate;  ///< of the neighbor, from the observer's true pose
};

Paths paths_of(const PairData& pair) {
  Paths paths;
  const std::size_t stride = pair.poses.size() / kMostPathPoints + 1;
  for (std::size_t i = 0; i < pair.poses.size(); i += stride) {
    const NeighborPose& pose = pair.poses[i];
    if (!pair.truth) {
      paths.estimate.push_back(pose.T_B_N.pose.p);
      continue;
    }
    const auto T_W_B = pair.observer_truth(pose.stamp);
    const auto T_B_N = pair.truth(pose.stamp);
    if (!T_W_B || !T_B_N) continue;
    paths.observer.push_back(T_W_B->p);
    paths.neighbor.push_back(*T_W_B * T_B_N->p);
    paths.estimate.push_back(*T_W_B * pose.T_B_N.pose.p);
  }
  return paths;
}

Series projected(const std::vector<Eigen::Vector3d>& path, Eigen::Index right, Eigen::Index up) {
  Series series;
  series.reserve(path.size());
  for (const Eigen::Vector3d& p : path) series.push_back({p(right), p(up)});
  return series;
}

/// The smallest square around all points, and a little more: axes have the same scale.
void set_square(SvgChart& chart, const std::vector<Series>& all) {
  Eigen::AlignedBox2d box;
  for (const Series& series : all)
    for (const ChartPoint& point : series) box.extend(Eigen::Vector2d(point.x, point.y));
  if (box.isEmpty()) return;
  const double half = 0.54 * std::max(0.1, box.sizes().maxCoeff());
  const Eigen::Vector2d center = box.center();
  chart.set_x_range(center.x() - half, center.x() + half);
  chart.set_y_range(center.y() - half, center.y() + half);
}

/// The paths as seen along an axis; `right` and `up` are the axes that are drawn.
SvgChart path_chart(const PairData& pair, const Paths& paths, const std::string& title,
                    Eigen::Index right, Eigen::Index up) {
  const auto axis = [](Eigen::Index i) {
    return fmt::format("{} [m]", kAxes.at(static_cast<std::size_t>(i)));
  };
  // The plotting area of this size is a square.
  SvgChart chart({.title = title, .x = axis(right), .y = axis(up)}, {.width = 520, .height = 520});
  const Series observer = projected(paths.observer, right, up);
  const Series neighbor = projected(paths.neighbor, right, up);
  const Series estimate = projected(paths.estimate, right, up);
  set_square(chart, {observer, neighbor, estimate});
  chart.add_points(estimate, kErrorColor, pair.neighbor + ", estimate");
  if (pair.truth) {
    chart.add_line(observer, kObserverColor, pair.observer + ", truth");
    chart.add_line(neighbor, kTruthColor, pair.neighbor + ", truth");
  }
  return chart;
}

std::string path_charts(const PairData& pair) {
  const Paths paths = paths_of(pair);
  const std::string remark =
      pair.truth ? "In the world. The estimate is drawn from where the observer truly is."
                 : "The neighbor in the observer's body, x ahead and y left: without truth nobody "
                   "knows where the observer is.";
  return heading("Paths", remark) + group({path_chart(pair, paths, "from above", 0, 1),
                                           path_chart(pair, paths, "from the side", 0, 2)});
}

SvgChart mode_strip(const PairData& pair) {
  SvgChart chart({.title = "availability", .x = "time [s]", .y = ""},
                 {.width = 1060, .height = 96});
  chart.set_x_range(0.0, pair.duration_s);
  for (std::size_t mode = 0; mode < kModeColors.size(); ++mode) {
    std::vector<ChartPoint> spans;
    for (const NeighborPose& pose : pair.poses) {
      if (static_cast<std::size_t>(pose.mode) != mode) continue;
      constexpr double kRow = 0.02;  // s that a row covers
      const double t = pair.seconds(pose.stamp);
      if (!spans.empty() && t - spans.back().y < 1.5 * kRow) {
        spans.back().y = t + kRow;
      } else {
        spans.push_back({t, t + kRow});
      }
    }
    if (spans.empty()) continue;
    chart.add_spans(spans, kModeColors.at(mode), name_of(static_cast<PoseMode>(mode)));
  }
  return chart;
}

SvgChart age_histogram(const PairData& pair) {
  constexpr double kBin = 1.0;  // ms
  constexpr std::size_t kBins = 25;
  Series bars(kBins);
  for (std::size_t i = 0; i < kBins; ++i) bars[i].x = kBin * static_cast<double>(i);
  for (const NeighborPose& pose : pair.poses) {
    const double ms = 1e3 * to_seconds(pose.published - pose.stamp);
    const double bin = std::clamp(std::floor(ms / kBin), 0.0, kBins - 1.0);
    bars[static_cast<std::size_t>(bin)].y += 1.0;
  }
  SvgChart chart({.title = "age of the state when it leaves", .x = "age [ms]", .y = "poses"});
  chart.set_x_range(0.0, kBin * kBins);
  chart.add_bars(bars, 0.9 * kBin, kErrorColor);
  return chart;
}

/// NIS divided by its 95 % quantile: kinds of different dimension are comparable, and the bound is
/// 1.
SvgChart nis_chart(const PairData& pair, MeasurementKind kind) {
  constexpr double kHighest = 4.0;
  Series fused;
  Series gated;
  std::size_t refused = 0;
  std::size_t beyond = 0;
  for (const MeasurementRecord& record : pair.measurements) {
    const Fusion& fusion = record.fusion;
    if (record.kind != kind) continue;
    if (fusion.dimension == 0) {
      if (fusion.verdict != Verdict::kFused) ++refused;
      continue;
    }
    const double limit = chi_square_quantile(0.95, static_cast<int>(fusion.dimension));
    const ChartPoint point{pair.seconds(record.stamp), fusion.nis / limit};
    (fusion.verdict == Verdict::kFused ? fused : gated).push_back(point);
    if (fusion.verdict == Verdict::kFused && point.y > 1.0) ++beyond;
  }
  const double share =
      fused.empty() ? 0.0 : 100.0 * static_cast<double>(beyond) / static_cast<double>(fused.size());
  std::string title = fmt::format("{}: {} fused ({} % above), {} gated", name_of(kind),
                                  fused.size(), fixed(share, 1), gated.size());
  if (refused > 0) title += fmt::format(", {} not tried", refused);
  SvgChart chart({.title = title, .x = "time [s]", .y = "NIS / 95 % quantile"});
  chart.set_x_range(0.0, pair.duration_s);
  chart.set_y_range(0.0, kHighest);
  chart.add_points(thinned(fused, kMostPoints), kErrorColor, "fused");
  chart.add_points(thinned(gated, kMostPoints), kGatedColor, "gated");
  chart.add_level(1.0, "95 %");
  return chart;
}

std::string innovation_charts(const PairData& pair) {
  std::vector<SvgChart> charts;
  bool has_bearings = false;
  for (std::size_t i = 0; i < kMeasurementKindCount; ++i) {
    const auto kind = static_cast<MeasurementKind>(i);
    const bool any = std::any_of(
        pair.measurements.begin(), pair.measurements.end(),
        [kind](const MeasurementRecord& r) { return r.kind == kind && r.fusion.dimension > 0; });
    if (!any) continue;
    charts.push_back(nis_chart(pair, kind));
    has_bearings =
        has_bearings || kind == MeasurementKind::kBearing || kind == MeasurementKind::kPeerBearing;
  }
  if (charts.empty()) return {};
  std::string remark =
      "The line is the 95 % bound of the NIS: for a consistent filter 5 % of the measurements lie "
      "above it. Higher values are drawn at the upper border.";
  if (has_bearings) {
    remark +=
        " Of the bearings only about 0.1 % lie above the line: vision.bearing_sigma_px is 0.2 by "
        "default, while recordings show 0.13 px. The larger value is deliberate. With 0.13 px the "
        "filter takes the accelerometers' noise for parallax, and positions get worse.";
  }
  return heading("Innovations", remark) + group(charts);
}

/// States `first` to `first + count` of the calibration, in `unit` times their own.
struct CalibrationGroup {
  const char* title;
  const char* unit_name;
  double unit;
  std::size_t first;
  std::size_t count;
};
constexpr std::array kCalibrationGroups{
    CalibrationGroup{"gyro bias of the observer", "deg/s", kDegPerRad, CalibrationRecord::kGyroB,
                     3},
    CalibrationGroup{"accelerometer bias of the observer", "m/s²", 1.0, CalibrationRecord::kAccelB,
                     3},
    CalibrationGroup{"gyro bias of the neighbor", "deg/s", kDegPerRad, CalibrationRecord::kGyroN,
                     3},
    CalibrationGroup{"accelerometer bias of the neighbor", "m/s²", 1.0, CalibrationRecord::kAccelN,
                     3},
    CalibrationGroup{"camera misalignment of the observer", "deg", kDegPerRad,
                     CalibrationRecord::kMisalignB, 3},
    CalibrationGroup{"camera misalignment of the neighbor", "deg", kDegPerRad,
                     CalibrationRecord::kMisalignN, 3},
    CalibrationGroup{"range bias", "m", 1.0, CalibrationRecord::kRangeBias, 1}};

SvgChart calibration_chart(const PairData& pair, const CalibrationGroup& group) {
  SvgChart chart({.title = group.title, .x = "time [s]", .y = group.unit_name});
  chart.set_gap(std::max(kMaxLineGap, 3.0 * pair.duration_s / static_cast<double>(kSlow)));
  chart.set_x_range(0.0, pair.duration_s);
  for (std::size_t k = 0; k < group.count; ++k) {
    Series value;
    Series half_width;
    for (const CalibrationRecord& record : pair.calibrations) {
      const double t = pair.seconds(record.stamp);
      value.push_back({t, group.unit * record.value.at(group.first + k)});
      half_width.push_back({t, 3.0 * group.unit * record.sigma.at(group.first + k)});
    }
    value = thinned(value, kSlow);
    half_width = thinned(half_width, kSlow);
    chart.add_band(value, half_width, kAxisColors.at(k), {});
    chart.add_line(value, kAxisColors.at(k), group.count == 1 ? "estimate" : kAxes.at(k));
  }
  return chart;
}

std::string calibration_charts(const PairData& pair) {
  if (pair.calibrations.empty()) return {};
  std::vector<SvgChart> charts;
  charts.reserve(kCalibrationGroups.size());
  for (const CalibrationGroup& one : kCalibrationGroups)
    charts.push_back(calibration_chart(pair, one));
  return heading("What the filter believes of the sensors", "Bands are 3 sigma.") + group(charts);
}

double median_sigma(const PairData& pair, Eigen::Index first) {
  std::vector<double> sigmas;
  for (const NeighborPose& pose : pair.poses)
    sigmas.push_back(std::sqrt(pose.T_B_N.covariance.diagonal().segment<3>(first).sum()));
  return median_of(std::move(sigmas));
}

}  // namespace

std::vector<std::string> summary_header() {
  return {"pair",        "poses",
          "available %", "position rmse m",
          "sigma m",     "orientation rmse deg",
          "sigma deg",   "median NEES",
          "in 95 %",     "diverged"};
}

std::vector<std::string> summary_row(const PairData& pair) {
  const RelativeTruth nowhere = [](Timestamp) { return std::optional<Pose>{}; };
  ScoreWindow window;
  if (!pair.poses.empty()) window = {pair.poses.front().stamp, pair.poses.back().stamp};
  const PairScore score =
      score_pair(pair.poses, pair.truth ? pair.truth : nowhere, window.begin, window);
  return {fmt::format("{} → {}", pair.observer, pair.neighbor),
          std::to_string(score.rows),
          fixed(100.0 * score.availability, 1),
          fixed(statistics_of(score.position_errors_m).rmse, 4),
          fixed(median_sigma(pair, 0), 4),
          fixed(kDegPerRad * statistics_of(score.rotation_errors_rad).rmse, 3),
          fixed(kDegPerRad * median_sigma(pair, 3), 3),
          fixed(median_of(score.nees), 2),
          fixed(100.0 * share_within(score.nees, kNees95), 1),
          pair.truth ? std::to_string(score.divergences) : "-"};
}

std::string pair_charts(const PairData& pair) {
  if (pair.poses.empty()) return "<p>No poses.</p>\n" + innovation_charts(pair);
  std::vector<SvgChart> components;
  for (Eigen::Index i = 0; i < 3; ++i) {
    components.push_back(component_chart(pair, i));
    components.push_back(component_chart(pair, i + 3));
  }
  return group({mode_strip(pair)}) + heading(pair.truth ? "Errors" : "Uncertainty") +
         group(components) + path_charts(pair) + innovation_charts(pair) +
         calibration_charts(pair) + heading("Latency") + group({age_histogram(pair)});
}

}  // namespace crepes
