/// The blink codes of all boards of the swarm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "estimator/core/result.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// Whether a board is lit, as a function of the board's own time. Repeats with period().
class BlinkCode {
 public:
  /// Lengths of a pattern.
  static constexpr std::size_t kMinSlots = 8;
  static constexpr std::size_t kMaxSlots = 32;

  /// `pattern`: 8 to 32 characters, one a slot, 1 lit and 0 dark. Both must occur.
  [[nodiscard]] static Result<BlinkCode> from_pattern(std::string_view pattern, Duration slot);
  /// Lit for the first `duty` of every `period`.
  [[nodiscard]] static Result<BlinkCode> from_duty(double duty, Duration period);
  /// The code of `member`, which has either a pattern or a duty.
  [[nodiscard]] static Result<BlinkCode> from(const MemberConfig& member, const SwarmConfig& swarm);

  [[nodiscard]] Duration period() const { return period_; }
  /// Of a pattern; zero for a duty.
  [[nodiscard]] std::size_t slots() const { return slots_; }
  [[nodiscard]] bool is_lit(Duration board_time) const;
  /// The share of [from, to) in which the board is lit, 0 to 1: the light that an exposure of this
  /// time collects.
  [[nodiscard]] double lit_fraction(Duration from, Duration to) const;

 private:
  struct Interval {
    Duration begin;
    Duration end;
  };

  [[nodiscard]] Duration lit_until(Duration board_time) const;

  Duration period_{};
  std::size_t slots_ = 0;
  std::vector<Interval> lit_;  ///< within one period, in order
};

/// Whether two members that have a code each blink alike: the same pattern, however shifted, or
/// duties that frames cannot tell apart. A pattern that is lit once a period is a duty, too.
[[nodiscard]] bool blink_alike(const MemberConfig& a, const MemberConfig& b,
                               const SwarmConfig& swarm);

/// The codes of all members. No two are the same signal, however shifted in time.
class IdLibrary {
 public:
  /// A robot and its code.
  struct Entry {
    RobotId id{};
    BlinkCode code;
  };

  /// Refuses members that have no code, both a pattern and a duty, or the code or id of another.
  [[nodiscard]] static Result<IdLibrary> from(const SwarmConfig& swarm);

  [[nodiscard]] std::span<const Entry> entries() const { return entries_; }
  /// How large a board is.
  struct BoardSize {
    double ring_radius_m = 0.0;
    std::optional<int> leds;

    /// Whether a ring of so many LEDs in a picture may be this one. Four may be a part of a ring.
    [[nodiscard]] bool has(int ring_leds) const {
      return leds ? ring_leds == *leds : ring_leds > 4;
    }
  };
  /// Of the boards whose radius is configured.
  [[nodiscard]] const std::map<RobotId, BoardSize>& sizes() const { return sizes_; }

 private:
  std::vector<Entry> entries_;
  std::map<RobotId, BoardSize> sizes_;
};

}  // namespace crepes
