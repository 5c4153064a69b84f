#include "estimator/vision/id_decoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <set>

namespace crepes::id_decoder_test {
namespace {

using namespace std::chrono_literals;

SwarmConfig swarm_of(const std::vector<std::string>& patterns) {
  SwarmConfig swarm;
  for (const std::string& pattern : patterns) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
    member.pattern = pattern;
    swarm.members.push_back(member);
  }
  return swarm;
}

SwarmConfig four() {
  return swarm_of(
      {"011111111111111111", "001001011111111111", "001010101111111111", "001011110011111111"});
}

struct Camera {
  double rate_hz = 200.0;
  double flip_rate = 0.0;
  double drop_rate = 0.0;
  unsigned seed = 1;
};

using Light = std::function<bool(Duration)>;

struct Outcome {
  std::optional<Duration> first_id;  ///< since the first frame
  std::set<int> ids;                 ///< ever given
  int identified_frames = 0;
  int lit_frames = 0;
  std::optional<RobotId> last;
};

/// Shows `light` to an unsynchronized camera; lit frames are asked for the ID.
Outcome watch(const IdDecoder& decoder, const Light& light, Duration duration, const Camera& camera,
              Duration start = 17s, BlinkEvidence* kept = nullptr) {
  std::mt19937 random(camera.seed);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  BlinkEvidence own;
  BlinkEvidence& evidence = kept != nullptr ? *kept : own;
  Outcome outcome;
  const Duration frame = from_seconds(1.0 / camera.rate_hz);
  for (Duration t{}; t < duration; t += frame) {
    if (chance(random) < camera.drop_rate) continue;
    const bool lit = light(t) != (chance(random) < camera.flip_rate);
    const Timestamp stamp{start + t};
    if (!lit) {
      decoder.observe_dark(evidence, stamp);
      continue;
    }
    decoder.observe_lit(evidence, stamp);
    ++outcome.lit_frames;
    outcome.last = decoder.id_of(evidence);
    if (!outcome.last) continue;
    ++outcome.identified_frames;
    outcome.ids.insert(outcome.last->value);
    if (!outcome.first_id) outcome.first_id = t;
  }
  return outcome;
}

/// A board with its own phase and an oscillator that is off.
Light board(const BlinkCode& code, Duration phase, double ppm) {
  return [&code, phase, ppm](Duration t) {
    return code.is_lit(
        phase + t +
        Duration{static_cast<std::int64_t>(static_cast<double>(t.count()) * ppm * 1e-6)});
  };
}

TEST(IdDecoder, NamesEveryBoardAtEveryPhaseAndRateAndNeverAnother) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  std::mt19937 random(3);
  std::vector<double> delays_ms;

  for (int trial = 0; trial < 400; ++trial) {
    const auto& [id, code] = library.entries()[static_cast<std::size_t>(trial) % 4];
    const Duration phase{static_cast<std::int64_t>(random() % 180'000'000U)};
    const double ppm = static_cast<double>(random() % 201U) - 100.0;
    const double rate_hz = 120.0 + static_cast<double>(random() % 131U);
    const Outcome seen = watch(decoder, board(code, phase, ppm), 3s, {.rate_hz = rate_hz});

    ASSERT_EQ(seen.ids, std::set<int>{id.value})
        << "rate " << rate_hz << " phase " << phase.count();
    if (id != RobotId{1} && rate_hz >= 160.0) delays_ms.push_back(to_seconds(*seen.first_id) * 1e3);
  }
  std::sort(delays_ms.begin(), delays_ms.end());
  // One pattern is 180 ms. Board 1 blinks so rarely that it takes more to distinguish it from a
  // lamp, and slower cameras see some slots only once.
  EXPECT_LT(delays_ms[delays_ms.size() / 2], 200.0);
  EXPECT_LT(delays_ms[delays_ms.size() * 99 / 100], 360.0);
}

TEST(IdDecoder, IsNeverWrongWithFlippedAndDroppedFrames) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  int wrong = 0;
  int identified = 0;
  int lit = 0;

  for (unsigned trial = 0; trial < 100; ++trial) {
    const auto& [id, code] = library.entries()[trial % 4];
    const Outcome seen = watch(decoder, board(code, Duration{trial * 1'777'777}, 50.0), 10s,
                               {.flip_rate = 0.02, .drop_rate = 0.05, .seed = trial});
    for (const int given : seen.ids) wrong += given != id.value ? 1 : 0;
    identified += seen.identified_frames;
    lit += seen.lit_frames;
  }

  EXPECT_EQ(wrong, 0);
  EXPECT_GT(identified, 0.9 * lit);
}

TEST(IdDecoder, TakesNoLampForARobot) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  const auto mains = [](double hz, double part) {
    return [hz, part](Duration t) {
      const double cycles = to_seconds(t) * hz;
      return cycles - std::floor(cycles) < part;
    };
  };

  for (unsigned seed = 0; seed < 20; ++seed) {
    const Camera camera{.flip_rate = 0.03, .seed = seed};
    EXPECT_TRUE(watch(
                    decoder, [](Duration) { return true; }, 20s, camera)
                    .ids.empty());
    for (const double part : {0.3, 0.6, 0.9}) {
      EXPECT_TRUE(watch(decoder, mains(100.03, part), 10s, camera).ids.empty());
      EXPECT_TRUE(watch(decoder, mains(119.96, part), 10s, camera).ids.empty());
    }
    std::mt19937 random(seed);
    EXPECT_TRUE(watch(
                    decoder, [&](Duration) { return random() % 3U > 0; }, 10s, camera)
                    .ids.empty());
  }
}

TEST(IdDecoder, DistinguishesDuties) {
  SwarmConfig swarm = four();
  swarm.members.pop_back();
  double duty = 0.2;
  for (MemberConfig& member : swarm.members) {
    member.pattern.reset();
    member.duty = duty;
    duty += 0.2;
  }
  const IdLibrary library = *IdLibrary::from(swarm);
  const IdDecoder decoder(library, VisionConfig{}, 120.0);

  for (int trial = 0; trial < 60; ++trial) {
    const auto& [id, code] = library.entries()[static_cast<std::size_t>(trial) % 3];
    const Outcome seen = watch(decoder, board(code, Duration{trial * 1'234'567}, 30.0), 2s, {});

    ASSERT_EQ(seen.ids, std::set<int>{id.value});
    EXPECT_LT(*seen.first_id, Duration{400ms});
  }
}

TEST(IdDecoder, TakesTheIdBackWhenTheTrackChangesHands) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  for (std::size_t from = 0; from < 4; ++from)
    for (std::size_t to = 0; to < 4; ++to) {
      if (from == to) continue;
      BlinkEvidence evidence;
      const auto& first = library.entries()[from];
      const auto& second = library.entries()[to];
      ASSERT_EQ(watch(decoder, board(first.code, 3ms, 0.0), 2s, {}, 10s, &evidence).last, first.id);

      const Light other = board(second.code, 47ms, 0.0);
      const Outcome soon = watch(decoder, other, 200ms, {}, 12s, &evidence);
      const Outcome later = watch(
          decoder, [&](Duration t) { return other(t + 200ms); }, 2s, {}, 12200ms, &evidence);

      EXPECT_NE(soon.last, first.id) << "a pattern and 20 ms later, " << from << " to " << to;
      EXPECT_EQ(later.last, second.id);
      EXPECT_EQ(later.ids.count(first.id.value), 0U);
    }
}

TEST(IdDecoder, KeepsTheIdThroughAShortAbsence) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  const Light light = board(library.entries()[1].code, 3ms, 20.0);

  const Outcome seen =
      watch(decoder, [&](Duration t) { return (t < 1s || t > 1120ms) && light(t); }, 1400ms, {});

  EXPECT_EQ(seen.ids, std::set<int>{2});
  EXPECT_EQ(seen.last, RobotId{2});
}

/// Frames with the ID, in 20 lit ones from `back` on, of a board that was hidden before.
int named_after(const IdDecoder& decoder, const Light& light, Duration from, Duration back,
                std::optional<RobotId> id) {
  BlinkEvidence evidence;
  (void)watch(
      decoder, [&](Duration t) { return t < from && light(t); }, back, {}, 10s, &evidence);
  int named = 0;
  int lit = 0;
  for (Duration t = back; lit < 20; t += 5ms) {
    const Outcome frame = watch(
        decoder, [&](Duration) { return light(t); }, 5ms, {}, 10s + t, &evidence);
    lit += frame.lit_frames;
    named += frame.lit_frames > 0 && frame.last == id ? 1 : 0;
  }
  return named;
}

TEST(IdDecoder, KeepsTheIdOfABoardThatWasHiddenForAMoment) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  for (const auto& [id, code] : library.entries()) {
    const Light light = board(code, 3ms, 20.0);
    for (const Duration hidden : {45ms, 60ms, 80ms, 95ms})
      EXPECT_GE(named_after(decoder, light, 2s, 2s + hidden, id), 18)
          << id.value << " after " << hidden.count();
  }
}

TEST(IdDecoder, WantsFramesThatAgreeAfterALongAbsence) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  for (const auto& [id, code] : library.entries()) {
    const int named = named_after(decoder, board(code, 3ms, 20.0), 2s, 2400ms, id);

    EXPECT_GE(named, 3) << id.value;
    EXPECT_LE(named, 12) << id.value;
  }
}

TEST(IdDecoder, KeepsTheIdOfABoardOfWhichAFrameInTenIsMissed) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  int named = 0;
  int lit = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const Light light = board(library.entries()[1 + seed % 3].code, 3ms, 20.0);
    BlinkEvidence evidence;
    (void)watch(decoder, light, 1s, {}, 10s, &evidence);
    const Outcome later = watch(
        decoder, [&](Duration t) { return light(1s + t) && random() % 10U > 0; }, 2s, {}, 11s,
        &evidence);
    named += later.identified_frames;
    lit += later.lit_frames;
  }
  EXPECT_GT(named, 0.9 * lit);
}

/// Glimpses of 90 ms, one a second, of what `light(glimpse)` says; the IDs given in each.
std::vector<std::set<int>> glimpse(const IdDecoder& decoder, int glimpses, unsigned seed,
                                   const std::function<Light(int)>& light) {
  std::vector<std::set<int>> ids;
  BlinkEvidence evidence;
  for (int i = 0; i < glimpses; ++i) {
    const Duration start = 17s + i * 1s;
    if (i > 0) decoder.resume(evidence, Timestamp{start}, 0.01);
    const Light shown = light(i);
    ids.push_back(watch(
                      decoder, [&](Duration t) { return shown(t + start); }, 90ms,
                      {.flip_rate = 0.005, .seed = seed + static_cast<unsigned>(i)}, start,
                      &evidence)
                      .ids);
  }
  return ids;
}

TEST(IdDecoder, AddsUpGlimpsesOfALightNoneOfWhichIsEnough) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  int named_at_once = 0;
  int named = 0;

  for (unsigned trial = 0; trial < 200; ++trial) {
    const auto& [id, code] = library.entries()[1 + trial % 3];
    const Light seen = board(code, Duration{trial * 3'777'777}, 50.0);
    const auto ids = glimpse(decoder, 7, 10 * trial, [&](int) { return seen; });

    for (const auto& given : ids)
      for (const int other : given) ASSERT_EQ(other, id.value) << "trial " << trial;
    named_at_once += ids.front().empty() ? 0 : 1;
    named += std::any_of(ids.begin(), ids.end(), [](const auto& g) { return !g.empty(); }) ? 1 : 0;
  }

  EXPECT_EQ(named_at_once, 0) << "half a pattern says little";
  EXPECT_GT(named, 170);
}

TEST(IdDecoder, NeverNamesAnotherLightThatAppearsWhereOneIsExpected) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  for (const int known_glimpses : {1, 4}) {
    for (unsigned trial = 0; trial < 500; ++trial) {
      const std::size_t first = 1 + trial % 3;
      const std::size_t then = 1 + (trial + 1 + trial / 3 % 2) % 3;
      const auto& [id, code] = library.entries()[then];
      const Light before = board(library.entries()[first].code, Duration{trial * 1'777'777}, 50.0);
      const Light after = board(code, Duration{trial * 7'333'333}, -50.0);
      const auto ids = glimpse(decoder, known_glimpses + 3, 10 * trial,
                               [&](int i) { return i < known_glimpses ? before : after; });

      for (std::size_t i = static_cast<std::size_t>(known_glimpses); i < ids.size(); ++i)
        for (const int given : ids[i]) ASSERT_EQ(given, id.value) << "trial " << trial;
    }
  }
}

TEST(IdDecoder, IsSoonSureOfABoardInThePhaseThatItHad) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  std::vector<Duration> delays;
  for (unsigned trial = 0; trial < 100; ++trial) {
    const auto& [id, code] = library.entries()[1 + trial % 3];
    const Light seen = board(code, Duration{trial * 1'777'777}, 80.0);
    BlinkEvidence evidence;
    (void)watch(decoder, seen, 600ms, {.seed = trial}, 17s, &evidence);
    ASSERT_EQ(decoder.id_of(evidence), id);
    decoder.resume(evidence, Timestamp{19s}, 1e-3);
    ASSERT_FALSE(decoder.id_of(evidence)) << "it has to show itself";

    const Outcome again = watch(
        decoder, [&](Duration t) { return seen(t + 2s); }, 300ms, {.seed = trial}, 19s, &evidence);
    ASSERT_EQ(again.ids, std::set<int>{id.value});
    delays.push_back(*again.first_id);
  }

  std::sort(delays.begin(), delays.end());
  EXPECT_LE(delays[delays.size() / 2], 100ms) << "a pattern is 180 ms";
}

/// A blade that hides a quarter of each turn.
Light behind_a_blade(const Light& light, double turns_hz, double phase) {
  return [light, turns_hz, phase](Duration t) {
    const double turns = to_seconds(t) * turns_hz + phase;
    return light(t) && turns - std::floor(turns) >= 0.25;
  };
}

TEST(IdDecoder, ReadsBoardsBehindAPropeller) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  int named = 0;
  int trials = 0;
  for (const double hz : {70.0, 85.0, 100.03, 120.0, 140.0, 170.0}) {
    for (unsigned trial = 0; trial < 60; ++trial) {
      const auto& [id, code] = library.entries()[1 + trial % 3];
      const Light seen = behind_a_blade(board(code, Duration{trial * 3'777'777}, 50.0), hz,
                                        0.017 * static_cast<double>(trial));
      const Outcome outcome = watch(decoder, seen, 2s, {.flip_rate = 0.005, .seed = trial});
      for (const int given : outcome.ids) ASSERT_EQ(given, id.value) << hz << " Hz, " << trial;
      named += outcome.ids.empty() ? 0 : 1;
      ++trials;
    }
  }

  EXPECT_GT(named, 0.9 * trials);
}

TEST(IdDecoder, ReadsABoardAgainOnceABladeStopsInFrontOfIt) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  const auto& [id, code] = library.entries()[2];
  const Light clear = board(code, 31ms, 50.0);
  const Light obstructed = behind_a_blade(clear, 100.03, 0.1);
  const Light seen = [&](Duration t) { return t < 2s ? obstructed(t) : clear(t); };
  BlinkEvidence evidence;

  EXPECT_EQ(watch(decoder, seen, 2s, {}, 17s, &evidence).last, id);
  EXPECT_TRUE(evidence.is_obstructed);
  const Outcome after = watch(
      decoder, [&](Duration t) { return seen(t + 2s); }, 2s, {}, 19s, &evidence);

  EXPECT_EQ(after.ids, std::set<int>{id.value});
  EXPECT_FALSE(evidence.is_obstructed);
  EXPECT_GT(after.identified_frames, 0.95 * after.lit_frames);
}

// Every second frame meets an edge and is lit if either slot is, or only if both are. With the
// frames that are missed the board goes dark more often than any.
TEST(IdDecoder, TakesNoBoardForAnotherOneBehindAPropellerWhereFramesMeetTheEdgesOfSlots) {
  const IdLibrary library = *IdLibrary::from(four());
  const IdDecoder decoder(library, VisionConfig{}, 200.0);
  for (const bool is_either : {false, true}) {
    int named = 0;
    int lit = 0;
    for (unsigned seed = 0; seed < 24; ++seed) {
      const auto& [id, code] = library.entries()[seed % 4];
      std::mt19937 random(seed);
      const Light seen = [&](Duration t) {
        const bool before = code.is_lit(t + 79'900us);
        const bool after = code.is_lit(t + 80ms);
        return (is_either ? before || after : before && after) && random() % 100U >= 8U;
      };
      const Outcome outcome = watch(decoder, seen, 20s, {});
      EXPECT_EQ(outcome.ids, std::set<int>{id.value}) << is_either << ", seed " << seed;
      named += outcome.identified_frames;
      lit += outcome.lit_frames;
    }
    EXPECT_GT(named, 0.9 * lit) << is_either;
  }
}

}  // namespace
}  // namespace crepes::id_decoder_test
