#include "tests/study/team_trial.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes::study {
namespace {

void append_all(std::vector<double>& all, const std::vector<double>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// One number of a trial, and how trials are combined.
template <class Trial>
struct Column {
  const char* name;
  int decimals;
  std::function<double(const Trial&)> of;
  enum class Pool { kRootMeanSquare, kMedian, kMean, kLowest, kHighest, kSum } pool;
};

double combined(std::vector<double> x, auto pool) {
  using Pool = decltype(pool);
  std::erase_if(x, [](double value) { return !std::isfinite(value); });
  if (x.empty()) return std::nan("");
  const auto n = static_cast<double>(x.size());
  double sum = 0.0;
  double squares = 0.0;
  for (const double value : x) sum += value, squares += value * value;
  switch (pool) {
    case Pool::kRootMeanSquare:
      return std::sqrt(squares / n);
    case Pool::kMedian:
      return median_of(std::move(x));
    case Pool::kMean:
      return sum / n;
    case Pool::kLowest:
      return *std::min_element(x.begin(), x.end());
    case Pool::kHighest:
      return *std::max_element(x.begin(), x.end());
    case Pool::kSum:
      return sum;
  }
  return std::nan("");
}

template <class Trial>
std::string table(const std::vector<Column<Trial>>& columns, const std::vector<Trial>& trials) {
  using Pool = typename Column<Trial>::Pool;
  std::vector<std::vector<std::string>> rows(1 + trials.size() + 4);
  rows[0].emplace_back("swarm");
  for (std::size_t i = 0; i < trials.size(); ++i) rows[1 + i].push_back(trials[i].name);
  const auto pooled = rows.begin() + 1 + static_cast<std::ptrdiff_t>(trials.size());
  pooled[0].push_back("all " + std::to_string(trials.size()));
  pooled[1].emplace_back("lowest");
  pooled[2].emplace_back("median");
  pooled[3].emplace_back("highest");
  for (const Column<Trial>& column : columns) {
    std::vector<double> values;
    std::transform(trials.begin(), trials.end(), std::back_inserter(values), column.of);
    // Without values: a mode that did not occur, a bound that was not asked for.
    if (!std::isfinite(combined(values, column.pool))) continue;
    rows[0].emplace_back(column.name);
    for (std::size_t i = 0; i < trials.size(); ++i)
      rows[1 + i].push_back(fixed(values[i], column.decimals));
    pooled[0].push_back(fixed(combined(values, column.pool), column.decimals));
    pooled[1].push_back(fixed(combined(values, Pool::kLowest), column.decimals));
    pooled[2].push_back(fixed(combined(values, Pool::kMedian), column.decimals));
    pooled[3].push_back(fixed(combined(values, Pool::kHighest), column.decimals));
  }
  return text_table(rows);
}

/// Columns of the poses beyond five sigma. Trials are equally long, so shares are averaged.
template <class Trial>
void add_gross_columns(std::vector<Column<Trial>>& columns, TeamQuality Trial::*quality) {
  using Pool = typename Column<Trial>::Pool;
  const auto of = [quality](std::function<double(const GrossErrorsByMode&)> value) {
    return [quality, value](const Trial& t) { return value((t.*quality).gross_errors); };
  };
  const auto mode = [](PoseMode m) { return static_cast<std::size_t>(m); };
  columns.push_back(
      {">5s all %", 3, of([](const auto& g) { return 100.0 * g.all.share(); }), Pool::kMean});
  for (const auto& [name, m] : {std::pair("direct %", PoseMode::kDirect),
                                {"graph %", PoseMode::kGraph},
                                {"predicted %", PoseMode::kPredicted}}) {
    columns.push_back({name, 3,
                       of([i = mode(m)](const auto& g) { return 100.0 * g.modes[i].share(); }),
                       Pool::kMean});
  }
  columns.push_back({"run s", 2, of([](const auto& g) { return to_seconds(g.all.longest_run); }),
                     Pool::kHighest});
  columns.push_back({"direct s", 2, of([i = mode(PoseMode::kDirect)](const auto& g) {
                       return to_seconds(g.modes[i].longest_run);
                     }),
                     Pool::kHighest});
  columns.push_back(
      {"max m", 3, of([](const auto& g) { return g.all.max_position_m; }), Pool::kHighest});
  columns.push_back({"direct m", 3, of([i = mode(PoseMode::kDirect)](const auto& g) {
                       return g.modes[i].max_position_m;
                     }),
                     Pool::kHighest});
}

double position_ratio(const TeamQuality& quality, const PairBound& bound) {
  return quality.position_rmse_m / bound.position_rms_m;
}
double rotation_ratio(const TeamQuality& quality, const PairBound& bound) {
  return quality.rotation_rmse_rad / bound.rotation_rms_rad;
}

PairScores without_robot(PairScores scores, RobotId robot) {
  std::erase_if(scores, [robot](const auto& entry) {
    return entry.first.first == robot || entry.first.second == robot;
  });
  return scores;
}

/// As if it had never been there.
Swarm removed(Swarm swarm, RobotId robot) {
  const auto is_it = [robot](const auto& recording) { return recording.robot.id == robot; };
  std::erase_if(swarm.dataset.robots, is_it);
  std::erase_if(swarm.dataset.manifest.robots,
                [robot](const SwarmRobot& entry) { return entry.id == robot; });
  for (RobotRecording& recording : swarm.dataset.robots) {
    std::erase_if(recording.config.swarm.members,
                  [robot](const MemberConfig& member) { return member.id == robot; });
    std::erase_if(recording.ranges,
                  [robot](const UwbRange& range) { return range.neighbor == robot; });
  }
  return swarm;
}

/// When the honest robots name the liar, and whom else.
class NamingWatch {
 public:
  NamingWatch(const Swarm& swarm, RobotId liar) : swarm_(swarm), liar_(liar) {}

  void add(RobotId observer, const TeamRecord& record) {
    if (observer == liar_) return;
    const double t_s = recording_of(swarm_.dataset, observer).robot.clock.true_s(record.stamp);
    if (std::ranges::any_of(record.calibrations,
                            [&](const RobotCalibration& c) { return c.robot == liar_; }))
      met_s_.try_emplace(observer, t_s);
    for (const TeamFault& fault : record.faults) {
      if (fault.robot == liar_) {
        named_s_.try_emplace(observer, t_s);
      } else {
        false_names_.emplace(observer, fault.robot);
      }
    }
  }

  [[nodiscard]] Naming naming() const {
    Naming naming{.observers = swarm_.dataset.manifest.robots.size() - 1,
                  .named_by = named_s_.size(),
                  .false_names = false_names_.size()};
    for (const auto& [observer, t_s] : named_s_) {
      naming.slowest_s = std::max(naming.slowest_s, t_s);
      const auto met = met_s_.find(observer);
      const double since_s = met == met_s_.end() ? 0.0 : std::max(0.0, t_s - met->second);
      naming.slowest_since_met_s = std::max(naming.slowest_since_met_s, since_s);
    }
    return naming;
  }

 private:
  const Swarm& swarm_;
  RobotId liar_;
  std::map<RobotId, double> met_s_;
  std::map<RobotId, double> named_s_;
  std::set<OrderedPair> false_names_;
};

Swarm with_method(Swarm swarm, std::optional<TeamMethod> method) {
  for (RobotRecording& robot : swarm.dataset.robots)
    robot.config.graph.method = method.value_or(robot.config.graph.method);
  return swarm;
}

}  // namespace

TeamQuality quality_of(const PairScores& scores) {
  TeamQuality quality;
  std::vector<double> position_errors;
  std::vector<double> rotation_errors;
  std::vector<double> nees;
  for (const auto& [pair, score] : scores) {
    append_all(position_errors, score.position_errors_m);
    append_all(rotation_errors, score.rotation_errors_rad);
    append_all(nees, score.nees);
    merge(quality.gross_errors, score.gross_errors);
    quality.worst_availability = std::min(quality.worst_availability, score.availability);
    quality.divergences += score.divergences;
  }
  quality.position_rmse_m = statistics_of(std::move(position_errors)).rmse;
  quality.rotation_rmse_rad = statistics_of(std::move(rotation_errors)).rmse;
  quality.median_nees = median_of(std::move(nees));
  return quality;
}

Result<TeamTrial> run_team_trial(const Swarm& swarm, const TeamTrialOptions& options) {
  TeamTrial trial{.name = swarm.dataset.manifest.scenario,
                  .bound = pooled(team_bound(swarm, options.priors, options.after_s)),
                  .scaled_bound = {},
                  .reached = {}};
  if (options.scaled) {
    SensorPriors scaled = options.priors;
    scaled.gyro_scale = kScaledPriors.gyro_scale;
    scaled.accel_scale = kScaledPriors.accel_scale;
    trial.scaled_bound = pooled(team_bound(swarm, scaled, options.after_s));
  }
  const auto scores =
      replay_scores(with_method(swarm, options.method), options.replay, options.after_s);
  if (!scores) return tl::unexpected(scores.error());
  trial.reached = quality_of(*scores);
  return trial;
}

Result<LiarTrial> run_liar_trial(const Swarm& swarm, const Liar& liar,
                                 const TeamTrialOptions& options) {
  const RobotId robot = swarm.dataset.manifest.robots.back().id;
  const Swarm honest = with_method(swarm, options.method);
  Swarm corrupted = honest;
  corrupt(liar.lie, robot, corrupted.dataset);
  const auto without = replay_scores(honest, options.replay, options.after_s);
  if (!without) return tl::unexpected(without.error());
  NamingWatch watch(corrupted, robot);
  const auto with = replay_scores(corrupted, options.replay, options.after_s,
                                  {.on_report = corrupted_reports(liar.lie, robot),
                                   .on_team = [&](RobotId observer, const TeamRecord& record) {
                                     watch.add(observer, record);
                                   }});
  if (!with) return tl::unexpected(with.error());
  const auto alone = replay_scores(removed(honest, robot), options.replay, options.after_s);
  if (!alone) return tl::unexpected(alone.error());
  return LiarTrial{.name = swarm.dataset.manifest.scenario,
                   .without = quality_of(without_robot(*without, robot)),
                   .with = quality_of(without_robot(*with, robot)),
                   .alone = quality_of(*alone),
                   .naming = watch.naming()};
}

std::string table_of(const std::vector<TeamTrial>& trials) {
  using C = Column<TeamTrial>;
  using Pool = C::Pool;
  using T = const TeamTrial&;
  std::vector<C> columns{
      {"bound m", 4, [](T t) { return t.bound.position_rms_m; }, Pool::kRootMeanSquare},
      {"deg", 3, [](T t) { return kDegPerRad * t.bound.rotation_rms_rad; }, Pool::kRootMeanSquare},
      {"rmse m", 4, [](T t) { return t.reached.position_rmse_m; }, Pool::kRootMeanSquare},
      {"deg", 3, [](T t) { return kDegPerRad * t.reached.rotation_rmse_rad; },
       Pool::kRootMeanSquare},
      {"ratio m", 2, [](T t) { return position_ratio(t.reached, t.bound); }, Pool::kRootMeanSquare},
      {"deg", 2, [](T t) { return rotation_ratio(t.reached, t.bound); }, Pool::kRootMeanSquare},
      {"of scaled m", 2, [](T t) { return position_ratio(t.reached, t.scaled_bound); },
       Pool::kRootMeanSquare},
      {"deg", 2, [](T t) { return rotation_ratio(t.reached, t.scaled_bound); },
       Pool::kRootMeanSquare},
      {"nees", 2, [](T t) { return t.reached.median_nees; }, Pool::kMedian},
      {"avail %", 1, [](T t) { return 100.0 * t.reached.worst_availability; }, Pool::kLowest},
      {"diverged", 0, [](T t) { return static_cast<double>(t.reached.divergences); }, Pool::kSum}};
  add_gross_columns(columns, &TeamTrial::reached);
  return table(columns, trials);
}

std::string table_of(const std::vector<LiarTrial>& trials) {
  using C = Column<LiarTrial>;
  using Pool = C::Pool;
  using T = const LiarTrial&;
  std::vector<C> columns{
      {"without m", 4, [](T t) { return t.without.position_rmse_m; }, Pool::kRootMeanSquare},
      {"deg", 3, [](T t) { return kDegPerRad * t.without.rotation_rmse_rad; },
       Pool::kRootMeanSquare},
      {"with m", 4, [](T t) { return t.with.position_rmse_m; }, Pool::kRootMeanSquare},
      {"deg", 3, [](T t) { return kDegPerRad * t.with.rotation_rmse_rad; }, Pool::kRootMeanSquare},
      {"ratio m", 2, [](T t) { return t.with.position_rmse_m / t.without.position_rmse_m; },
       Pool::kRootMeanSquare},
      {"deg", 2, [](T t) { return t.with.rotation_rmse_rad / t.without.rotation_rmse_rad; },
       Pool::kRootMeanSquare},
      {"of alone m", 2, [](T t) { return t.with.position_rmse_m / t.alone.position_rmse_m; },
       Pool::kRootMeanSquare},
      {"deg", 2, [](T t) { return t.with.rotation_rmse_rad / t.alone.rotation_rmse_rad; },
       Pool::kRootMeanSquare},
      {"nees", 2, [](T t) { return t.with.median_nees; }, Pool::kMedian},
      {"avail %", 1, [](T t) { return 100.0 * t.with.worst_availability; }, Pool::kLowest}};
  add_gross_columns(columns, &LiarTrial::with);
  const auto if_named = [](T t, double value) { return t.naming.named_by > 0 ? value : NAN; };
  columns.push_back({"named %", 0,
                     [](T t) {
                       return 100.0 * static_cast<double>(t.naming.named_by) /
                              static_cast<double>(t.naming.observers);
                     },
                     Pool::kMean});
  columns.push_back(
      {"named s", 1, [=](T t) { return if_named(t, t.naming.slowest_s); }, Pool::kHighest});
  columns.push_back({"since met s", 1,
                     [=](T t) { return if_named(t, t.naming.slowest_since_met_s); },
                     Pool::kHighest});
  columns.push_back({"false names", 0,
                     [](T t) { return static_cast<double>(t.naming.false_names); }, Pool::kSum});
  return table(columns, trials);
}

}  // namespace crepes::study
