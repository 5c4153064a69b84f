#include "estimator/swarm/gaussian_sum.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/relative/propagation.hpp"
#include "estimator/relative/range_update.hpp"

namespace crepes {
namespace {

constexpr double kFalseBearings = 0.1;  // density of clutter for each true one [1/sr]

// How much of the evidence of each reading counts between headings.
constexpr double kEvidence = 0.5;
// Once so few are left, tilt and speed are known, and the parts may estimate their headings.
constexpr std::size_t kFew = 3;

// Squared Mahalanobis distance of a pose, by the covariance of the other.
double distance2(const GaussianPose& from, const Pose& to) {
  const Vector6d step = pose_difference(from.pose, to);
  return step.dot(from.covariance.llt().solve(step));
}

}  // namespace

double log_likelihood_ratio(const Fusion& fusion, MeasurementKind kind) {
  if (fusion.verdict != Verdict::kFused && fusion.verdict != Verdict::kGated) return 0.0;
  const bool is_distance = kind == MeasurementKind::kRange || kind == MeasurementKind::kPeerRange ||
                           kind == MeasurementKind::kRingDistance;
  const double ratio =
      fusion.log_likelihood - std::log(is_distance ? kFalseRangeDensity : kFalseBearings);
  // What is gated was not used, but it still tells filters apart: else the least likely one would
  // gain on all others by a noisy reading that it alone admits.
  return fusion.verdict == Verdict::kFused ? ratio : std::max(0.0, ratio);
}

GaussianSum::GaussianSum(const NeighborTrack& whole) {
  for (auto& [track, log_weight] : whole.split()) parts_.push_back({std::move(track), log_weight});
  normalize();
}

GaussianSum::GaussianSum(std::vector<NeighborTrack> parts) : has_open_heading_(true) {
  for (NeighborTrack& track : parts) parts_.push_back({std::move(track)});
  normalize();
}

void GaussianSum::set_noise(const ProcessNoise& noise) {
  for (Part& part : parts_) part.track.set_noise(noise);
}

void GaussianSum::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  for (Part& part : parts_) part.track.advance_to(to, imu_B, imu_N);
}

Association GaussianSum::fuse(std::span<const Measurement> candidates, const PairMounting& mounting,
                              const Gates& gates) {
  const std::size_t chosen = heaviest().most_likely(candidates, mounting);
  const Measurement& reading = candidates[chosen];
  Association association{.chosen = chosen, .fusion{}};
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Fusion fusion = parts_[i].track.fuse(reading, mounting, gates);
    if (i == heaviest_) association.fusion = fusion;
    parts_[i].gain = log_likelihood_ratio(fusion, reading.kind);
  }
  association.score = log_mean_gain();
  for (Part& part : parts_) part.log_weight += (has_open_heading_ ? kEvidence : 1.0) * part.gain;
  normalize();
  return association;
}

/// Of all parts together, by their weights before.
double GaussianSum::log_mean_gain() const {
  double largest = -std::numeric_limits<double>::infinity();
  for (const Part& part : parts_) largest = std::max(largest, part.log_weight + part.gain);
  double sum = 0.0;
  for (const Part& part : parts_) sum += std::exp(part.log_weight + part.gain - largest);
  return largest + std::log(sum);
}

/// Scales the weights to a sum of one.
void GaussianSum::normalize() {
  const auto heaviest =
      std::max_element(parts_.begin(), parts_.end(),
                       [](const Part& a, const Part& b) { return a.log_weight < b.log_weight; });
  heaviest_ = static_cast<std::size_t>(heaviest - parts_.begin());
  const double largest = heaviest->log_weight;
  double sum = 0.0;
  for (const Part& part : parts_) sum += std::exp(part.log_weight - largest);
  const double log_sum = largest + std::log(sum);
  for (Part& part : parts_) part.log_weight -= log_sum;
}

void GaussianSum::prune() {
  constexpr double kUnlikely = -9.0;  // log weight relative to the heaviest
  constexpr double kEqual = 0.25;     // squared, in sigmas
  if (parts_.size() == 1) return;
  std::swap(parts_.front(), parts_[heaviest_]);
  const Part& first = parts_.front();
  const GaussianPose pose = first.track.pose();
  const auto is_redundant = [&](const Part& part) {
    return part.log_weight - first.log_weight < kUnlikely ||
           distance2(pose, part.track.pose().pose) < kEqual;
  };
  parts_.erase(std::remove_if(parts_.begin() + 1, parts_.end(), is_redundant), parts_.end());
  if (has_open_heading_ && parts_.size() <= kFew) {
    for (Part& part : parts_) part.track.release_heading();
    has_open_heading_ = false;
  }
  normalize();
}

bool GaussianSum::is_compatible_with(const GaussianSum& other) const {
  constexpr double kCompatible = 12.0;  // squared, in sigmas; a mirror image is hundreds away
  return distance2(heaviest().pose(), other.heaviest().pose().pose) < kCompatible;
}

const NeighborTrack& GaussianSum::heaviest() const { return parts_[heaviest_].track; }

GaussianPose GaussianSum::mean(const NeighborTrack& heaviest, const ImuHistory& imu_B,
                               const ImuHistory& imu_N) const {
  if (parts_.size() == 1) return heaviest.pose();
  const GaussianPose now = heaviest.pose();
  const GaussianPose center = this->heaviest().pose();
  Vector6d mean = Vector6d::Zero();
  Matrix6d moment = Matrix6d::Zero();
  for (const Part& part : parts_) {
    const double weight = std::exp(part.log_weight);
    const GaussianPose pose = part.track.pose();
    const Vector6d step = pose_difference(center.pose, pose.pose);
    mean += weight * step;
    moment += weight * (step * step.transpose() + pose.covariance - center.covariance);
  }
  // Where the other parts know more than the heaviest one did, readings since then may have told as
  // much: only what the sum is more uncertain by counts.
  const Eigen::SelfAdjointEigenSolver<Matrix6d> excess(moment - mean * mean.transpose());
  // Both bodies may have turned since then.
  const Matrix6d turn = error_rotation(imu_B, imu_N, this->heaviest().stamp(), heaviest.stamp());
  const Matrix6d axes = turn * excess.eigenvectors();
  const Vector6d more = excess.eigenvalues().cwiseMax(0.0);
  return {perturbed(now.pose, turn * mean),
          now.covariance + axes * more.asDiagonal() * axes.transpose()};
}

}  // namespace crepes
