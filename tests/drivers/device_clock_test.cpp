#include "drivers/device_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <vector>

namespace crepes::device_clock_test {
namespace {

using namespace std::chrono_literals;

/// A device that stamps by its own counter, behind a line that delays: mostly by a few hundred
/// microseconds, sometimes by tens of milliseconds; nothing overtakes.
class Device {
 public:
  Device(unsigned seed, double skew, Duration tick = 1us, unsigned bits = 63)
      : random_(seed), skew_(skew), tick_(tick), bits_(bits) {}

  struct Stamped {
    DeviceTime stamp;
    Timestamp arrival{};
    Timestamp truth{};
  };
  Stamped measure(double t_s) {
    const double delay_s = 0.3e-3 * exponential_(random_) +
                           (uniform_(random_) < 0.03 ? 15e-3 * exponential_(random_) : 0.0);
    const Timestamp truth = kStart + from_seconds(t_s);
    last_arrival_ = std::max(last_arrival_, truth + from_seconds(delay_s));
    const double device_s = zero_s_ + t_s * (1 + skew_);
    const auto count = static_cast<std::uint64_t>(std::floor(device_s / to_seconds(tick_)));
    return {DeviceTime::ticks(count & ((std::uint64_t{1} << bits_) - 1), tick_, bits_),
            last_arrival_, truth};
  }
  void set(double device_s, double at_s) { zero_s_ = device_s - at_s * (1 + skew_); }
  void jump(double by_s) { zero_s_ += by_s; }

 private:
  static constexpr Timestamp kStart{777s};
  std::mt19937 random_;
  std::exponential_distribution<> exponential_{1.0};
  std::uniform_real_distribution<> uniform_;
  double skew_;
  Duration tick_;
  unsigned bits_;
  double zero_s_ = 5.0;
  Timestamp last_arrival_{};
};

struct Stamp {
  double t_s;
  Duration error;  ///< how late the stamp is
  Duration delay;  ///< how late the arrival was
};

/// What becomes of 200 stamps a second, in order and never after the arrival.
std::vector<Stamp> run(DeviceClock& clock, Device& device, double from_s, double to_s) {
  std::vector<Stamp> stamps;
  Timestamp last{Duration::min()};
  for (double t_s = from_s; t_s < to_s; t_s += 0.005) {
    const auto [stamp, arrival, truth] = device.measure(t_s);
    const Timestamp local = clock.to_local(stamp, arrival);
    EXPECT_LE(local, arrival) << t_s;
    EXPECT_GE(local, last) << t_s;
    last = local;
    stamps.push_back({t_s, local - truth, arrival - truth});
  }
  return stamps;
}

Duration worst(const std::vector<Stamp>& stamps, double from_s = 0.0) {
  Duration most{};
  for (const Stamp& s : stamps)
    if (s.t_s >= from_s) most = std::max(most, std::chrono::abs(s.error));
  return most;
}

TEST(DeviceClock, TakesTheLinesJitterOutOfStampsWhateverTheSkew) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Device device(seed, (seed % 2 == 0 ? 1.0 : -1.0) * 10e-6 * (seed / 2));
    DeviceClock clock;

    const auto stamps = run(clock, device, 0.0, 60.0);

    Duration latest{};
    for (const Stamp& s : stamps) latest = std::max(latest, s.delay);
    EXPECT_GT(latest, 30ms);
    EXPECT_LT(worst(stamps, 1.2), 300us);
    EXPECT_LT(worst(stamps, 20.0), 60us);
    EXPECT_EQ(clock.restarts(), 0U);
  }
}

TEST(DeviceClock, FollowsCountersThatBeginAnew) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Device device(seed, 30e-6, 1ms, 32);
    device.set(4294967.296 - 10.0, 0.0);
    DeviceClock clock;

    const auto stamps = run(clock, device, 0.0, 20.0);

    EXPECT_EQ(clock.restarts(), 0U);
    EXPECT_LT(worst(stamps, 1.2), 1300us);  // what the ticks are rounded down by, and the rest
  }
}

TEST(DeviceClock, FallsBackToArrivalsAtOnceWhenTheDeviceRestarts) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Device device(seed, -40e-6);
    DeviceClock clock;
    run(clock, device, 0.0, 10.0);
    device.set(0.0, 10.0);

    const auto stamps = run(clock, device, 10.0, 20.0);

    EXPECT_EQ(clock.restarts(), 1U);
    for (const Stamp& s : stamps) {
      if (s.t_s > 10.9) break;
      EXPECT_EQ(s.error, s.delay) << s.t_s;
    }
    EXPECT_LT(worst(stamps, 11.2), 300us);
  }
}

TEST(DeviceClock, CountsRestartsOfAllClocks) {
  Device device(1, -40e-6);
  DeviceClock clock;
  run(clock, device, 0.0, 10.0);
  device.set(0.0, 10.0);
  run(clock, device, 10.0, 20.0);

  clock.change_clock();
  device.set(0.0, 20.0);
  const auto stamps = run(clock, device, 20.0, 30.0);

  EXPECT_EQ(clock.restarts(), 1U);
  EXPECT_LT(worst(stamps, 21.2), 300us);
}

TEST(DeviceClock, SurvivesJumpsOfEverySizeInBothDirections) {
  for (const double jump_s : {-3000.0, -2.0, -0.3, -0.03, -0.007, 0.007, 0.03, 0.3, 2.0, 3000.0}) {
    SCOPED_TRACE(jump_s);
    Device device(3, 20e-6);
    device.set(10000.0, 0.0);
    DeviceClock clock;
    run(clock, device, 0.0, 10.0);
    device.jump(jump_s);

    const auto stamps = run(clock, device, 10.0, 60.0);

    for (const Stamp& s : stamps) EXPECT_GE(s.error, -10ms) << s.t_s;
    EXPECT_LT(worst(stamps, 45.0), 300us);
  }
}

TEST(DeviceClock, KeepsStampsRightThroughAStallOfOurs) {
  Device device(5, 10e-6);
  DeviceClock clock;
  run(clock, device, 0.0, 10.0);

  // Nobody reads for 0.8 s; then everything comes at once.
  const Timestamp late = device.measure(10.8).truth;
  for (double t_s = 10.005; t_s < 10.8; t_s += 0.005) {
    Device twin(5, 10e-6);
    const auto [stamp, arrival, truth] = twin.measure(t_s);
    EXPECT_LT(std::chrono::abs(clock.to_local(stamp, late) - truth), 300us);
  }
  EXPECT_LT(worst(run(clock, device, 10.805, 12.0)), 300us);
  EXPECT_EQ(clock.restarts(), 0U);
}

TEST(DeviceClock, NeverReliesOnACounterThatIsNoClock) {
  const auto stamps_off_by = [](auto counter_ns) {
    DeviceClock clock;
    Duration most{};
    for (int i = 0; i < 2000; ++i) {
      const Timestamp arrival{i * 5ms};
      const Timestamp local = clock.to_local(DeviceTime{counter_ns(i), 0}, arrival);
      most = std::max(most, std::chrono::abs(arrival - local));
    }
    return most;
  };
  std::mt19937_64 random(1);
  EXPECT_EQ(stamps_off_by([](int) { return std::uint64_t{42}; }), 0ns);              // stands still
  EXPECT_EQ(stamps_off_by([](int i) { return std::uint64_t(i) * 4000000U; }), 0ns);  // too slow
  EXPECT_EQ(stamps_off_by([](int i) { return std::uint64_t(i) * 6000000U; }), 0ns);  // too fast
  EXPECT_EQ(stamps_off_by([](int i) { return std::uint64_t(i); }), 0ns);             // no unit
  EXPECT_EQ(stamps_off_by([&](int) { return random(); }), 0ns);
}

TEST(DeviceClock, LeavesAClockThatStopsWithinASecond) {
  DeviceClock clock;
  Duration most{};
  for (int i = 0; i < 2000; ++i) {
    const auto stamp_ns = static_cast<std::uint64_t>(std::min(i, 1000)) * 5000000U;
    const Timestamp arrival{i * 5ms};
    const Timestamp local = clock.to_local(DeviceTime{stamp_ns, 0}, arrival);
    if (i > 1200) most = std::max(most, arrival - local);
  }

  EXPECT_EQ(most, 0ns);
  EXPECT_EQ(clock.restarts(), 1U);
}

TEST(DeviceClock, TakesTheArrivalWhereThereIsNoStamp) {
  DeviceClock clock;

  EXPECT_EQ(clock.to_local(std::nullopt, Timestamp{3s}), Timestamp{3s});
}

}  // namespace
}  // namespace crepes::device_clock_test
