#include "estimator/vision/id_library.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace crepes {
namespace {

constexpr double kMinDutyDistance = 0.02;  // smaller differences are lost between two frames

Duration from_ms(double ms) { return Duration{std::llround(ms * 1e6)}; }

/// Equal for all patterns that are the same signal: the smallest rotation of the repeating part.
std::string canonical(const std::string& pattern) {
  const std::size_t repeat = (pattern + pattern).find(pattern, 1);
  const std::string root = pattern.substr(0, repeat);
  std::string least = root;
  for (std::size_t i = 1; i < root.size(); ++i)
    least = std::min(least, root.substr(i) + root.substr(0, i));
  return least;
}

/// Lit once a period, for a share of it.
struct Duty {
  double share;
  Duration period;
};

/// Empty for a pattern that is lit more than once before it repeats.
std::optional<Duty> duty_of(const MemberConfig& member, const SwarmConfig& swarm) {
  if (member.duty) return Duty{*member.duty, from_ms(swarm.period_ms)};
  if (!member.pattern) return std::nullopt;
  const std::string slots = canonical(*member.pattern);  // begins with the longest dark time
  if (slots.find("10") != std::string::npos) return std::nullopt;
  const auto lit = static_cast<double>(std::ranges::count(slots, '1'));
  return Duty{lit / static_cast<double>(slots.size()),
              from_ms(swarm.slot_ms) * static_cast<std::int64_t>(slots.size())};
}

}  // namespace

bool blink_alike(const MemberConfig& a, const MemberConfig& b, const SwarmConfig& swarm) {
  if (a.pattern && b.pattern) return canonical(*a.pattern) == canonical(*b.pattern);
  const auto duty_a = duty_of(a, swarm);
  const auto duty_b = duty_of(b, swarm);
  return duty_a && duty_b && duty_a->period == duty_b->period &&
         std::abs(duty_a->share - duty_b->share) < kMinDutyDistance;
}

Result<BlinkCode> BlinkCode::from_pattern(std::string_view pattern, Duration slot) {
  if (pattern.size() < kMinSlots || pattern.size() > kMaxSlots) {
    return fail(ErrorCode::kConfig,
                fmt::format("pattern: must have 8 to 32 slots, has {}", pattern.size()));
  }
  if (pattern.find_first_not_of("01") != std::string_view::npos)
    return fail(ErrorCode::kConfig, "pattern: may hold 0 and 1 only");
  if (pattern.find('0') == std::string_view::npos || pattern.find('1') == std::string_view::npos)
    return fail(ErrorCode::kConfig, "pattern: never changes");
  if (slot <= Duration::zero()) return fail(ErrorCode::kConfig, "slot_ms: must be positive");

  BlinkCode code;
  code.period_ = slot * static_cast<std::int64_t>(pattern.size());
  code.slots_ = pattern.size();
  Duration begin{};
  for (const char bit : pattern) {
    const Duration end = begin + slot;
    if (bit == '1' && !code.lit_.empty() && code.lit_.back().end == begin) {
      code.lit_.back().end = end;
    } else if (bit == '1') {
      code.lit_.push_back({begin, end});
    }
    begin = end;
  }
  return code;
}

Result<BlinkCode> BlinkCode::from_duty(double duty, Duration period) {
  if (!(duty > 0.0 && duty < 1.0))
    return fail(ErrorCode::kConfig, "duty: must lie between 0 and 1");
  if (period <= Duration::zero()) return fail(ErrorCode::kConfig, "period_ms: must be positive");
  BlinkCode code;
  code.period_ = period;
  code.lit_ = {{Duration{}, Duration{std::llround(duty * static_cast<double>(period.count()))}}};
  return code;
}

Result<BlinkCode> BlinkCode::from(const MemberConfig& member, const SwarmConfig& swarm) {
  if (member.pattern.has_value() == member.duty.has_value())
    return fail(ErrorCode::kConfig, "must have either pattern or duty");
  if (member.pattern) return from_pattern(*member.pattern, from_ms(swarm.slot_ms));
  return from_duty(*member.duty, from_ms(swarm.period_ms));
}

Duration BlinkCode::lit_until(Duration board_time) const {
  const Duration within = ((board_time % period_) + period_) % period_;
  Duration a_period{};
  Duration this_period{};
  for (const Interval& lit : lit_) {
    a_period += lit.end - lit.begin;
    this_period += std::clamp(within - lit.begin, Duration{}, lit.end - lit.begin);
  }
  return a_period * ((board_time - within) / period_) + this_period;
}

bool BlinkCode::is_lit(Duration board_time) const {
  const Duration within = ((board_time % period_) + period_) % period_;
  return std::any_of(lit_.begin(), lit_.end(), [within](const Interval& lit) {
    return lit.begin <= within && within < lit.end;
  });
}

double BlinkCode::lit_fraction(Duration from, Duration to) const {
  if (to <= from) return is_lit(from) ? 1.0 : 0.0;
  return to_seconds(lit_until(to) - lit_until(from)) / to_seconds(to - from);
}

Result<IdLibrary> IdLibrary::from(const SwarmConfig& swarm) {
  IdLibrary library;
  for (std::size_t i = 0; i < swarm.members.size(); ++i) {
    const MemberConfig& member = swarm.members[i];
    const std::string where = fmt::format("swarm.members[{}]", i);
    Result<BlinkCode> code = BlinkCode::from(member, swarm);
    if (!code) return tl::unexpected(std::move(code.error()).with_context(where));
    for (std::size_t j = 0; j < i; ++j) {
      const MemberConfig& other = swarm.members[j];
      if (other.id == member.id) {
        return fail(ErrorCode::kConfig, fmt::format("{}: id {} is taken", where, member.id.value));
      }
      if (blink_alike(member, other, swarm)) {
        return fail(ErrorCode::kConfig,
                    fmt::format("{}: blinks like member {}: they cannot be told apart", where,
                                other.id.value));
      }
    }
    library.entries_.push_back({member.id, *std::move(code)});
    if (member.ring_radius_m) library.sizes_[member.id] = {*member.ring_radius_m, member.ring_leds};
  }
  return library;
}

}  // namespace crepes
