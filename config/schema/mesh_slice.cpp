#include "config/schema/mesh_slice.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {

double report_rate_hz(const Config& config) {
  return std::min(config.net.report_rate_hz, config.estimator.output_rate_hz);
}

SendSettings send_settings(const Config& config) {
  const ImuNoise& noise = config.imu.noise;
  const double half_of_samples = 0.5 * std::sqrt(noise.update_rate);
  return {.rate_hz = report_rate_hz(config),
          .airtime_of_all = config.net.airtime_of_all,
          .broadcasts = {config.net.broadcast_mbps, config.net.broadcast_repeats},
          .gyro_step_radps = half_of_samples * noise.gyroscope_noise_density,
          .accel_step_mps2 = half_of_samples * noise.accelerometer_noise_density,
          .session_salt = 0};
}

MeshTrust mesh_trust(const Config& config) {
  MeshTrust trust;
  for (const MemberConfig& member : config.swarm.members) {
    if (member.excluded) trust.excluded.insert(member.id);
    if (member.excluded || !member.public_key) continue;
    if (const auto key = parse_public_key(*member.public_key)) trust.keys.emplace(member.id, *key);
  }
  return trust;
}

}  // namespace crepes
