/// Data sets made from the simulated world, for tests that replay.
#pragma once

#include <filesystem>

#include "config/schema/config.hpp"

namespace crepes::test {

/// Where spots come from.
enum class SpotSource : std::uint8_t {
  kPictures,    ///< rendered and detected
  kProjection,  ///< detected, then moved to the ring's true pixel
};

struct RecordingOptions {
  SimScenario scenario = SimScenario::kTwo;
  int seed = 1;
  double duration_s = 10.0;
  SpotSource spots = SpotSource::kPictures;
  double latency_ms = 3.0;  ///< the least of a datagram
};

/// Writes a whole data set with truth to `dir`: clocks seconds apart, up to 3 ms more than the
/// latency, 2 % loss.
void record_swarm(const std::filesystem::path& dir, const RecordingOptions& options);

}  // namespace crepes::test
