/// What the decoder promises, over thousands of simulated boards and lamps. The study in
/// tests/bench (id_study) does the same in millions.
#include <gtest/gtest.h>

#include "estimator/vision/codebook.hpp"
#include "tests/support/blinking.hpp"

namespace crepes::id_decoder_statistics_test {
namespace {

using namespace std::chrono_literals;
using test::Light;
using test::Viewing;
using test::Watcher;

class IdDecoderStatistics : public testing::Test {
 protected:
  static const IdLibrary& library() {
    static const IdLibrary kLibrary = *IdLibrary::from(test::swarm_of(
        search_codebook({.slots = 20, .distance = 4, .max_dark = 2}, 64, {.steps = 200'000})
            .patterns));
    return kLibrary;
  }
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  const IdLibrary::Entry& any_board() {
    return library().entries()[random_() % library().entries().size()];
  }
  Light light_of(const BlinkCode& code) {
    return test::board(code, from_seconds(uniform(0.0, to_seconds(code.period()))),
                       uniform(-100.0, 100.0));
  }
  static double at(std::vector<double> values, double part) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  }

  std::mt19937 random_{11};
};

TEST_F(IdDecoderStatistics, NamesThousandsOfBoardsRightDespiteFlippedAndDroppedFrames) {
  ASSERT_EQ(library().entries().size(), 64U);
  const IdDecoder decoder(library(), VisionConfig{}, 120.0);
  std::size_t wrong = 0;
  std::size_t undecided = 0;
  for (int i = 0; i < 5'000; ++i) {
    const auto& [id, code] = any_board();
    const Viewing viewing{.rate_hz = uniform(120.0, 250.0),
                          .flip_rate = 0.02,
                          .drop_rate = 0.05,
                          .exposure_ms = uniform(0.05, 2.0),
                          .least_light = uniform(0.2, 0.8)};
    Watcher watcher(decoder, viewing, random_());

    const auto decision = watcher.decide(light_of(code), 10 * code.period());

    undecided += decision.id ? 0 : 1;
    wrong += decision.id && *decision.id != id ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_LT(undecided, 5U);
}

TEST_F(IdDecoderStatistics, NeedsAboutOnePatternLengthInClearView) {
  const IdDecoder decoder(library(), VisionConfig{}, 150.0);
  std::vector<double> delays_ms;
  for (int i = 0; i < 2'000; ++i) {
    const auto& [id, code] = any_board();
    Watcher watcher(decoder, {.rate_hz = uniform(150.0, 250.0)}, random_());
    const auto decision = watcher.decide(light_of(code), 10 * code.period());
    ASSERT_EQ(decision.id, id);
    delays_ms.push_back(1e3 * to_seconds(decision.delay));
  }
  EXPECT_LT(at(delays_ms, 0.5), 200.0 + 20.0);
  EXPECT_LT(at(delays_ms, 0.99), 2.0 * 200.0);
}

TEST_F(IdDecoderStatistics, TakesNoneOfHundredsOfLampsForARobot) {
  const IdDecoder decoder(library(), VisionConfig{}, 120.0);
  const auto is_named = [&](const Light& light) {
    Watcher watcher(decoder, {.rate_hz = uniform(120.0, 250.0), .flip_rate = uniform(0.0, 0.05)},
                    random_());
    return watcher.decide(light, 2s).id.has_value();
  };
  for (int i = 0; i < 150; ++i) {
    ASSERT_FALSE(is_named([](Duration, Duration) { return 1.0; }));
    for (const double hz : {100.0, 120.0})
      ASSERT_FALSE(is_named(
          test::mains_lamp(hz * uniform(0.998, 1.002), uniform(0.1, 0.95), uniform(0.0, 1.0))));
    ASSERT_FALSE(is_named(test::Telegraph(uniform(0.012, 0.1), uniform(0.006, 0.03), random_())));
  }
}

// They go dark more often than any board, as if a propeller were in front of one.
TEST_F(IdDecoderStatistics, TakesNoLampThatFlashesOnceACycleForARobot) {
  const IdDecoder decoder(library(), VisionConfig{}, 200.0);
  for (int i = 0; i < 100; ++i) {
    for (const double hz : {50.0, 60.0}) {
      Watcher watcher(decoder, {.rate_hz = 200.0, .flip_rate = i % 2 == 0 ? 0.003 : 0.02},
                      random_());
      const Light lamp =
          test::mains_lamp(hz * uniform(0.998, 1.002), uniform(0.3, 0.6), uniform(0.0, 1.0));
      ASSERT_FALSE(watcher.decide(lamp, 10s).id.has_value()) << hz;
    }
  }
}

// Of 19,723 changes one in a thousand took longer than 1.3 patterns, and none two (tests/bench).
TEST_F(IdDecoderStatistics, TakesTheIdBackSoonWhenTheTrackChangesHands) {
  std::vector<double> periods;
  for (int i = 0; i < 1'000; ++i) {
    const Viewing viewing{.rate_hz = uniform(120.0, 250.0)};
    const IdDecoder decoder(library(), VisionConfig{}, viewing.rate_hz);
    Watcher watcher(decoder, viewing, random_());
    const auto& first = any_board();
    const auto& second = any_board();
    if (first.id == second.id) continue;
    const Light before = light_of(first.code);
    const Light after = light_of(second.code);
    const double change_s = uniform(1.0, 1.2);
    BlinkEvidence evidence;
    double last_s = change_s;
    for (double t = 0.0; t < 2.5; t += 1.0 / viewing.rate_hz) {
      const auto id = watcher.look(t < change_s ? before : after, from_seconds(t), evidence);
      if (t > change_s && id == first.id) last_s = t;
    }
    periods.push_back((last_s - change_s) / to_seconds(first.code.period()));
    ASSERT_EQ(decoder.id_of(evidence), second.id);
  }
  EXPECT_LT(at(periods, 0.5), 0.3);
  EXPECT_LE(at(periods, 0.99), 0.7);
  EXPECT_LE(std::ranges::count_if(periods, [](double p) { return p > 1.0; }), 5);
  EXPECT_LE(at(periods, 1.0), 2.0);
}

// Frame by frame, the second board looks like the first one, hidden at times.
TEST_F(IdDecoderStatistics, TakesTheIdBackWhereTheNextBoardIsLitOnlyWhereTheFirstWas) {
  const IdLibrary similar =
      *IdLibrary::from(test::swarm_of({"00101111111111111111", "00100111010111101111"}));
  const auto& first = similar.entries()[0];
  const auto& second = similar.entries()[1];
  const IdDecoder decoder(similar, VisionConfig{}, 200.0);
  for (int i = 0; i < 20; ++i) {
    Watcher watcher(decoder, {}, random_());
    const Duration phase = from_seconds(uniform(0.0, 0.2));
    const Light before = test::board(first.code, phase, 0.0);
    const Light after = test::board(second.code, phase, 0.0);
    BlinkEvidence evidence;
    double last_s = 0.0;
    for (double t = 0.0; t < 4.0; t += 0.005)
      if (watcher.look(t < 2.0 ? before : after, from_seconds(t), evidence) == first.id) last_s = t;
    EXPECT_GE(last_s, 1.9);
    EXPECT_LE(last_s, 2.0 + 2.0 * to_seconds(first.code.period()));
    EXPECT_EQ(decoder.id_of(evidence), second.id);
  }
}

TEST_F(IdDecoderStatistics, HardlyEverNamesABoardOfAnotherSwarm) {
  const IdDecoder decoder(library(), VisionConfig{}, 200.0);
  const std::vector<std::string> ours =
      search_codebook({.slots = 20, .distance = 4, .max_dark = 2}, 64, {.steps = 200'000}).patterns;
  const std::vector<std::string> theirs =
      search_codebook({.slots = 20, .distance = 4}, 64, {.seed = 77, .on_progress = {}}).patterns;
  int boards = 0;
  int named_frames = 0;
  int foreign = 0;
  for (const std::string& pattern : theirs) {
    std::vector<std::string> both = ours;
    both.push_back(pattern);
    if (!IdLibrary::from(test::swarm_of(both))) continue;  // the very code of one of ours
    ++boards;
    const BlinkCode code = *BlinkCode::from_pattern(pattern, 10ms);
    const Light light = light_of(code);
    Watcher watcher(decoder, {.flip_rate = 0.01, .exposure_ms = 0.5}, random_());
    BlinkEvidence evidence;
    bool is_foreign = false;
    for (double t = 0.0; t < 5.0; t += 0.005) {
      named_frames += watcher.look(light, from_seconds(t), evidence).has_value() ? 1 : 0;
      is_foreign = is_foreign || evidence.is_foreign;
    }
    foreign += is_foreign ? 1 : 0;
  }
  EXPECT_GT(boards, 50);
  EXPECT_LT(named_frames, boards);  // of 1000 each
  EXPECT_GT(foreign, boards / 4);   // those that are nearly as one of ours
}

TEST_F(IdDecoderStatistics, HardlyTakesAStrangerForTheBoardThatWasHidden) {
  const IdDecoder decoder(library(), VisionConfig{}, 200.0);
  int wrong_frames = 0;
  int strangers = 0;
  for (int i = 0; i < 400; ++i) {
    Watcher watcher(decoder, {.rate_hz = 200.0}, random_());
    const auto& first = any_board();
    const auto& second = any_board();
    if (first.id == second.id) continue;
    ++strangers;
    const Light before = light_of(first.code);
    const Light after = light_of(second.code);
    BlinkEvidence evidence;
    for (double t = 0.0; t < 1.0; t += 0.005) (void)watcher.look(before, from_seconds(t), evidence);
    for (double t = 1.3; t < 2.0; t += 0.005)
      wrong_frames += watcher.look(after, from_seconds(t), evidence) == first.id ? 1 : 0;
  }
  RecordProperty("wrong_frames", wrong_frames);
  RecordProperty("strangers", strangers);
  EXPECT_LT(wrong_frames, strangers / 20);  // a tenth of the strangers, half a frame each
}

TEST_F(IdDecoderStatistics, NeverNamesTheObserverItself) {
  const RobotId own = library().entries()[5].id;
  const IdDecoder decoder(library(), VisionConfig{}, 200.0, own);
  for (int i = 0; i < 50; ++i) {
    Watcher watcher(decoder, {}, random_());
    EXPECT_FALSE(watcher.decide(light_of(library().entries()[5].code), 3s).id);
  }
}

TEST_F(IdDecoderStatistics, NamesAReturningBoardSoonerAndStillNobodyElse) {
  const IdDecoder decoder(library(), VisionConfig{}, 200.0);
  const Duration frame = 5ms;
  std::vector<double> fresh_ms;
  std::vector<double> returned_ms;
  for (int i = 0; i < 500; ++i) {
    const auto& first = any_board();
    const auto& second = any_board();
    const Light light = light_of(first.code);
    const Light other = light_of(second.code);
    PhaseMemory known;
    const auto time_to_id = [&](const Light& seen, Duration from, Duration until) {
      BlinkEvidence evidence;
      std::optional<std::pair<RobotId, double>> found;
      for (Duration t = from; t < until; t += frame) {
        if (seen(t, t + 100us) < 0.5) {
          decoder.observe_dark(evidence, Timestamp{t});
          continue;
        }
        decoder.observe_lit(evidence, Timestamp{t}, known);
        decoder.update_phase(evidence, Timestamp{t}, known);
        const auto id = decoder.id_of(evidence);
        if (id && !found) found = {*id, 1e3 * to_seconds(t - from)};
      }
      return found;
    };
    const Duration back = from_seconds(uniform(2.0, 6.0));

    const auto before = time_to_id(light, 0s, 1500ms);
    const auto stranger = time_to_id(other, 1700ms, 1701ms + 2 * second.code.period());
    const auto after = time_to_id(light, back, back + 1s);

    ASSERT_TRUE(before && after);
    ASSERT_EQ(before->first, first.id);
    ASSERT_EQ(after->first, first.id);
    ASSERT_TRUE(!stranger || stranger->first == second.id);
    fresh_ms.push_back(before->second);
    returned_ms.push_back(after->second);
  }
  EXPECT_LT(at(returned_ms, 0.5), 0.75 * at(fresh_ms, 0.5));
}

TEST_F(IdDecoderStatistics, ReadsLongSlotsAtLowFrameRates) {
  const IdLibrary slow = *IdLibrary::from(
      test::swarm_of({"001001011111111111", "001010101111111111", "001011110011111111"}, 40.0));
  const IdDecoder decoder(slow, VisionConfig{}, 50.0);
  for (int i = 0; i < 300; ++i) {
    const auto& [id, code] = slow.entries()[random_() % 3U];
    Watcher watcher(decoder, {.rate_hz = 50.0}, random_());
    ASSERT_EQ(watcher.decide(light_of(code), 3 * code.period()).id, id);
  }
}

}  // namespace
}  // namespace crepes::id_decoder_statistics_test
