#include "estimator/calibration/range/range_calibration.hpp"

#include <fmt/core.h>

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "estimator/calibration/number_text.hpp"
#include "estimator/calibration/range/robust_mean.hpp"
#include "estimator/core/quantile.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastRanges = 20;
constexpr double kTapeSigma_m = 0.005;       // reading, and rounding to the centimeter
constexpr double kDirectionSigma_m = 0.015;  // of a pair, as long as rests do not show it
constexpr double kDirectionWeight = 3.0;     // rests that this counts for
constexpr double kMost_m = 2.0;              // a delay beyond this is a mistake
constexpr double kMoved_m = 0.05;
constexpr double kMovedSigmas = 6.0;
constexpr double kDisagree = 4.0;  // sigmas
constexpr double kRankTolerance = 1e-6;

std::string name_of(const RobotPair& pair) {
  return fmt::format("{},{}", pair.a.value, pair.b.value);
}

template <class Segment>
std::string place_of(const Segment& segment) {
  return fmt::format("ids {}, segment {}", name_of(segment.pair), segment.segment + 1);
}

bool is_late(const UwbRange& range, double late_path_db) {
  return range.received_dbm - range.first_path_dbm > late_path_db;
}

/// Measured less taped, of the ranges that came by a direct path.
struct RangeErrors {
  std::vector<double> errors_m;
  std::vector<double> headings_rad;  ///< empty if nobody turned
};

RangeErrors errors_of(const TapedRanges& taped, const LatePathLimits& late_path_db) {
  const auto limit_of = [&](RobotId measuring) {
    const auto found = late_path_db.find(measuring);
    return found == late_path_db.end() ? RangeNoise{}.late_path_db : found->second;
  };
  const double limit_a = limit_of(taped.pair.a);
  const double limit_b = limit_of(taped.pair.b);
  RangeErrors found;
  for (std::size_t i = 0; i < taped.ranges.size(); ++i) {
    const UwbRange& range = taped.ranges[i];
    if (is_late(range, range.neighbor == taped.pair.a ? limit_b : limit_a)) continue;
    found.errors_m.push_back(range.range_m - taped.distance_m);
    if (!taped.headings_rad.empty()) found.headings_rad.push_back(taped.headings_rad[i]);
  }
  return found;
}

SegmentBias bias_of(const TapedRanges& taped, const std::vector<double>& errors) {
  const RobustMean mean = robust_mean(errors);
  return {.pair = taped.pair,
          .segment = taped.segment,
          .bias_m = mean.value,
          .scatter_m = mean.scatter,
          .used = mean.used,
          .late = taped.ranges.size() - errors.size(),
          .outliers = errors.size() - mean.used};
}

/// Robots that move between the two times change their distance: halves that differ.
void check_rest(const SegmentBias& segment, const std::vector<double>& errors,
                RangeCalibration& found) {
  const auto half = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  const RobustMean first = robust_mean({errors.begin(), half});
  const RobustMean second = robust_mean({half, errors.end()});
  const double change = std::abs(first.value - second.value);
  const double sigma = std::hypot(first.sigma(), second.sigma());
  if (change > kMoved_m && change > kMovedSigmas * sigma) {
    found.refusals.push_back(fmt::format(
        "{}: the distance changed by {} m within the segment: the robots were not at rest; correct "
        "from_s and to_s",
        place_of(segment), number_text(change, 2)));
  }
}

/// The mean over all directions of a module that turned.
void add_turn(const TapedRanges& taped, const RangeErrors& errors, RangeCalibration& found) {
  const auto pattern = fit_turn_pattern(errors.errors_m, errors.headings_rad);
  const std::string place =
      "ids " + name_of(taped.pair) + ", segment " + std::to_string(taped.segment + 1);
  if (!pattern) {
    found.refusals.push_back(place + ": robot " + std::to_string(taped.turning.value) +
                             " did not turn by 360 deg, or had no direct path over 90 deg of it; "
                             "turn it slowly and all the way, with a free view of its antenna");
    return;
  }
  found.patterns.push_back({taped.turning, taped.pair, *pattern});
  found.segments.push_back({.pair = taped.pair,
                            .segment = taped.segment,
                            .bias_m = pattern->mean_m,
                            .scatter_m = pattern->scatter_m,
                            .used = pattern->used,
                            .late = taped.ranges.size() - errors.errors_m.size(),
                            .outliers = errors.errors_m.size() - pattern->used});
}

void add_segment(const TapedRanges& taped, const LatePathLimits& late_path_db,
                 RangeCalibration& found) {
  const RangeErrors direct = errors_of(taped, late_path_db);
  const std::vector<double>& errors = direct.errors_m;
  if (errors.size() < kLeastRanges) {
    found.refusals.push_back(fmt::format(
        "{}: {} ranges by a direct path of {}; at least {} are needed: longer, and without anybody "
        "in between",
        place_of(taped), errors.size(), taped.ranges.size(), kLeastRanges));
    return;
  }
  if (!taped.headings_rad.empty()) return add_turn(taped, direct, found);
  SegmentBias segment = bias_of(taped, errors);
  check_rest(segment, errors, found);
  if (std::abs(segment.bias_m) > kMost_m) {
    found.refusals.push_back(
        fmt::format("{}: measured and taped distance differ by {} m: a mistake on the tape?",
                    place_of(segment), number_text(segment.bias_m, 2)));
  }
  found.segments.push_back(segment);
}

double variance_without_direction(const SegmentBias& segment) {
  return segment.scatter_m * segment.scatter_m / static_cast<double>(segment.used) +
         kTapeSigma_m * kTapeSigma_m;
}

/// The measurements are  A x = y  with one row a segment.
struct LinearFit {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd residuals;
  Eigen::Index rank = 0;
};

LinearFit least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& y,
                        const Eigen::VectorXd& variance) {
  const Eigen::VectorXd weight = variance.cwiseInverse().cwiseSqrt();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(weight.asDiagonal() * A);
  qr.setThreshold(kRankTolerance);
  LinearFit fit;
  fit.rank = qr.rank();
  if (fit.rank < A.cols()) return fit;
  fit.x = qr.solve(weight.asDiagonal() * y);
  fit.residuals = y - A * fit.x;
  const Eigen::MatrixXd H = A.transpose() * variance.cwiseInverse().asDiagonal() * A;
  fit.covariance = H.inverse();
  return fit;
}

/// What the columns of a fit stand for, and its rows.
struct Design {
  Eigen::MatrixXd A;
  Eigen::VectorXd y;
  Eigen::VectorXd variance;  ///< without the directions' part
};

Design design_of(const std::vector<SegmentBias>& segments, std::size_t columns) {
  const auto rows = static_cast<Eigen::Index>(segments.size());
  Design design{Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(columns)),
                Eigen::VectorXd::Zero(rows), Eigen::VectorXd::Zero(rows)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    design.y(i) = segments[static_cast<std::size_t>(i)].bias_m;
    design.variance(i) = variance_without_direction(segments[static_cast<std::size_t>(i)]);
  }
  return design;
}

/// The directions' part of the variance, so that residuals are as large as expected. What is known
/// beforehand counts as a few more rests.
double direction_sigma(const Design& design) {
  const double prior = kDirectionSigma_m * kDirectionSigma_m;
  const LinearFit fit = least_squares(design.A, design.y, design.variance.array() + prior);
  if (fit.rank < design.A.cols()) return kDirectionSigma_m;
  const auto freedom = static_cast<double>(design.A.rows() - design.A.cols());
  const double excess =
      std::max(0.0, fit.residuals.squaredNorm() - freedom * design.variance.mean());
  return std::sqrt((excess + kDirectionWeight * prior) / (freedom + kDirectionWeight));
}

template <class Key>
std::map<Key, Eigen::Index> columns_of(const std::vector<Key>& keys) {
  std::map<Key, Eigen::Index> columns;
  for (const Key& key : keys) columns.emplace(key, 0);
  Eigen::Index next = 0;
  for (auto& [key, column] : columns) column = next++;
  return columns;
}

/// Pairs alone: the weighted mean of each one's rests.
void fit_pairs(RangeCalibration& found) {
  std::vector<RobotPair> keys;
  for (const SegmentBias& segment : found.segments) keys.push_back(segment.pair);
  const auto columns = columns_of(keys);
  Design design = design_of(found.segments, columns.size());
  for (std::size_t i = 0; i < found.segments.size(); ++i)
    design.A(static_cast<Eigen::Index>(i), columns.at(found.segments[i].pair)) = 1.0;
  found.direction_sigma_m = direction_sigma(design);
  const LinearFit fit = least_squares(
      design.A, design.y, design.variance.array() + std::pow(found.direction_sigma_m, 2));
  for (const auto& [pair, column] : columns)
    found.pairs.push_back({pair, fit.x(column), std::sqrt(fit.covariance(column, column))});
}

/// A rest of a pair that is far from its others.
void check_rests(RangeCalibration& found) {
  constexpr std::size_t kLeastRests = 3;
  constexpr double kMistake_m = 0.08;
  std::map<RobotPair, std::vector<double>> biases_m;
  for (const SegmentBias& segment : found.segments)
    biases_m[segment.pair].push_back(segment.bias_m);
  for (const SegmentBias& segment : found.segments) {
    std::vector<double> all_m = biases_m[segment.pair];
    if (all_m.size() < kLeastRests) continue;
    const double off_m = segment.bias_m - upper_median(all_m);
    if (std::abs(off_m) < kMistake_m) continue;
    found.warnings.push_back(fmt::format(
        "{}: {} m from the pair's other rests: a mistake on the tape, or something between the two",
        place_of(segment), number_text(off_m, 3)));
  }
}

void check_pairs(const std::vector<PairBias>& alone, RangeCalibration& found) {
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const double difference = alone[i].bias_m - found.pairs[i].bias_m;
    if (std::abs(difference) > kDisagree * alone[i].sigma_m) {
      found.warnings.push_back(fmt::format(
          "ids {}: {} m from the sum of its modules: a mistake on the tape, or something between "
          "the two",
          name_of(alone[i].pair), number_text(difference, 3)));
    }
  }
}

/// Modules, where cycles of an odd number of robots determine them all; then pairs are their sums.
void fit_modules(RangeCalibration& found) {
  std::vector<RobotId> keys;
  for (const SegmentBias& segment : found.segments)
    keys.insert(keys.end(), {segment.pair.a, segment.pair.b});
  const auto columns = columns_of(keys);
  Design design = design_of(found.segments, columns.size());
  for (std::size_t i = 0; i < found.segments.size(); ++i) {
    for (const RobotId id : {found.segments[i].pair.a, found.segments[i].pair.b})
      design.A(static_cast<Eigen::Index>(i), columns.at(id)) = 1.0;
  }
  const LinearFit fit = least_squares(
      design.A, design.y, design.variance.array() + std::pow(found.direction_sigma_m, 2));
  if (fit.rank < design.A.cols()) {
    found.warnings.emplace_back(
        "modules: these pairs determine sums only; three robots with all three distances "
        "determine each module");
    return;
  }
  const std::vector<PairBias> alone = found.pairs;
  for (const auto& [id, column] : columns)
    found.modules.push_back({id, fit.x(column), std::sqrt(fit.covariance(column, column))});
  for (PairBias& pair : found.pairs) {
    const Eigen::Index a = columns.at(pair.pair.a);
    const Eigen::Index b = columns.at(pair.pair.b);
    pair.bias_m = fit.x(a) + fit.x(b);
    pair.sigma_m =
        std::sqrt(fit.covariance(a, a) + fit.covariance(b, b) + 2.0 * fit.covariance(a, b));
  }
  check_pairs(alone, found);
}

/// The noise of single ranges, and the least difference of powers above which nine of ten ranges,
/// of twenty or more, are outliers.
void describe_noise(std::span<const TapedRanges> taped, RangeCalibration& found) {
  constexpr double kOutlierSigmas = 5.0;
  constexpr int kLeastDb = 3;
  constexpr int kMostDb = 20;
  double sum = 0.0;
  double count = 0.0;
  for (const SegmentBias& segment : found.segments) {
    sum += static_cast<double>(segment.used) * segment.scatter_m * segment.scatter_m;
    count += static_cast<double>(segment.used);
  }
  found.noise_m = std::sqrt(sum / count);
  for (int db = kLeastDb; db <= kMostDb && !found.late_path_db; ++db) {
    std::size_t bad = 0;
    std::size_t all = 0;
    for (const TapedRanges& part : taped) {
      const auto same = std::ranges::find_if(found.segments, [&](const SegmentBias& s) {
        return s.pair == part.pair && s.segment == part.segment;
      });
      if (same == found.segments.end()) continue;
      for (const UwbRange& range : part.ranges) {
        if (!is_late(range, db)) continue;
        ++all;
        const double error = range.range_m - part.distance_m - same->bias_m;
        bad += error > kOutlierSigmas * same->scatter_m ? 1U : 0U;
      }
    }
    if (all < kLeastRanges) return;
    if (10 * bad > 9 * all) found.late_path_db = db;
  }
}

}  // namespace

RangeCalibration calibrate_ranges(std::span<const TapedRanges> taped,
                                  const LatePathLimits& late_path_db) {
  RangeCalibration found;
  if (taped.empty()) found.refusals.emplace_back("the tape names no pair");
  for (const TapedRanges& part : taped) add_segment(part, late_path_db, found);
  if (!found.refusals.empty()) return found;
  check_rests(found);
  fit_pairs(found);
  fit_modules(found);
  describe_noise(taped, found);
  if (found.segments.size() == found.pairs.size()) {
    found.warnings.emplace_back(
        "each pair rested once: its bias holds for those directions alone, to 1.5 cm; repeat at "
        "other distances and turned");
  }
  return found;
}

}  // namespace crepes
