#include "estimator/team/readings/reading_rows.hpp"

#include <cmath>
#include <optional>

#include "estimator/relative/range_update.hpp"

namespace crepes {
namespace {

std::optional<TeamRow> mean_of(const ReadingScene& scene, const Sight& sight) {
  const TeamPair pair = scene.pair(sight.observer, sight.neighbor);
  const TeamCamera& camera = pair.observer.cameras[sight.camera];
  const auto model = SightModel::at(pair, camera, sight.time_s(scene.interval), sight.sigma_rad());
  if (!model) return std::nullopt;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const Bearing* z : sight.bearings) {
    const auto residual = model->residual(pair, camera, z->u_B, scene.time_s(z->stamp));
    if (!residual) continue;
    sum += *residual;
    count += 1.0;
  }
  if (count == 0.0) return std::nullopt;
  TeamRow row = model->row();
  row.residual = sum / count;
  return row;
}

/// The mean range of a pair may be false although the gate accepts it. Mean and variance become
/// those of the mixture of both cases (probabilistic data association, Bar-Shalom and Tse 1975).
/// `S` is the innovation's variance, `moved` how far the range was moved since it was predicted.
/// Returns false if the range is more likely false than true.
bool associate(double S, double moved, TeamRow& row) {
  const double innovation = row.residual.x() + moved;
  const double nis = innovation * innovation / S;
  const double is_true = probability_true(innovation, S);
  const double weight = is_true * (1.0 - (1.0 - is_true) * nis);
  if (is_true < 0.5 || weight <= 0.0) return false;
  row.variance += S / weight - S;
  row.residual.x() = innovation * is_true / weight - moved;
  return true;
}

double image_of(const Eigen::VectorXd& dy, const TeamRow& row) {
  double image = 0.0;
  for (int a = 0; a < row.size; ++a)
    image += row.H(0, a) * dy(row.columns[static_cast<std::size_t>(a)]);
  return image;
}

std::optional<TeamRow> mean_of(const ReadingScene& scene, const Ranging& ranging,
                               const Eigen::VectorXd& dy) {
  const TeamPair pair = scene.pair(ranging.observer, ranging.neighbor);
  const TeamRangeBias& bias = scene.belief.ranges.at(ordered(ranging.observer, ranging.neighbor));
  const RelativeSpread spread = scene.arcs.spread(scene.belief, ranging.observer, ranging.neighbor);
  std::optional<TeamRow> mean;
  double sum_m = 0.0;
  double count = 0.0;
  for (const TeamRange* z : ranging.ranges) {
    const RangeReading weighed{z->reading.range_m, ranging.sigma_m()};
    const auto row = range_row(pair, bias, weighed, scene.time_s(z->stamp), spread);
    if (!row) continue;
    mean = *row;
    sum_m += row->residual.x();
    count += 1.0;
  }
  if (!mean) return std::nullopt;
  mean->residual.x() = sum_m / count;
  const double S = mean->covariance(scene.instant.covariance())(0, 0);
  if (!associate(S, image_of(dy, *mean), *mean)) return std::nullopt;
  return mean;
}

}  // namespace

std::vector<TeamRow> linearized(const ReadingScene& scene, const TeamReadings& readings,
                                const Eigen::VectorXd& dy) {
  std::vector<TeamRow> rows;
  rows.reserve(readings.sights.size() + readings.rangings.size());
  const auto add = [&](const std::optional<TeamRow>& row) {
    if (row) rows.push_back(*row);
  };
  for (const Sight& sight : readings.sights) add(mean_of(scene, sight));
  for (const Ranging& ranging : readings.rangings) add(mean_of(scene, ranging, dy));
  return rows;
}

}  // namespace crepes
