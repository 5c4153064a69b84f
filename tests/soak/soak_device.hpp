/// A device on a serial line that everything happens to.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/pseudo_terminal.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

enum class Mishap : std::uint8_t {
  kNone,
  kUnplugged,  ///< comes back as another terminal
  kGarbage,    ///< bytes at random instead of frames
  kStalled,    ///< says nothing
  kTorn,       ///< frames lose their ends
  kFlipped,    ///< a bit of every frame is wrong
};
inline constexpr std::array<std::string_view, 6> kMishapNames{"none",    "unplugged", "garbage",
                                                              "stalled", "torn",      "flipped"};

/// From the end of a mishap to the first measurement after it.
struct Recovery {
  Mishap mishap = Mishap::kNone;
  Duration took{};
};

/// Sends numbered frames at a rate that changes; mishaps follow each other, each some time after
/// the one before was recovered from.
class SoakDevice {
 public:
  /// The bytes of frame `number`, sent at `time_ms` by the device's own clock.
  using Frame =
      std::function<std::vector<std::uint8_t>(std::uint32_t number, std::uint32_t time_ms)>;

  /// `link` is where the line is to be found, as udev would have it.
  SoakDevice(std::filesystem::path link, std::vector<double> rates_hz, Frame frame, unsigned seed,
             Timestamp now);

  void step(Timestamp now);
  /// A measurement with this stamp came out of the daemon, which said nothing at all before
  /// `reported_since`; what it ended.
  std::optional<Recovery> heard(Timestamp stamp, Timestamp now, Timestamp reported_since = {});
  /// Whether mishaps begin.
  void stir(bool stirred) { is_calm_ = !stirred; }
  /// When it last recovered.
  [[nodiscard]] Timestamp well_since() const { return well_since_; }
  [[nodiscard]] bool is_well() const { return mishap_ == Mishap::kNone && !recovering_; }
  /// How long the last mishap is over without a measurement; empty: all is well.
  [[nodiscard]] std::optional<Duration> waiting(Timestamp now) const;
  [[nodiscard]] Mishap last_mishap() const { return last_mishap_; }

 private:
  void plug(Timestamp now);
  void begin_mishap(Timestamp now);
  void end_mishap(Timestamp now);
  void send(Timestamp now);
  [[nodiscard]] Duration between(double least_s, double most_s);

  std::filesystem::path link_;
  std::vector<double> rates_hz_;
  Frame frame_;
  std::mt19937 random_;
  std::optional<PseudoTerminal> line_;
  Timestamp plugged_{};
  Timestamp next_frame_{};
  Timestamp next_change_{};
  Timestamp over_{};  ///< when the last mishap ended
  Timestamp well_since_{};
  Duration period_{};
  std::uint32_t number_ = 0;
  Mishap mishap_ = Mishap::kNone;
  Mishap last_mishap_ = Mishap::kNone;
  bool recovering_ = true;
  bool is_calm_ = true;
};

}  // namespace crepes
