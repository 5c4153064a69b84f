/// Random numbers that are the same everywhere, unlike those of std's distributions.
#pragma once

#include <cstdint>
#include <random>

namespace crepes::faults {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}

  [[nodiscard]] std::uint64_t next() { return random_(); }
  [[nodiscard]] std::uint64_t below(std::uint64_t count) { return random_() % count; }
  [[nodiscard]] double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11U) * 0x1.0p-53;
  }
  [[nodiscard]] bool happens(double probability) { return between(0.0, 1.0) < probability; }

 private:
  std::mt19937_64 random_;
};

}  // namespace crepes::faults
