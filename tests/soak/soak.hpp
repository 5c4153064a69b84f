/// A robot whose devices fail all the time.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/core/time.hpp"
#include "tests/soak/soak_device.hpp"

namespace crepes {

struct SoakPlan {
  Duration duration{};
  Duration warm_up{};  ///< memory is compared with what it is then
  Duration give_up{};  ///< a device that has not recovered by then ends the run
  unsigned seed = 1;
};

struct SoakReport {
  struct PerMishap {
    std::uint64_t count = 0;
    Duration longest{};  ///< until the first measurement after it
  };
  std::array<PerMishap, kMishapNames.size()> mishaps;
  std::uint64_t samples = 0;  ///< of the inertial sensor, as the daemon passed them on
  std::uint64_t ranges = 0;
  bool camera_is_gige = false;
  std::uint64_t pictures_returned = 0;  ///< recoveries of the camera
  Duration longest_camera{};
  std::string wrong;  ///< the first value that was never sent; empty: none
  std::string stuck;  ///< the device that did not recover; empty: all did
  std::size_t descriptors_before = 0;
  std::size_t descriptors_after = 0;
  std::size_t memory_before_kb = 0;  ///< resident
  std::size_t memory_after_kb = 0;

  [[nodiscard]] Duration longest() const;
};

/// One daemon in this process, its inertial sensor and ranging module on pseudo-terminals, its
/// camera on GigE Vision (a folder where that may not be): unplugged, stalled, torn, at random by
/// `seed`. What the daemon makes of it is read off its reports to peers and its STATUS.
[[nodiscard]] SoakReport run_soak(const SoakPlan& plan);

[[nodiscard]] std::string to_string(const SoakReport& report);

}  // namespace crepes
