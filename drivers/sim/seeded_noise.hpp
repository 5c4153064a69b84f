/// Random numbers as a function of key and index, so that processes agree on them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

namespace crepes {

/// An unlimited sequence of random numbers, addressed by index: equal keys yield equal sequences.
/// Hashed with SplitMix64 (Steele, Lea, Flood 2014).
class SeededNoise {
 public:
  SeededNoise(std::initializer_list<std::uint64_t> key) {
    for (const std::uint64_t part : key) state_ = mix(state_ ^ mix(part));
  }

  /// In (0, 1).
  [[nodiscard]] double uniform(std::uint64_t index) const {
    return (static_cast<double>(mix(state_ + index * kGolden) >> 11) + 0.5) * 0x1p-53;
  }

  /// Zero mean, unit variance (Box-Muller).
  [[nodiscard]] double gaussian(std::uint64_t index) const {
    return std::sqrt(-2.0 * std::log(uniform(2 * index))) *
           std::cos(2.0 * std::numbers::pi * uniform(2 * index + 1));
  }

  /// Three independent Gaussians.
  [[nodiscard]] Eigen::Vector3d gaussian3(std::uint64_t index) const {
    return {gaussian(3 * index), gaussian(3 * index + 1), gaussian(3 * index + 2)};
  }

 private:
  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15U;

  static constexpr std::uint64_t mix(std::uint64_t x) {
    x += kGolden;
    x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31U);
  }

  std::uint64_t state_ = 0;
};

}  // namespace crepes
