/// The starts of a neighbor's filter that may be right, and how much speaks for each.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "estimator/swarm/gaussian_sum.hpp"

namespace crepes {

/// Time for corrections by readings of one kind: for many in a burst, as starts compete, not for so
/// many all the time. A slow machine would fall behind, lose readings for that, and start anew.
class CorrectionBudget {
 public:
  /// More than `reserve` left at `now`?
  [[nodiscard]] bool allows(Timestamp now, double reserve = 0.0);
  void spend(std::size_t corrections) { left_ -= static_cast<double>(corrections); }

 private:
  double left_ = 0.0;
  Timestamp now_ = kNever;
};

/// A board and its image in the floor give different first poses, and one sighting does not tell
/// which is the robot. So starts compete: each takes the readings that fit it, and counts what they
/// say for it against their being clutter, the last half second weighing most. One that both
/// directions speak for may lead. A leader that is refused while a rival is believed gives way.
class Hypotheses {
 public:
  Hypotheses(FilterSettings settings, PairMounting mounting)
      : settings_(settings), mounting_(std::move(mounting)) {}

  [[nodiscard]] bool empty() const { return starts_.empty(); }
  void clear() { starts_.clear(); }

  /// Noise and gates from now on, priors for starts to come. Another profile's starts are dropped.
  void reconfigure(const FilterSettings& settings);

  /// Whether a raw pose would be welcome.
  [[nodiscard]] bool wants_start(Timestamp now) const;
  /// Whether there is time to compare so many raw poses with all that there is.
  [[nodiscard]] bool has_time_for(std::size_t raw_poses, Timestamp now);
  /// A new rival at `stamp()`. False, and nothing changes: one that is there explains it already,
  /// or there are too many that are better.
  bool start(Timestamp stamp, const MutualStart& first);
  /// While there is nothing else. False if there is.
  bool start(Timestamp stamp, const OneWayStart& first);
  /// Instead of all others: the graph knows. True.
  bool start(Timestamp stamp, const GraphPose& first);

  void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
  /// Corrects each with the likeliest of a group of rival readings; what the leader did.
  /// Where there is no time for all, the leader comes first.
  Association fuse(std::span<const Measurement> candidates, const ImuHistory& imu_B,
                   const ImuHistory& imu_N);
  /// Drops what is not needed any more and lets the best lead.
  void settle();

  [[nodiscard]] const GaussianSum& leader() const { return starts_.front().sum; }
  [[nodiscard]] Timestamp stamp() const { return leader().heaviest().stamp(); }
  /// Enough readings agree with the leader, and with no rival as well.
  [[nodiscard]] bool is_settled() const;
  /// Of the leader, among all starts ever.
  [[nodiscard]] std::uint32_t generation() const { return starts_.front().generation; }

 private:
  struct Start {
    GaussianSum sum;
    Timestamp born;
    std::uint32_t generation = 0;
    double seeing = 0.0;   ///< the score of our bearings
    double seen = 0.0;     ///< of the neighbor's
    bool one_way = false;  ///< only one direction can speak for it
    bool confirmed = false;

    void advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N);
    void count(MeasurementKind kind, double score);
    [[nodiscard]] double score() const { return seeing + seen; }
  };
  [[nodiscard]] bool is_explained(Timestamp stamp, const MutualStart& first) const;
  [[nodiscard]] Start make(GaussianSum sum);
  [[nodiscard]] CorrectionBudget& budget(MeasurementKind kind) {
    return budgets_[static_cast<std::size_t>(kind)];
  }

  FilterSettings settings_;
  PairMounting mounting_;
  std::vector<Start> starts_;  ///< the leader first
  std::uint32_t generations_ = 0;
  std::array<CorrectionBudget, kMeasurementKindCount> budgets_;
};

}  // namespace crepes
