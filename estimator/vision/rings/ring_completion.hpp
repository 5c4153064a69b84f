/// Completes a ring of which some LEDs are known: an arc predicts where the others are.
#pragma once

#include <cstddef>

#include "estimator/vision/ring_model.hpp"
#include "estimator/vision/rings/light_field.hpp"
#include "estimator/vision/rings/ring.hpp"

namespace crepes {

/// A view has no smaller roundness: 73 degrees aslant.
inline constexpr double kMinRingRoundness = 0.28;

/// How far LEDs are from where they should be at most, as RMS [px], for the lens and for noise.
/// `radius`: of the ring [px].
[[nodiscard]] double ring_tolerance(double radius);

/// Fits the lights of `ring` as the LEDs of `shape` from `shift` on, and searches the other LEDs.
/// Sets its view and RMS and adds the lights that are found. False if the fit is poor, if the place
/// of another LED is lit by something that is not an LED, or if more than half of the LEDs are
/// missing.
[[nodiscard]] bool complete_ring(const LightField& field, const RingShape& shape, std::size_t shift,
                                 Ring& ring);

}  // namespace crepes
