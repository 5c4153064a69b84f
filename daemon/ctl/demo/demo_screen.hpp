/// The table of crepesctl demo, its keys and its help. Pure: keys and numbers in, text out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/live/screen_text.hpp"

namespace crepes {

/// One ordered pair at one instant.
struct DemoRow {
  /// The newest pose against the truth; sigmas in the worst direction.
  struct Known {
    std::string mode;
    double range_m;
    double error_m;
    double error_deg;
    double sigma_m;
    double sigma_deg;
    double age_ms;
  };
  std::string pair;
  std::optional<Known> known;
  std::string reason;                    ///< why nothing is known
  std::optional<double> first_pose_s{};  ///< after the daemons' start
};

class DemoScreen {
 public:
  /// q ends the demo; ? shows the help, which any other key closes.
  void handle_key(char key);
  [[nodiscard]] bool should_quit() const { return quit_; }

  /// `head` above the table, or the help. No line is longer than the format has columns, if it has
  /// at least 80; `head` is the caller's.
  [[nodiscard]] std::string text(const std::string& head, const std::vector<DemoRow>& rows,
                                 const ScreenFormat& format) const;

 private:
  bool shows_help_ = false;
  bool quit_ = false;
};

}  // namespace crepes
