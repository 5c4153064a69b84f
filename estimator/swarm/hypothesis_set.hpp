/// Competing hypotheses about a neighbor's pose, with their scores.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "estimator/core/token_bucket.hpp"
#include "estimator/swarm/gaussian_sum.hpp"

namespace crepes {

/// A token bucket for corrections by one kind of reading. It allows a burst while hypotheses
/// compete, but bounds the average: a slow computer must not fall behind and lose readings.
class CorrectionBudget {
 public:
  /// True if more than `reserve` corrections are left at `now`.
  [[nodiscard]] bool allows(Timestamp now, double reserve = 0.0) {
    return left_.refill(now) > reserve;
  }
  /// Subtracts corrections of one filter.
  void spend(std::size_t corrections) { left_.consume(static_cast<double>(corrections)); }

 private:
  TokenBucket left_{{.per_s = 1000.0, .burst = 8000.0}};
};

/// Multiple hypotheses of one neighbor. A robot and its mirror image lead to different first poses,
/// and one sighting cannot decide between them. Each hypothesis fuses the readings that pass its
/// gates. Its score is their log likelihood ratio against clutter, with a memory of half a second.
/// A hypothesis is confirmed when bearings of both directions support it. The first hypothesis is
/// the leader; a confirmed one with a clearly higher score replaces it.
class HypothesisSet {
 public:
  HypothesisSet(FilterSettings settings, PairMounting mounting)
      : settings_(settings), mounting_(std::move(mounting)) {}

  [[nodiscard]] bool empty() const { return hypotheses_.empty(); }
  void clear() { hypotheses_.clear(); }

  /// Applies noise and gates at once, priors to new hypotheses. A change of the profile drops all
  /// hypotheses.
  void reconfigure(const FilterSettings& settings);

  /// True if a raw pose could start a hypothesis that is needed.
  [[nodiscard]] bool accepts_raw_pose(Timestamp now) const;
  /// True if the budget allows a comparison of so many raw poses with every hypothesis.
  [[nodiscard]] bool has_budget_for(std::size_t raw_poses, Timestamp now);
  /// Adds a rival at `stamp()`. False, and nothing changes, if an existing hypothesis explains the
  /// sighting, or if the set is full of better ones.
  bool initialize(Timestamp stamp, const MutualInitialization& first);
  /// Starts the first hypothesis. False if there is one already, unless this one knows the heading
  /// that the other one has open.
  bool initialize(Timestamp stamp, const OneWayInitialization& first);
  /// Replaces all hypotheses by the graph's pose. Always true.
  bool initialize(Timestamp stamp, const GraphPose& first);

  /// Propagates all hypotheses to `to`.
  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Corrects each hypothesis with the most likely reading of a group of alternatives, the leader
  /// first, as far as the budget allows. If the leader became uncertain in a pause before the
  /// reading, all are deleted. Returns the leader's association; `kNoState` if there is no leader.
  Association fuse(std::span<const Measurement> candidates, const ImuHistory& imu_B,
                   const ImuHistory& imu_N);
  /// The tilts of both robots at `stamp()`. A mirror image tilts the pose of its robot. A leader
  /// that they contradict by two sigmas is disputed if beside it readings are seen that do not fit:
  /// it is ambiguous, and accepts rivals. Tilts alone may err, where a robot flies on a circle.
  void compare_tilts(const Tilt& ours, const Tilt& neighbors);
  /// Selects the leader and deletes hypotheses that lost or became equal to the leader.
  void prune();

  /// Whether it is not known yet how a neighbor that only one robot sees is turned.
  [[nodiscard]] bool has_open_heading() const { return !empty() && leader().has_open_heading(); }

  [[nodiscard]] const GaussianSum& leader() const { return hypotheses_.front().sum; }
  [[nodiscard]] Timestamp stamp() const { return leader().heaviest().stamp(); }
  /// True if the leader is confirmed and no confirmed rival has a similar score.
  [[nodiscard]] bool is_unambiguous() const;
  /// Number of the leader, counted over all hypotheses ever started.
  [[nodiscard]] std::uint32_t generation() const { return hypotheses_.front().generation; }
  [[nodiscard]] std::size_t size() const { return hypotheses_.size(); }

 private:
  struct Hypothesis {
    GaussianSum sum;
    Timestamp born;
    std::uint32_t generation = 0;
    double bearing_score = 0.0;
    double peer_bearing_score = 0.0;
    /// Shares of the latest readings, of each direction, beside which there was one that did not
    /// fit.
    double bearings_beside = 0.0;
    double peer_bearings_beside = 0.0;
    double tilt_nis = 0.0;  ///< of the angle between both robots' verticals
    bool one_way = false;   ///< bearings of one direction confirm it
    bool confirmed = false;

    void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
    void add_score(MeasurementKind kind, double log_likelihood_ratio);
    void note_beside(MeasurementKind kind, bool has_one);
    /// An image may be what it takes for the neighbor: readings do not fit, and it is tilted.
    [[nodiscard]] bool is_disputed() const;
    [[nodiscard]] double score() const { return bearing_score + peer_bearing_score; }
  };
  /// Whether the leader became so uncertain out of sight that a mutual sighting says more.
  [[nodiscard]] bool must_start_anew() const;
  /// How much more a rival explains than the leader. The older of the two has gathered its score
  /// for longer. If all readings of a kind have contradicted it for a while, or it is disputed,
  /// only the common time counts. The tilts count if it is the leader that is disputed.
  [[nodiscard]] double lead(const Hypothesis& rival) const;
  /// The best is the greatest.
  [[nodiscard]] auto rank() const {
    return [this](const Hypothesis& h) { return std::tuple(h.confirmed, !h.one_way, lead(h)); };
  }
  [[nodiscard]] bool is_explained(Timestamp stamp, const MutualInitialization& first) const;
  [[nodiscard]] Hypothesis make(GaussianSum sum);
  [[nodiscard]] CorrectionBudget& budget(MeasurementKind kind) {
    return budgets_[static_cast<std::size_t>(kind)];
  }

  FilterSettings settings_;
  PairMounting mounting_;
  std::vector<Hypothesis> hypotheses_;  ///< the leader first
  std::uint32_t generations_ = 0;
  std::array<CorrectionBudget, kMeasurementKindCount> budgets_;
};

}  // namespace crepes
