/// A camera that is pulled out and put back.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <random>

#include "config/schema/config.hpp"
#include "estimator/core/time.hpp"
#include "tests/support/gige_camera.hpp"

namespace crepes {

/// A GigE Vision camera on loopback; a folder of pictures where this process may not have a network
/// of its own.
class SoakCamera {
 public:
  /// Moves this thread to that network. `folder` is made.
  SoakCamera(std::filesystem::path folder, unsigned seed);

  [[nodiscard]] CameraConfig config() const;
  [[nodiscard]] bool is_gige() const { return is_gige_; }

  void step(Timestamp now);
  /// The daemon says that pictures come; how long they took to return, if they were away.
  std::optional<Duration> heard(Timestamp now);
  void stir(bool stirred) { is_calm_ = !stirred; }
  [[nodiscard]] bool is_well() const { return !is_away_ && !recovering_; }
  [[nodiscard]] std::optional<Duration> waiting(Timestamp now) const;

 private:
  void plug();
  void unplug();
  void write_pictures() const;
  [[nodiscard]] Duration between(double least_s, double most_s);

  std::filesystem::path folder_;
  std::mt19937 random_;
  bool is_gige_ = false;
  std::unique_ptr<GigeCamera> gige_;
  std::optional<Timestamp> over_;  ///< when it was put back
  Timestamp next_change_{};
  bool is_away_ = true;
  bool recovering_ = true;
  bool is_calm_ = true;
};

}  // namespace crepes
