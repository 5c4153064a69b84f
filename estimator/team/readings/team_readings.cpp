#include "estimator/team/readings/team_readings.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "estimator/relative/range_update.hpp"
#include "estimator/team/unseen/team_darkness.hpp"

namespace crepes {
namespace {

// What hides a robot from all cameras may delay its ranges, too, for seconds: an error of 0.15 m
// that lasts 2 s weighs as much as independent ones of this size in each interval.
constexpr double kDarkSigma = 1.0;  // m
// Likewise what ranges that may have passed through something have in common.
constexpr double kLasting = 6.0;

// NIS by which the likeliest of a robot and its mirror images is told from the next: odds of 90.
constexpr double kClearNis = 9.0;

bool takes_part(const TeamBelief& belief, RobotId observer, RobotId neighbor,
                TeamReadings::Stage stage) {
  const auto i = belief.robots.find(observer);
  const auto j = belief.robots.find(neighbor);
  if (i == belief.robots.end() || j == belief.robots.end()) return false;
  return stage == TeamReadings::Stage::kTrusted ? i->second.is_trusted && j->second.is_trusted
                                                : i->second.is_trusted != j->second.is_trusted;
}

/// Those of cameras and pairs that this accepts.
template <class Accepts>
std::vector<Sight> sights_of(const TeamInterval& interval, const TeamBelief& belief,
                             const Accepts& accepts) {
  std::map<std::tuple<RobotId, RobotId, std::size_t>, Sight> sights;
  for (const TeamBearing& reading : interval.bearings) {
    const Bearing& z = reading.bearing;
    const auto observer = belief.robots.find(reading.observer);
    if (!interval.contains(z.stamp) || observer == belief.robots.end() ||
        !belief.robots.contains(z.neighbor))
      continue;
    const auto& cameras = observer->second.cameras;
    const auto camera = std::ranges::find(cameras, z.p_B_C, &TeamCamera::p_B_C);
    if (camera == cameras.end() || !accepts(reading.observer, z.neighbor, *camera)) continue;
    const auto index = static_cast<std::size_t>(camera - cameras.begin());
    const std::tuple key(reading.observer, z.neighbor, index);
    sights.try_emplace(key, Sight{reading.observer, z.neighbor, index})
        .first->second.bearings.push_back(&z);
  }
  std::vector<Sight> all;
  all.reserve(sights.size());
  for (auto& [key, sight] : sights) all.push_back(std::move(sight));
  return all;
}

std::vector<Ranging> rangings_of(const TeamInterval& interval, const TeamBelief& belief,
                                 TeamReadings::Stage stage) {
  const TeamDarkness darkness(interval, belief);
  std::map<std::pair<RobotId, RobotId>, Ranging> rangings;
  for (const TeamRange& reading : interval.ranges) {
    const auto [observer, neighbor] = std::pair(reading.observer, reading.neighbor);
    if (!interval.contains(reading.stamp) || !takes_part(belief, observer, neighbor, stage) ||
        !darkness.allows(reading))
      continue;
    rangings
        .try_emplace({observer, neighbor}, Ranging{observer, neighbor, darkness.dark_of(reading)})
        .first->second.ranges.push_back(&reading);
  }
  std::vector<Ranging> all;
  all.reserve(rangings.size());
  for (auto& [key, ranging] : rangings) all.push_back(std::move(ranging));
  return all;
}

/// Mean residual of readings, of those that were fused if any was.
class MeanResidual {
 public:
  void add(const Eigen::Vector2d& residual, bool fits) {
    (fits ? fused_ : refused_) += residual;
    ++(fits ? residual_.fused : residual_.refused);
  }
  [[nodiscard]] int count() const {
    return residual_.fused > 0 ? residual_.fused : residual_.refused;
  }
  /// `S` is the covariance of the mean of `count`.
  [[nodiscard]] TeamResidual of(TeamResidual what, const Eigen::Matrix2d& S, int dimension) const {
    what.fused = residual_.fused;
    what.refused = residual_.refused;
    if (count() == 0) return what;
    const Eigen::Vector2d mean = (residual_.fused > 0 ? fused_ : refused_) / count();
    what.dimension = dimension;
    what.nis = dimension == 2 ? mean.dot(S.llt().solve(mean)) : mean.x() * mean.x() / S(0, 0);
    for (int i = 0; i < dimension; ++i) {
      what.residual.at(static_cast<std::size_t>(i)) = mean(i);
      what.sigma.at(static_cast<std::size_t>(i)) = std::sqrt(S(i, i));
    }
    return what;
  }

 private:
  Eigen::Vector2d fused_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d refused_ = Eigen::Vector2d::Zero();
  TeamResidual residual_;
};

/// Of a robot or its image in a mirror.
struct Candidate {
  const Bearing* bearing = nullptr;
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  double nis = std::numeric_limits<double>::infinity();
};

/// Of bearings with one stamp.
struct Likeliest {
  Candidate best{};
  bool is_clear = true;  ///< no other is nearly as likely

  void add(const Candidate& next) {
    const bool is_first = best.bearing == nullptr;
    is_clear = is_first || (is_clear && next.nis - best.nis > kClearNis) ||
               best.nis - next.nis > kClearNis;
    if (is_first || next.nis < best.nis) best = next;
  }
};

/// Of a robot and its mirror images in one frame, the likeliest remains; none if that is not clear.
TeamResidual gate(const ReadingScene& scene, TeamCamera& camera, Sight& sight) {
  TeamResidual found{.observer = sight.observer,
                     .neighbor = sight.neighbor,
                     .kind = TeamResidual::Kind::kBearing,
                     .camera = static_cast<int>(sight.camera)};
  const TeamPair pair = scene.pair(sight.observer, sight.neighbor);
  const auto model = SightModel::at(pair, camera, sight.time_s(scene.interval), sight.sigma_rad());
  if (!model) {
    sight.bearings.clear();
    return found;
  }
  const Eigen::Matrix2d S = model->row().covariance(scene.instant.covariance());
  const Eigen::LLT<Eigen::Matrix2d> factors(S);
  std::map<Timestamp, Likeliest> frames;
  for (const Bearing* z : sight.bearings) {
    Candidate candidate{.bearing = z};
    if (const auto r = model->residual(pair, camera, z->u_B, scene.time_s(z->stamp)))
      candidate = {z, *r, r->dot(factors.solve(*r))};
    frames[z->stamp].add(candidate);
  }
  sight.bearings.clear();
  MeanResidual mean;
  for (const auto& [stamp, frame] : frames) {
    const bool fits = frame.best.nis <= scene.interval.settings.bearing_gate;
    if (frame.is_clear || !fits) camera.agreement[sight.neighbor].add(fits);
    if (std::isfinite(frame.best.nis)) mean.add(frame.best.residual, fits && frame.is_clear);
    if (fits && frame.is_clear) sight.bearings.push_back(frame.best.bearing);
  }
  return mean.of(found, S, 2);
}

TeamResidual gate(const ReadingScene& scene, TeamRangeBias& bias, Ranging& ranging) {
  const TeamPair pair = scene.pair(ranging.observer, ranging.neighbor);
  const RelativeSpread spread = scene.arcs.spread(scene.belief, ranging.observer, ranging.neighbor);
  MeanResidual mean;
  double noise = 0.0;
  double variance = 0.0;
  std::erase_if(ranging.ranges, [&](const TeamRange* z) {
    const auto row = range_row(pair, bias, z->reading, scene.time_s(z->stamp), spread);
    if (!row) return true;
    const double residual = row->residual.x();
    variance = row->covariance(scene.instant.covariance())(0, 0);
    noise = z->reading.sigma_m * z->reading.sigma_m;
    const bool fits = is_range_accepted(residual, variance, scene.interval.settings.range_gate);
    if (!ranging.dark) bias.add(ranging.observer, fits, residual);
    mean.add({residual, 0.0}, fits);
    return !fits;
  });
  // The readings' noise is independent, and the mean has less.
  const double of_mean = variance - noise + noise / std::max(1, mean.count());
  return mean.of({.observer = ranging.observer,
                  .neighbor = ranging.neighbor,
                  .kind = TeamResidual::Kind::kRange},
                 of_mean * Eigen::Matrix2d::Identity(), 1);
}

}  // namespace

double Sight::time_s(const TeamInterval& interval) const {
  double sum_s = 0.0;
  for (const Bearing* z : bearings) sum_s += to_seconds(z->stamp - interval.from);
  return sum_s / static_cast<double>(bearings.size());
}

double Sight::sigma_rad() const {
  double variance = 0.0;
  for (const Bearing* z : bearings) variance += z->sigma_rad * z->sigma_rad;
  return std::sqrt(variance / static_cast<double>(bearings.size()));
}

double TeamReadings::time_s(const TeamInterval& interval) const {
  double sum_s = 0.0;
  std::size_t count = 0;
  for (const Sight& sight : sights) {
    for (const Bearing* z : sight.bearings) sum_s += to_seconds(z->stamp - interval.from);
    count += sight.bearings.size();
  }
  for (const Ranging& ranging : rangings) {
    for (const TeamRange* z : ranging.ranges) sum_s += to_seconds(z->stamp - interval.from);
    count += ranging.ranges.size();
  }
  return sum_s / static_cast<double>(std::max<std::size_t>(1, count));
}

double Ranging::sigma_m() const {
  if (dark) return kDarkSigma;
  const auto count = static_cast<double>(ranges.size());
  double variance = 0.0;
  double shared_m = 0.0;
  for (const TeamRange* z : ranges) {
    variance += z->reading.sigma_m * z->reading.sigma_m;
    shared_m += z->reading.shared_m / count;
  }
  return std::hypot(std::sqrt(variance) / count, kLasting * shared_m);
}

TeamReadings TeamReadings::of(const TeamInterval& interval, const TeamBelief& belief, Stage stage) {
  const auto accepts = [&](RobotId observer, RobotId neighbor, const TeamCamera& camera) {
    return !camera.is_refused && takes_part(belief, observer, neighbor, stage);
  };
  return {sights_of(interval, belief, accepts), rangings_of(interval, belief, stage)};
}

std::vector<Sight> all_sights(const TeamInterval& interval, const TeamBelief& belief) {
  return sights_of(interval, belief, [](RobotId, RobotId, const TeamCamera&) { return true; });
}

void gate(const ReadingScene& scene, TeamBelief& belief, TeamReadings& readings,
          std::vector<TeamResidual>& residuals) {
  for (Sight& sight : readings.sights) {
    residuals.push_back(gate(scene, belief.robots.at(sight.observer).cameras[sight.camera], sight));
    for (const Bearing* z : sight.bearings) {
      for (const RobotId robot : {sight.observer, sight.neighbor}) {
        Timestamp& last = belief.robots.at(robot).last_sighting;
        last = std::max(last, z->stamp);
      }
    }
  }
  for (Ranging& ranging : readings.rangings) {
    residuals.push_back(
        gate(scene, belief.ranges.at(ordered(ranging.observer, ranging.neighbor)), ranging));
    if (ranging.dark && !ranging.ranges.empty())
      belief.robots.at(*ranging.dark).last_fix = scene.interval.to;
  }
  std::erase_if(readings.sights, [](const Sight& s) { return s.bearings.empty(); });
  std::erase_if(readings.rangings, [](const Ranging& r) { return r.ranges.empty(); });
}

}  // namespace crepes
