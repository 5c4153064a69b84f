/// Who blinks how: the codes of all boards of the swarm.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "estimator/core/result.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// When a board is lit, as a function of the board's own time; repeats for ever.
class BlinkCode {
 public:
  /// `pattern`: 8 to 32 characters, 1 lit and 0 dark, one a slot; must hold both.
  [[nodiscard]] static Result<BlinkCode> from_pattern(std::string_view pattern, Duration slot);
  /// Lit for the first `duty` of every `period`.
  [[nodiscard]] static Result<BlinkCode> from_duty(double duty, Duration period);
  /// The code that `member` has, by pattern or by duty.
  [[nodiscard]] static Result<BlinkCode> from(const MemberConfig& member, const SwarmConfig& swarm);

  [[nodiscard]] Duration period() const { return period_; }
  [[nodiscard]] bool is_lit(Duration board_time) const;
  /// The part of [from, to) in which the board is lit, 0 to 1: what an exposure collects.
  [[nodiscard]] double lit_fraction(Duration from, Duration to) const;

 private:
  struct Interval {
    Duration begin;
    Duration end;
  };

  [[nodiscard]] Duration lit_until(Duration board_time) const;

  Duration period_{};
  std::vector<Interval> lit_;  ///< within one period, in order
};

/// The codes of all members. No two of them are the same signal.
class IdLibrary {
 public:
  struct Entry {
    RobotId id{};
    BlinkCode code;
  };

  /// Refuses members without a code, with an ambiguous one, or with the code of another.
  [[nodiscard]] static Result<IdLibrary> from(const SwarmConfig& swarm);

  [[nodiscard]] std::span<const Entry> entries() const { return entries_; }

 private:
  std::vector<Entry> entries_;
};

}  // namespace crepes
