#include "daemon/ctl/score/plot_team.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "daemon/ctl/score/svg_chart.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostValues = 100;  // of a line, to keep the page small
constexpr std::array kAxisNames{"x", "y", "z"};
constexpr std::array kComponentColors{"var(--axis-x)", "var(--axis-y)", "var(--axis-z)"};

std::string section(const std::string& title, const std::string& remark,
                    const std::vector<SvgChart>& charts) {
  std::string html = fmt::format("<h3>{}</h3>\n<p>{}</p>\n<div class='charts'>\n", title, remark);
  for (const SvgChart& chart : charts) html += chart.svg() + "\n";
  return html + "</div>\n";
}

/// The mean NIS for each dimension of what one robot measured, by the second.
SvgChart residual_chart(const TeamData& team, const std::string& robot, TeamResidual::Kind kind) {
  constexpr double kBin = 1.0;  // s
  struct Bin {
    double nis = 0.0;
    double dimension = 0.0;
    int refused = 0;
    int all = 0;
  };
  std::map<int, Bin> bins;
  int fused = 0;
  int refused = 0;
  for (const TeamInnovationRow& row : team.innovations) {
    if (row.observer != robot || row.residual.kind != kind) continue;
    Bin& bin = bins[static_cast<int>(std::floor(team.seconds(row.stamp) / kBin))];
    bin.refused += row.residual.refused;
    bin.all += row.residual.refused + row.residual.fused;
    fused += row.residual.fused;
    refused += row.residual.refused;
    if (row.residual.fused == 0) continue;
    bin.nis += row.residual.nis;
    bin.dimension += row.residual.dimension;
  }
  Series nis;
  Series share;
  for (const auto& [second, bin] : bins) {
    const double middle = kBin * (second + 0.5);
    if (bin.dimension > 0.0) nis.push_back({middle, bin.nis / bin.dimension});
    if (bin.all > 0) share.push_back({middle, static_cast<double>(bin.refused) / bin.all});
  }
  SvgChart chart(
      {.title = fmt::format("{} of {}: {} fused, {} refused", name_of(kind), robot, fused, refused),
       .x = "time [s]",
       .y = "NIS a dimension"});
  chart.set_gap(2.5 * kBin);
  chart.set_x_range(0.0, team.duration_s);
  chart.add_line(nis, "var(--accent)", "mean NIS of those fused");
  chart.add_line(share, "var(--bad)", "share refused");
  chart.add_level(1.0, "honest");
  return chart;
}

struct Quantity {
  std::string title;
  const char* unit_name = "";
  double unit = 1.0;
};

/// Of those quantities that have a chart.
std::optional<Quantity> quantity_named(const std::string& name) {
  if (name == "gyro_bias") return Quantity{"gyro bias", "deg/s", kDegPerRad};
  if (name == "accel_bias") return Quantity{"accelerometer bias", "m/s²", 1.0};
  if (name == "antenna_delay") return Quantity{"antenna delay", "m", 1.0};
  if (name == "clock") return Quantity{"clock ahead of the observer's", "ms", 1e3};
  if (name.starts_with("camera"))
    return Quantity{"misalignment of camera " + name.substr(6), "deg", kDegPerRad};
  if (name.starts_with("lens"))
    return Quantity{"lens error of camera " + name.substr(4), "mrad", 1e3};
  return std::nullopt;
}

SvgChart calibration_chart(const TeamData& team, const std::string& robot, const Quantity& quantity,
                           const std::vector<const TeamCalibrationRow*>& rows) {
  SvgChart chart({.title = fmt::format("{}: {}", robot, quantity.title),
                  .x = "time [s]",
                  .y = quantity.unit_name});
  chart.set_gap(std::max(0.5, 3.0 * team.duration_s / static_cast<double>(kMostValues)));
  chart.set_x_range(0.0, team.duration_s);
  const std::size_t step = rows.size() / kMostValues + 1;
  for (std::size_t k = 0; k < static_cast<std::size_t>(rows.front()->dimension); ++k) {
    Series value;
    Series half_width;
    for (std::size_t i = 0; i < rows.size(); i += step) {
      const double t = team.seconds(rows[i]->stamp);
      value.push_back({t, quantity.unit * rows[i]->value.at(k)});
      half_width.push_back({t, 3.0 * quantity.unit * rows[i]->sigma.at(k)});
    }
    chart.add_band(value, half_width, kComponentColors.at(k), {});
    chart.add_line(value, kComponentColors.at(k),
                   rows.front()->dimension == 1 ? "estimate" : kAxisNames.at(k));
  }
  return chart;
}

std::vector<SvgChart> residual_charts(const TeamData& team) {
  std::map<std::string, std::array<bool, kTeamResidualKindCount>> measured;
  for (const TeamInnovationRow& row : team.innovations)
    measured[row.observer].at(static_cast<std::size_t>(row.residual.kind)) = true;
  std::vector<SvgChart> charts;
  for (const auto& [robot, kinds] : measured) {
    for (std::size_t kind = 0; kind < kTeamResidualKindCount; ++kind)
      if (kinds.at(kind))
        charts.push_back(residual_chart(team, robot, static_cast<TeamResidual::Kind>(kind)));
  }
  return charts;
}

std::vector<SvgChart> calibration_charts_of_team(const TeamData& team) {
  std::map<std::pair<std::string, std::string>, std::vector<const TeamCalibrationRow*>> all;
  for (const TeamCalibrationRow& row : team.calibrations)
    all[{row.robot, row.quantity}].push_back(&row);
  std::vector<SvgChart> charts;
  for (const auto& [key, rows] : all) {
    if (const auto quantity = quantity_named(key.second))
      charts.push_back(calibration_chart(team, key.first, *quantity, rows));
  }
  return charts;
}

/// Records may be missing, but existing ones must be valid.
template <class Row>
Result<std::vector<Row>> rows_if_any(Result<std::vector<Row>> rows) {
  if (!rows && rows.error().code == ErrorCode::kNotFound) return std::vector<Row>{};
  return rows;
}

}  // namespace

Result<TeamData> read_team(const fs::path& results, const std::string& observer) {
  const fs::path stem = results / observer / kTeamStem;
  auto innovations = rows_if_any(read_team_innovation_file(fs::path(stem) += ".innovations.csv"));
  if (!innovations) return tl::unexpected(innovations.error());
  auto calibrations = rows_if_any(read_team_calibration_file(fs::path(stem) += ".calibration.csv"));
  if (!calibrations) return tl::unexpected(calibrations.error());
  return TeamData{.observer = observer,
                  .innovations = std::move(*innovations),
                  .calibrations = std::move(*calibrations),
                  .seconds = {},
                  .duration_s = 0.0};
}

std::string team_charts(const TeamData& team) {
  if (team.innovations.empty() && team.calibrations.empty()) return {};
  return section("Residuals of the team",
                 "Of what each robot measured, against what the team expected: the mean of the "
                 "normalized innovations squared. Honest covariances give 1; bearings give less, "
                 "because their configured noise is larger than theirs.",
                 residual_charts(team)) +
         section("What the team believes of each robot's sensors", "Bands are 3 sigma.",
                 calibration_charts_of_team(team));
}

}  // namespace crepes
