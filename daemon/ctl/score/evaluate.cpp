#include "daemon/ctl/score/evaluate.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/score/swarm_score.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;
using Row = std::vector<std::string>;

/// The combined results of the pairs that have rows.
struct Overall {
  double mean_availability = 0.0;
  double mean_position_rmse_m = 0.0;
  double mean_rotation_rmse_rad = 0.0;
  double pooled_median_position_m = 0.0;
  double pooled_median_rotation_rad = 0.0;
  Duration max_age{};
  GrossErrorsByMode gross_errors;
};

constexpr std::array kModes{PoseMode::kDirect, PoseMode::kGraph, PoseMode::kPredicted};

void append(std::vector<double>& all, const std::vector<double>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

Overall overall_of(const SwarmScore& swarm) {
  Overall overall;
  std::vector<double> position_errors;
  std::vector<double> rotation_errors;
  double scored = 0.0;
  for (const ScoredPair& pair : swarm.pairs) {
    const PairScore& score = pair.score;
    overall.mean_availability += score.availability / static_cast<double>(swarm.pairs.size());
    overall.max_age = std::max(overall.max_age, score.max_age);
    merge(overall.gross_errors, score.gross_errors);
    if (score.position_errors_m.empty()) continue;
    scored += 1.0;
    overall.mean_position_rmse_m += statistics_of(score.position_errors_m).rmse;
    overall.mean_rotation_rmse_rad += statistics_of(score.rotation_errors_rad).rmse;
    append(position_errors, score.position_errors_m);
    append(rotation_errors, score.rotation_errors_rad);
  }
  overall.mean_position_rmse_m /= scored;  // NaN without any
  overall.mean_rotation_rmse_rad /= scored;
  overall.pooled_median_position_m = median_of(std::move(position_errors));
  overall.pooled_median_rotation_rad = median_of(std::move(rotation_errors));
  return overall;
}

std::string pair_name(const ScoredPair& pair) {
  return fmt::format("{} -> {}", pair.observer.name, pair.neighbor.name);
}

std::string percent(double share) { return fixed(100.0 * share, 1); }
std::string degrees(double rad, int decimals = 3) { return fixed(kDegPerRad * rad, decimals); }
std::string milliseconds(Duration d) { return fixed(1e3 * to_seconds(d), 1); }

Row pair_row(const ScoredPair& pair) {
  const PairScore& score = pair.score;
  const ErrorStatistics p = statistics_of(score.position_errors_m);
  const ErrorStatistics r = statistics_of(score.rotation_errors_rad);
  Row row{pair_name(pair),
          std::to_string(score.rows),
          percent(score.availability),
          score.first_row ? fixed(to_seconds(*score.first_row), 2) : "-",
          fixed(p.rmse, 4),
          fixed(p.mean, 4),
          fixed(p.median, 4),
          fixed(p.max, 4),
          degrees(r.rmse),
          degrees(r.median),
          degrees(r.max)};
  for (const std::size_t count : score.modes) row.push_back(std::to_string(count));
  row.push_back(fixed(median_of(score.nees), 2));
  row.push_back(percent(share_within(score.nees, kNees95)));
  row.push_back(std::to_string(score.divergences));
  row.push_back(score.rows > 0 ? milliseconds(score.max_age) : "-");
  return row;
}

void add_cells(const GrossErrors& errors, Row& row) {
  const bool any = errors.poses > 0;
  row.push_back(fixed(100.0 * errors.share(), 3));
  row.push_back(any ? fixed(to_seconds(errors.longest_run), 2) : "-");
  row.push_back(any ? fixed(errors.max_position_m, 3) : "-");
}

Row gross_error_row(std::string name, const GrossErrorsByMode& errors) {
  Row row{std::move(name)};
  add_cells(errors.all, row);
  for (const GrossErrors& mode : errors.modes) add_cells(mode, row);
  return row;
}

/// The poses further off than five sigma, by mode.
std::string gross_error_table(const SwarmScore& swarm, const Overall& all) {
  Row header{"position beyond 5 sigma", "all %", "run s", "max m"};
  for (const PoseMode mode : kModes)
    header.insert(header.end(), {fmt::format("{} %", name_of(mode)), "run s", "max m"});
  std::vector<Row> rows{std::move(header)};
  for (const ScoredPair& pair : swarm.pairs)
    rows.push_back(gross_error_row(pair_name(pair), pair.score.gross_errors));
  rows.push_back(gross_error_row("all", all.gross_errors));
  return text_table(rows);
}

std::string clock_lines(const SwarmScore& swarm) {
  double worst = 0.0;
  for (const ClockScore& clock : swarm.clocks) worst = std::max(worst, clock.max_error_s);
  if (swarm.clocks.empty()) return "";
  return fmt::format("clock offsets after 3 s: at most {} ms wrong ({} pairs)\n",
                     fixed(1e3 * worst, 3), swarm.clocks.size());
}

std::string table_of(const SwarmScore& swarm, double after_s) {
  std::vector<Row> rows{{"pair", "rows", "avail %", "first s", "pos rmse m", "mean", "median",
                         "max", "rot rmse deg", "median", "max", "direct", "graph", "predicted",
                         "nees", "in 95 %", "diverged", "age ms"}};
  for (const ScoredPair& pair : swarm.pairs) rows.push_back(pair_row(pair));
  const Overall all = overall_of(swarm);
  const std::string means = fmt::format(
      "after {} s, mean over pairs: available {} %, position rmse {} m, rotation rmse {} deg\n",
      fixed(after_s, 1), percent(all.mean_availability), fixed(all.mean_position_rmse_m, 4),
      degrees(all.mean_rotation_rmse_rad));
  const std::string medians =
      fmt::format("median over all rows: position {} m, rotation {} deg; greatest age {} ms\n",
                  fixed(all.pooled_median_position_m, 4), degrees(all.pooled_median_rotation_rad),
                  milliseconds(all.max_age));
  return fmt::format("{}\n{}\n{}{}{}", text_table(rows), gross_error_table(swarm, all), means,
                     medians, clock_lines(swarm));
}

std::string comparison_table(const SwarmScore& a, const SwarmScore& b) {
  std::vector<Row> rows{{"pair", "common rows", "avail %", "against", "pos rmse m", "against",
                         "ratio", "rot rmse deg", "against", "ratio"}};
  const auto errors = [&rows](double p_a, double p_b, double r_a, double r_b) {
    Row& row = rows.back();
    for (const std::string& cell : {fixed(p_a, 4), fixed(p_b, 4), fixed(p_a / p_b, 3), degrees(r_a),
                                    degrees(r_b), fixed(r_a / r_b, 3)})
      row.push_back(cell);
  };
  for (std::size_t i = 0; i < a.pairs.size(); ++i) {
    const PairScore& x = a.pairs[i].score;
    const PairScore& y = b.pairs[i].score;
    rows.push_back({pair_name(a.pairs[i]), std::to_string(x.rows), percent(x.availability),
                    percent(y.availability)});
    errors(statistics_of(x.position_errors_m).rmse, statistics_of(y.position_errors_m).rmse,
           statistics_of(x.rotation_errors_rad).rmse, statistics_of(y.rotation_errors_rad).rmse);
  }
  const Overall x = overall_of(a);
  const Overall y = overall_of(b);
  rows.push_back({"mean", "", percent(x.mean_availability), percent(y.mean_availability)});
  errors(x.mean_position_rmse_m, y.mean_position_rmse_m, x.mean_rotation_rmse_rad,
         y.mean_rotation_rmse_rad);
  return text_table(rows);
}

Json statistics_json(const std::vector<double>& errors, double scale) {
  const ErrorStatistics s = statistics_of(errors);
  Json json = Json::object();
  put_finite(json, "rmse", scale * s.rmse);
  put_finite(json, "mean", scale * s.mean);
  put_finite(json, "median", scale * s.median);
  put_finite(json, "max", scale * s.max);
  return json;
}

Json gross_json(const GrossErrors& errors) {
  Json json{{"poses", errors.poses}};
  if (errors.poses == 0) return json;
  json["share"] = errors.share();
  json["longest_run_s"] = to_seconds(errors.longest_run);
  json["max_position_m"] = errors.max_position_m;
  return json;
}

Json gross_json(const GrossErrorsByMode& errors) {
  Json json{{"all", gross_json(errors.all)}};
  for (const PoseMode mode : kModes)
    json[std::string(name_of(mode))] = gross_json(errors.modes.at(static_cast<std::size_t>(mode)));
  return json;
}

Json pair_json(const ScoredPair& pair) {
  const PairScore& score = pair.score;
  Json json{{"observer", pair.observer.name},
            {"neighbor", pair.neighbor.name},
            {"rows", score.rows},
            {"availability", score.availability}};
  if (score.first_row) json["first_row_s"] = to_seconds(*score.first_row);
  json["position_m"] = statistics_json(score.position_errors_m, 1.0);
  json["rotation_deg"] = statistics_json(score.rotation_errors_rad, kDegPerRad);
  for (const PoseMode mode : kModes)
    json["modes"][std::string(name_of(mode))] = score.modes.at(static_cast<std::size_t>(mode));
  put_finite(json, "median_nees", median_of(score.nees));
  put_finite(json, "share_within_95", share_within(score.nees, kNees95));
  json["divergences"] = score.divergences;
  json["bad_covariances"] = score.bad_covariances;
  json["beyond_5_sigma"] = gross_json(score.gross_errors);
  if (score.rows > 0) json["max_age_s"] = to_seconds(score.max_age);
  return json;
}

Json swarm_json(const SwarmScore& swarm) {
  Json json;
  json["pairs"] = Json::array();
  for (const ScoredPair& pair : swarm.pairs) json["pairs"].push_back(pair_json(pair));
  const Overall all = overall_of(swarm);
  Json& overall = json["overall"] = Json::object();
  put_finite(overall, "mean_availability", all.mean_availability);
  put_finite(overall, "mean_position_rmse_m", all.mean_position_rmse_m);
  put_finite(overall, "mean_rotation_rmse_deg", kDegPerRad * all.mean_rotation_rmse_rad);
  put_finite(overall, "median_position_m", all.pooled_median_position_m);
  put_finite(overall, "median_rotation_deg", kDegPerRad * all.pooled_median_rotation_rad);
  put_finite(overall, "max_age_s", to_seconds(all.max_age));
  overall["beyond_5_sigma"] = gross_json(all.gross_errors);
  json["clocks"] = Json::array();
  for (const ClockScore& clock : swarm.clocks) {
    json["clocks"].push_back({{"observer", clock.observer.value},
                              {"peer", clock.peer.value},
                              {"samples", clock.samples},
                              {"max_error_s", clock.max_error_s}});
  }
  return json;
}

}  // namespace

Result<std::string> evaluate(const EvaluateOptions& options) {
  const Result<SwarmManifest> manifest = load_manifest(options.swarm);
  if (!manifest) return tl::unexpected(manifest.error());
  if (manifest->duration_s > 0.0 && options.after_s >= manifest->duration_s) {
    return fail(ErrorCode::kConfig,
                fmt::format("--after: nothing is left after {} s: {} ends at {} s", options.after_s,
                            options.swarm.string(), manifest->duration_s));
  }
  const Result<SwarmTruth> truth = SwarmTruth::load(options.swarm, *manifest);
  if (!truth) return tl::unexpected(truth.error());
  Result<SwarmScore> score =
      score_swarm(options.results, *manifest, *truth, options.after_s, options.on_progress);
  if (!score) return tl::unexpected(score.error());
  if (options.against.empty())
    return options.json ? json_line(swarm_json(*score)) : table_of(*score, options.after_s);

  Result<SwarmScore> against =
      score_swarm(options.against, *manifest, *truth, options.after_s, options.on_progress);
  if (!against) return tl::unexpected(against.error());
  score_common_rows(*score, *against, *manifest, *truth, options.after_s);
  if (!options.json) return comparison_table(*score, *against);
  return json_line({{"results", swarm_json(*score)}, {"against", swarm_json(*against)}});
}

}  // namespace crepes
