/// Noise of an IMU in motion.
#pragma once

#include <span>

#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"

namespace crepes {

/// `configured`, with the white noise that the samples show if that is more: vibration, or another
/// sensor than the configured one. By differences of this order: the higher, the less a body's own
/// motion adds. Two suit a multirotor, eight a hand, which trembles.
[[nodiscard]] ImuNoise noise_with_vibration(const ImuNoise& configured,
                                            std::span<const ImuSample> imu, int order);

}  // namespace crepes
