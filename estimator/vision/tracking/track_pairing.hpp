/// Which track each spot of a frame belongs to.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimator/vision/assignment.hpp"
#include "estimator/vision/id_decoder.hpp"
#include "estimator/vision/tracking/light_sighting.hpp"
#include "estimator/vision/tracking/light_track.hpp"

namespace crepes {

/// The probability that a track's light is lit, while its code is unknown.
inline constexpr double kUnknownLit = 0.8;
/// Below this probability of being lit, a board counts as dark.
inline constexpr double kLeastLit = 0.3;

/// Pairs the tracks of lights with the sightings of one frame. It keeps its memory from frame to
/// frame.
class TrackPairing {
 public:
  /// The sighting of each track, for those that have one.
  using Pairs = std::vector<std::optional<std::size_t>>;

  /// The pairing of the greatest likelihood. The tracks are predicted to the frame; the sightings
  /// are ordered by direction. Valid until the next call.
  [[nodiscard]] const Pairs& pair(std::span<const LightTrack> tracks,
                                  std::span<const LightSighting> sightings,
                                  const IdDecoder& decoder, double gate_px);

 private:
  Assignment assignment_;
  std::vector<PairBenefit> benefits_;
};

/// Whether another board that may well be lit has no spot of its own but could be in that of
/// `track`.
[[nodiscard]] bool hides_another(std::size_t track, std::span<const LightTrack> tracks,
                                 std::span<const LightSighting> sightings,
                                 const TrackPairing::Pairs& sighting_of, const IdDecoder& decoder);

}  // namespace crepes
