/// Boards and lamps as an unsynchronized camera sees them, for tests and studies of the decoder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "estimator/vision/id_decoder.hpp"

namespace crepes::test {

/// A swarm whose boards blink `patterns`.
inline SwarmConfig swarm_of(const std::vector<std::string>& patterns, double slot_ms = 10.0) {
  SwarmConfig swarm;
  swarm.slot_ms = slot_ms;
  for (const std::string& pattern : patterns) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
    member.pattern = pattern;
    swarm.members.push_back(member);
  }
  return swarm;
}

/// What the camera does to what there is to see.
struct Viewing {
  double rate_hz = 200.0;
  double flip_rate = 0.0;
  double drop_rate = 0.0;
  double exposure_ms = 0.2;
  double least_light = 0.5;  ///< part of an exposure that makes a spot
};

/// How much light a source gives between two instants, as a part of what it could.
using Light = std::function<double(Duration from, Duration to)>;

/// A board with its own phase, and an oscillator that is off.
inline Light board(const BlinkCode& code, Duration phase, double ppm) {
  return [&code, phase, ppm](Duration from, Duration to) {
    const auto own = [&](Duration t) {
      return phase + t + from_seconds(to_seconds(t) * ppm * 1e-6);
    };
    return code.lit_fraction(own(from), own(to));
  };
}

/// A lamp on the mains, lit for a part of every half-wave.
inline Light mains_lamp(double hz, double part, double phase) {
  return [=](Duration from, Duration to) {
    const double cycle = 0.5 * (to_seconds(from) + to_seconds(to)) * hz + phase;
    return cycle - std::floor(cycle) < part ? 1.0 : 0.0;
  };
}

/// Turns on and off at random, after exponentially distributed times.
class Telegraph {
 public:
  Telegraph(double lit_s, double dark_s, unsigned seed) : mean_s_{dark_s, lit_s}, random_(seed) {}
  double operator()(Duration from, Duration) {
    while (until_ <= from) {
      is_lit_ = !is_lit_;
      until_ +=
          from_seconds(std::exponential_distribution<double>(1.0 / mean_s_[is_lit_])(random_));
    }
    return is_lit_ ? 1.0 : 0.0;
  }

 private:
  double mean_s_[2];
  std::mt19937 random_;
  bool is_lit_ = false;
  Duration until_{};
};

/// Frame after frame of one source, as the decoder gets them.
class Watcher {
 public:
  Watcher(const IdDecoder& decoder, const Viewing& viewing, unsigned seed)
      : decoder_(decoder), viewing_(viewing), random_(seed) {}

  /// One frame at `t` since the start; the ID, if the source was seen and has one.
  std::optional<RobotId> look(const Light& light, Duration t, BlinkEvidence& evidence) {
    const double flip = chance_(random_);
    if (chance_(random_) < viewing_.drop_rate) return std::nullopt;
    const Duration half = from_seconds(0.5e-3 * viewing_.exposure_ms);
    const bool is_bright = light(t - half, t + half) >= viewing_.least_light;
    if (is_bright == (flip < viewing_.flip_rate)) {
      decoder_.observe_dark(evidence, kStart + t);
      return std::nullopt;
    }
    decoder_.observe_lit(evidence, kStart + t);
    if (!first_light_) first_light_ = t;
    return decoder_.id_of(evidence);
  }

  struct Decision {
    std::optional<RobotId> id;  ///< empty: undecided to the end
    Duration delay{};           ///< since the first light
  };
  /// Looks at a source that is new until it has an ID.
  Decision decide(const Light& light, Duration at_most) {
    BlinkEvidence evidence;
    const Duration frame = from_seconds(1.0 / viewing_.rate_hz);
    for (Duration t{}; t < at_most; t += frame)
      if (const auto id = look(light, t, evidence)) return {id, t - *first_light_};
    return {};
  }

 private:
  static constexpr Timestamp kStart{std::chrono::seconds{1000}};
  const IdDecoder& decoder_;
  Viewing viewing_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> chance_{0.0, 1.0};
  std::optional<Duration> first_light_;
};

}  // namespace crepes::test
