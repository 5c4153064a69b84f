// How often and how fast the decoder is right, over simulated boards and lamps in big numbers.
//   id_study decisions [N]   wrong IDs with 2 % of the frames flipped and 5 % dropped
//   id_study latency [N]     time from first light to ID in clean conditions, by size of library
//   id_study lamps [N]       IDs given to sources that are no boards
//   id_study hands [N]       time until a track that changed hands has lost its ID
//   id_study foreign [N]     IDs given to boards of other libraries, N boards of 20 s each
//   id_study cameras [N]     time from first light to ID by frame rate and slot
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "estimator/vision/codebook.hpp"
#include "tests/support/blinking.hpp"

namespace crepes {
namespace {

using test::Light;
using test::Viewing;
using test::Watcher;

struct Setup {
  CodebookRules rules;
  std::size_t ids = 64;
  double slot_ms = 10.0;
};

/// As crepesctl codebook finds it: for the default rules and 64 ids, the library in config/.
IdLibrary library_of(const Setup& setup) {
  const Codebook book = search_codebook(setup.rules, setup.ids);
  return *IdLibrary::from(test::swarm_of(book.patterns, setup.slot_ms));
}

double uniform(std::mt19937& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

struct Tally {
  std::size_t decisions = 0;
  std::size_t wrong = 0;
  std::size_t undecided = 0;
  std::vector<double> periods;  ///< delays, in pattern lengths
  std::vector<double> over_ms;  ///< delays beyond one pattern length

  void print(const char* name) {
    std::sort(periods.begin(), periods.end());
    std::sort(over_ms.begin(), over_ms.end());
    const auto at = [](const std::vector<double>& v, double q) {
      return v.empty() ? 0.0 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
    };
    std::printf("%-34s %9zu %6zu %9zu   %+7.1f ms  %5.2f %5.2f %5.2f %5.2f\n", name, decisions,
                wrong, undecided, at(over_ms, 0.5), at(periods, 0.5), at(periods, 0.9),
                at(periods, 0.99), at(periods, 1.0));
    std::fflush(stdout);
  }
};

void print_header() {
  std::printf("%-34s %9s %6s %9s   %10s  %5s %5s %5s %5s\n", "", "decisions", "wrong", "undecided",
              "median-1T", "p50/T", "p90/T", "p99/T", "max/T");
}

/// Boards of `library` at rates of [from_hz, to_hz].
Tally decide(const IdLibrary& library, const Viewing& faults, double from_hz, double to_hz,
             std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  Tally tally;
  std::optional<IdDecoder> decoder;
  for (std::size_t i = 0; i < n; ++i) {
    Viewing viewing = faults;
    viewing.rate_hz = uniform(random, from_hz, to_hz);
    viewing.exposure_ms = uniform(random, 0.05, faults.exposure_ms);
    viewing.least_light = uniform(random, 0.2, 0.8);
    if (!decoder) decoder.emplace(library, VisionConfig{}, from_hz);
    const auto& [id, code] = library.entries()[random() % library.entries().size()];
    const double period_s = to_seconds(code.period());
    const Light light =
        test::board(code, from_seconds(uniform(random, 0.0, period_s)), uniform(random, -100, 100));
    Watcher watcher(*decoder, viewing, random());
    const auto decision = watcher.decide(light, 10 * code.period());
    ++tally.decisions;
    if (!decision.id) {
      ++tally.undecided;
      continue;
    }
    if (*decision.id != id) ++tally.wrong;
    tally.periods.push_back(to_seconds(decision.delay) / period_s);
    tally.over_ms.push_back(1e3 * (to_seconds(decision.delay) - period_s));
  }
  return tally;
}

void study_decisions(std::size_t n) {
  const Viewing faults{.flip_rate = 0.02, .drop_rate = 0.05, .exposure_ms = 2.0};
  std::printf("2 %% flipped, 5 %% dropped, exposures up to 2 ms, any phase, +-100 ppm\n");
  print_header();
  unsigned seed = 1;
  const IdLibrary library = library_of({});
  for (const auto& [from, to] : {std::pair{120, 160}, {160, 200}, {200, 250}}) {
    char name[64];
    std::snprintf(name, sizeof name, "64 ids, 20 slots, %d..%d Hz", from, to);
    decide(library, faults, from, to, n / 5, seed++).print(name);
  }
  for (const auto& [ids, slots, slot_ms] : {std::tuple{2U, 8U, 10.0},
                                            {8U, 12U, 10.0},
                                            {16U, 16U, 10.0},
                                            {64U, 32U, 10.0},
                                            {64U, 20U, 20.0}}) {
    char name[64];
    std::snprintf(name, sizeof name, "%u ids, %u slots of %.0f ms, 120..250 Hz", ids, slots,
                  slot_ms);
    decide(library_of({{.slots = slots}, ids, slot_ms}), faults, 120, 250, n * 2 / 25, seed++)
        .print(name);
  }
}

void study_latency(std::size_t n) {
  std::printf("no faults, exposures up to 1 ms, any phase, +-100 ppm\n");
  print_header();
  const Viewing clean{.exposure_ms = 1.0};
  for (const auto& [ids, slots, distance] : {std::tuple{2U, 8U, 2U},
                                             {4U, 12U, 4U},
                                             {8U, 14U, 4U},
                                             {16U, 16U, 4U},
                                             {32U, 18U, 4U},
                                             {64U, 20U, 4U},
                                             {64U, 24U, 6U},
                                             {64U, 32U, 8U},
                                             {128U, 22U, 4U}}) {
    const IdLibrary library = library_of({{.slots = slots, .distance = distance}, ids});
    for (const auto& [from, to] :
         {std::pair{120, 125}, {125, 160}, {160, 195}, {200, 200}, {205, 250}}) {
      char name[64];
      std::snprintf(name, sizeof name, "%zu ids, %u slots, distance %u, %d..%d Hz",
                    library.entries().size(), slots, distance, from, to);
      decide(library, clean, from, to, n, ids + slots).print(name);
    }
  }
}

void study_lamps(std::size_t n) {
  const IdLibrary library = library_of({});
  std::mt19937 random(7);
  const IdDecoder decoder(library, VisionConfig{}, 120.0);
  const auto count = [&](const char* name, const std::function<Light()>& draw) {
    std::size_t named = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Viewing viewing{.rate_hz = uniform(random, 120, 250),
                            .flip_rate = uniform(random, 0, 0.05)};
      Watcher watcher(decoder, viewing, random());
      named += watcher.decide(draw(), std::chrono::seconds{5}).id ? 1 : 0;
    }
    std::printf("%-40s %8zu lamps of 5 s: %zu taken for robots\n", name, n, named);
    std::fflush(stdout);
  };
  count("steady", [] { return Light([](Duration, Duration) { return 1.0; }); });
  for (const double hz : {50.0, 60.0, 100.0, 120.0})
    count(("flashes at " + std::to_string(std::lround(hz)) + " Hz").c_str(), [&, hz] {
      return test::mains_lamp(hz * uniform(random, 0.998, 1.002), uniform(random, 0.1, 0.95),
                              uniform(random, 0, 1));
    });
  count("random telegraph", [&] {
    return Light(test::Telegraph(std::exp(uniform(random, std::log(0.01), std::log(0.3))),
                                 std::exp(uniform(random, std::log(0.005), std::log(0.05))),
                                 random()));
  });
  count("random telegraph, as quick as boards", [&] {
    return Light(
        test::Telegraph(uniform(random, 0.012, 0.03), uniform(random, 0.006, 0.015), random()));
  });
}

/// A board's track that goes on with another's light.
void study_hands(std::size_t n) {
  const IdLibrary library = library_of({});
  std::mt19937 random(9);
  for (const auto& [from_hz, to_hz, flips] : {std::tuple{120.0, 125.0, 0.0},
                                              {200.0, 200.0, 0.0},
                                              {120.0, 250.0, 0.0},
                                              {120.0, 250.0, 0.02}}) {
    std::vector<double> periods;
    std::size_t frames = 0;
    std::size_t kept = 0;
    std::size_t passed_on = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Viewing viewing{
          .rate_hz = uniform(random, from_hz, to_hz), .flip_rate = flips, .drop_rate = 2.5 * flips};
      const IdDecoder decoder(library, VisionConfig{}, viewing.rate_hz);
      Watcher watcher(decoder, viewing, random());
      const auto& first = library.entries()[random() % library.entries().size()];
      const auto& second = library.entries()[random() % library.entries().size()];
      if (first.id == second.id) continue;
      const Light before = test::board(first.code, from_seconds(uniform(random, 0, 0.2)), 0.0);
      const Light after = test::board(second.code, from_seconds(uniform(random, 0, 0.2)), 0.0);
      BlinkEvidence evidence;
      const double change_s = uniform(random, 2.0, 2.2);
      double last_s = change_s;
      for (double t = 0.0; t < 5.0; t += 1.0 / viewing.rate_hz) {
        const auto id = watcher.look(t < change_s ? before : after, from_seconds(t), evidence);
        if (t > 1.0 && t < change_s && evidence.last_lit) {
          frames += evidence.pending_dark.empty() ? 1 : 0;
          kept += id == first.id ? 1 : 0;
        }
        if (t > change_s && id == first.id) last_s = t;
      }
      passed_on += decoder.id_of(evidence) == second.id ? 1 : 0;
      periods.push_back((last_s - change_s) / to_seconds(first.code.period()));
    }
    std::sort(periods.begin(), periods.end());
    std::printf(
        "%3.0f..%3.0f Hz, %2.0f %% flipped: %zu tracks lost the ID after (pattern lengths) "
        "p50 %.2f p90 %.2f p99 %.2f p99.9 %.2f max %.2f; %zu have the new one; before: %.2f %% of "
        "lit frames named\n",
        from_hz, to_hz, 100.0 * flips, periods.size(), periods[periods.size() / 2],
        periods[periods.size() * 9 / 10], periods[periods.size() * 99 / 100],
        periods[periods.size() * 999 / 1000], periods.back(), passed_on,
        100.0 * static_cast<double>(kept) / static_cast<double>(frames));
    std::fflush(stdout);
  }
}

/// One board of another library in clear view at 200 Hz, for 20 s.
struct ForeignBoard {
  std::size_t ids = 0;           ///< so often it was given one of ours
  std::size_t named_frames = 0;  ///< so long it kept it
};

constexpr double kWatched_s = 20.0;

ForeignBoard watch_foreign(const IdDecoder& decoder, const BlinkCode& code, std::mt19937& random) {
  const Viewing viewing{.flip_rate = uniform(random, 0.0, 0.01), .exposure_ms = 0.5};
  const Light light =
      test::board(code, from_seconds(uniform(random, 0.0, 0.5)), uniform(random, -100, 100));
  Watcher watcher(decoder, viewing, random());
  ForeignBoard seen;
  BlinkEvidence evidence;
  bool was_named = false;
  for (double t = 0.0; t < kWatched_s; t += 1.0 / viewing.rate_hz) {
    static_cast<void>(watcher.look(light, from_seconds(t), evidence));
    const bool is_named = IdDecoder::is_identified(evidence);
    seen.named_frames += is_named ? 1 : 0;
    seen.ids += is_named && !was_named ? 1 : 0;
    was_named = is_named;
  }
  return seen;
}

void study_foreign(std::size_t n) {
  const std::vector<std::string> patterns = search_codebook({}, 64).patterns;
  const IdLibrary ours = *IdLibrary::from(test::swarm_of(patterns));
  const auto is_one_of_ours = [&](const std::string& pattern) {
    std::vector<std::string> both = patterns;
    both.push_back(pattern);
    return !IdLibrary::from(test::swarm_of(both));
  };
  std::printf("%-36s %9s %9s %8s %8s %12s\n", "boards of", "boards", "board s", "IDs", "named s",
              "IDs / 1e4 s");
  for (const double max_false_robot : {1e-5, 1e-8, 1e-10})
    for (const auto& [slots, distance, slot_ms] : {std::tuple{16U, 4U, 10.0},
                                                   {18U, 4U, 10.0},
                                                   {20U, 4U, 10.0},
                                                   {22U, 4U, 10.0},
                                                   {24U, 6U, 10.0},
                                                   {20U, 4U, 8.0}}) {
      Codebook book = search_codebook({.slots = slots, .distance = distance}, 64,
                                      {.seed = 77, .on_progress = {}});
      // What blinks the very code of one of ours is one of ours.
      if (slot_ms == 10.0) std::erase_if(book.patterns, is_one_of_ours);
      const IdLibrary theirs = *IdLibrary::from(test::swarm_of(book.patterns, slot_ms));
      std::mt19937 random(slots);
      VisionConfig config;
      config.max_false_robot = max_false_robot;
      const IdDecoder decoder(ours, config, 200.0);
      ForeignBoard sum;
      for (std::size_t i = 0; i < n / 6; ++i) {
        const auto& code = theirs.entries()[random() % theirs.entries().size()].code;
        const ForeignBoard one = watch_foreign(decoder, code, random);
        sum.ids += one.ids;
        sum.named_frames += one.named_frames;
      }
      const double board_s = kWatched_s * static_cast<double>(n / 6);
      char name[64];
      std::snprintf(name, sizeof name, "%u slots of %.0f ms, max_false %.0e", slots, slot_ms,
                    max_false_robot);
      std::printf("%-36s %9zu %9.0f %8zu %8.1f %12.2f\n", name, n / 6, board_s, sum.ids,
                  static_cast<double>(sum.named_frames) / 200.0,
                  1e4 * static_cast<double>(sum.ids) / board_s);
      std::fflush(stdout);
    }
}

/// Slots of two frames, or a little more, before cameras of any rate.
void study_cameras(std::size_t n) {
  std::printf("64 ids of 20 slots, exposures up to 1 ms, 1 %% flipped, any phase, +-100 ppm\n");
  print_header();
  const Viewing seen{.flip_rate = 0.01, .exposure_ms = 1.0};
  for (const auto& [rate_hz, slot_ms] : {std::pair{30.0, 67.0},
                                         {30.0, 70.0},
                                         {50.0, 40.0},
                                         {60.0, 33.0},
                                         {60.0, 40.0},
                                         {90.0, 22.0},
                                         {90.0, 25.0},
                                         {120.0, 17.0},
                                         {120.0, 20.0},
                                         {160.0, 12.5},
                                         {200.0, 10.0},
                                         {250.0, 8.0}}) {
    const IdLibrary library = library_of({.rules = {}, .ids = 64, .slot_ms = slot_ms});
    char name[64];
    std::snprintf(name, sizeof name, "%.0f Hz, slots of %.1f ms", rate_hz, slot_ms);
    decide(library, seen, rate_hz, rate_hz, n, 3).print(name);
  }
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto n = [&](std::size_t otherwise) {
    return argc > 2 ? static_cast<std::size_t>(std::atoll(argv[2])) : otherwise;
  };
  if (what == "decisions")
    crepes::study_decisions(n(1'000'000));
  else if (what == "latency")
    crepes::study_latency(n(4'000));
  else if (what == "lamps")
    crepes::study_lamps(n(20'000));
  else if (what == "hands")
    crepes::study_hands(n(5'000));
  else if (what == "foreign")
    crepes::study_foreign(n(6'000));
  else if (what == "cameras")
    crepes::study_cameras(n(4'000));
  else
    return std::fprintf(stderr,
                        "usage: id_study decisions|latency|lamps|hands|foreign|cameras [N]\n"),
           2;
  return 0;
}
