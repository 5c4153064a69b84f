#include "daemon/ctl/demo/demo_summary.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

std::string name_of(const DemoSummary::Pair& pair) {
  return fmt::format("{}->{}", name_of_robot(pair.observer), name_of_robot(pair.neighbor));
}

std::string name_of(SimScenario scenario) {
  for (const Choice<SimScenario>& choice : kSimScenarios)
    if (choice.value == scenario) return std::string(choice.name);
  return "";
}

Json errors_json(const ErrorStatistics& errors, double scale) {
  Json json = Json::object();
  put_finite(json, "median", scale * errors.median);
  put_finite(json, "max", scale * errors.max);
  return json;
}

Json pair_json(const DemoSummary::Pair& pair) {
  Json json{{"observer", name_of_robot(pair.observer)}, {"neighbor", name_of_robot(pair.neighbor)}};
  if (pair.first_pose) json["first_pose_s"] = to_seconds(*pair.first_pose);
  json["availability"] = pair.score.availability;
  json["position_m"] = errors_json(statistics_of(pair.score.position_errors_m), 1.0);
  json["rotation_deg"] = errors_json(statistics_of(pair.score.rotation_errors_rad), kDegPerRad);
  for (const PoseMode mode : {PoseMode::kDirect, PoseMode::kGraph, PoseMode::kPredicted}) {
    json["modes"][std::string(crepes::name_of(mode))] =
        pair.score.modes.at(static_cast<std::size_t>(mode));
  }
  return json;
}

std::string formation_text(const FormationScore& formation) {
  return fmt::format(
      "formation: {} m RMS over {} s, at most {} m; a pair was hidden {} % of the time\n",
      fixed(formation.rms_m, 3), fixed(formation.to_s - formation.from_s, 0),
      fixed(formation.max_m, 3), fixed(100.0 * formation.hidden, 0));
}

Json formation_json(const FormationScore& formation) {
  return {{"from_s", formation.from_s},
          {"to_s", formation.to_s},
          {"rms_m", formation.rms_m},
          {"max_m", formation.max_m},
          {"hidden", formation.hidden}};
}

std::vector<std::string> row_of(const DemoSummary::Pair& pair) {
  const ErrorStatistics p = statistics_of(pair.score.position_errors_m);
  const ErrorStatistics r = statistics_of(pair.score.rotation_errors_rad);
  std::vector<std::string> row{name_of(pair),
                               pair.first_pose ? fixed(to_seconds(*pair.first_pose), 2) : "never",
                               fixed(100.0 * pair.score.availability, 1),
                               fixed(p.median, 3),
                               fixed(p.max, 3),
                               fixed(kDegPerRad * r.median, 2),
                               fixed(kDegPerRad * r.max, 2)};
  for (const std::size_t count : pair.score.modes) row.push_back(std::to_string(count));
  return row;
}

}  // namespace

std::string name_of_robot(RobotId id) { return fmt::format("r{}", id.value); }

std::string demo_text(const DemoSummary& summary) {
  std::vector<std::vector<std::string>> rows{{"pair", "first pose s", "avail %", "median m",
                                              "max m", "median deg", "max deg", "direct", "graph",
                                              "predicted"}};
  for (const DemoSummary::Pair& pair : summary.pairs) rows.push_back(row_of(pair));
  return fmt::format("{}availability and errors from second {} to {}\n{}", text_table(rows),
                     fixed(summary.from_s, 1), fixed(summary.to_s, 1),
                     summary.formation ? formation_text(*summary.formation) : "");
}

std::string demo_json(const DemoSummary& summary) {
  Json json{{"scenario", name_of(summary.scenario)},
            {"seed", summary.seed},
            {"from_s", summary.from_s},
            {"to_s", summary.to_s},
            {"pairs", Json::array()}};
  for (const DemoSummary::Pair& pair : summary.pairs) json["pairs"].push_back(pair_json(pair));
  if (summary.formation) json["formation"] = formation_json(*summary.formation);
  return json_line(json);
}

Result<void> check_poses(const DemoSummary& summary) {
  std::string missing;
  for (const DemoSummary::Pair& pair : summary.pairs)
    if (!pair.first_pose) missing += " " + name_of(pair);
  if (missing.empty()) return {};
  return fail(ErrorCode::kNotFound, "never a pose of:" + missing);
}

}  // namespace crepes
