/// What parsers of IMUs read, and what tests expect of it.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "drivers/imu/imu_reading.hpp"
#include "estimator/core/measurements.hpp"
#include "tests/support/frame_damage.hpp"

namespace crepes::test {

/// The three numbers of an array.
inline Eigen::Vector3d vector_of(const nlohmann::json& values) {
  return {values[0].get<double>(), values[1].get<double>(), values[2].get<double>()};
}

inline void expect_sample(const ImuReading& reading, const Eigen::Vector3d& gyro_radps,
                          const Eigen::Vector3d& accel_mps2) {
  EXPECT_EQ(reading.verdict, ImuVerdict::kSample);
  EXPECT_LT((reading.gyro_radps - gyro_radps).norm(), 1e-6);
  EXPECT_LT((reading.accel_mps2 - accel_mps2).norm(), 1e-5);
}

inline void expect_time(const ImuReading& reading, std::uint64_t ticks, Duration tick) {
  ASSERT_TRUE(reading.time);
  EXPECT_EQ(reading.time->ns, ticks * static_cast<std::uint64_t>(tick.count()));
}

/// How many samples a stream has.
template <class Parser>
std::size_t samples_in(Parser& parser, const std::vector<std::uint8_t>& stream,
                       Timestamp arrival = {}) {
  std::size_t samples = 0;
  for (const auto& frame : decode<Parser>(stream))
    parser.parse(frame, arrival, [&](const ImuSample&) { ++samples; });
  return samples;
}

}  // namespace crepes::test
