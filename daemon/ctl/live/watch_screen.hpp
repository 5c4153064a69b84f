/// The screen of crepesctl watch, its keys and its help. Pure: keys and messages in, text out.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/live/neighbor_view.hpp"
#include "daemon/ctl/live/screen_text.hpp"

namespace crepes {

class WatchScreen {
 public:
  /// The column by which neighbors are sorted.
  enum class Order : std::uint8_t { kId, kName, kDistance, kSigma, kAge };

  /// `now` is the client's time.
  void handle_message(const client::Message& message, Timestamp now);
  /// q quits; ? shows the help, which any other key closes; s sorts by the next column; j and k (or
  /// the arrows, as ESC [ B and ESC [ A) pick a neighbor; Enter shows or hides its details. Other
  /// keys do nothing.
  void handle_key(char key);

  [[nodiscard]] bool should_quit() const { return quit_; }
  /// The neighbor whose details are shown.
  [[nodiscard]] std::optional<RobotId> detailed_neighbor() const;
  /// Those that must be asked for by themselves: the one with details, and all for which STATUS
  /// once had no room.
  [[nodiscard]] std::set<RobotId> polled_neighbors() const;
  [[nodiscard]] std::optional<Timestamp> last_message_time() const { return last_message_time_; }
  [[nodiscard]] bool has_status() const { return status_.has_value(); }

  /// The table. If the format is interactive, also a legend, the keys and the picked neighbor's
  /// details, or the help. No line is longer than the format has columns, if it has at least 80.
  [[nodiscard]] std::string text(Timestamp now, const ScreenFormat& format) const;

 private:
  void handle_status(const client::Status& status, Timestamp now);
  void handle_command(char key);
  [[nodiscard]] std::string head(Timestamp now, const ScreenFormat& format) const;
  [[nodiscard]] std::string table(Timestamp now, const ScreenFormat& format) const;
  [[nodiscard]] std::string foot(const ScreenFormat& format) const;
  [[nodiscard]] std::string name_of_robot(RobotId id) const;
  [[nodiscard]] std::vector<RobotId> ordered(Timestamp now) const;
  void pick(int step);

  std::map<RobotId, NeighborView> neighbors_;
  std::map<RobotId, std::string> names_;
  std::set<RobotId> left_out_;  ///< of a STATUS
  std::optional<client::Status> status_;
  std::optional<client::Status::Neighbor> details_;
  std::optional<Timestamp> last_message_time_;
  double cpu_share_ = 0.0;
  std::string error_;
  Order order_ = Order::kId;
  std::optional<RobotId> picked_;
  Timestamp last_{};  ///< of the last message
  bool shows_details_ = false;
  bool shows_help_ = false;
  bool quit_ = false;
  std::string escape_;  ///< the bytes so far of a key that sends several
};

}  // namespace crepes
