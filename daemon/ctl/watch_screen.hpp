/// What crepesctl watch shows, and what its keys do. Pure: keys and messages in, text out.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/ctl/daemon_client.hpp"
#include "daemon/ctl/neighbor_view.hpp"

namespace crepes {

class WatchScreen {
 public:
  enum class Order : std::uint8_t { kId, kName, kDistance, kSigma, kAge };

  /// `now` is the client's time.
  void on_message(const DaemonMessage& message, Timestamp now);
  /// q quits; s sorts by the next column; j and k (or the arrows, as ESC [ B and ESC [ A) pick a
  /// neighbor; Enter shows all about it or no longer. Other keys do nothing.
  void on_key(char key);

  [[nodiscard]] bool is_quit() const { return quit_; }
  /// Whose details are wanted, to be polled for.
  [[nodiscard]] std::optional<RobotId> wanted_details() const;
  [[nodiscard]] std::optional<Timestamp> heard() const { return heard_; }
  [[nodiscard]] bool has_status() const { return status_.has_value(); }

  /// The table; with a help line and the picked neighbor's details if `is_interactive`.
  [[nodiscard]] std::string text(Timestamp now, bool is_interactive) const;

 private:
  void take_status(const StatusMessage& status, Timestamp now);
  [[nodiscard]] std::string head(Timestamp now) const;
  [[nodiscard]] std::string name_of_robot(RobotId id) const;
  [[nodiscard]] std::vector<RobotId> ordered(Timestamp now) const;
  void pick(int step);

  std::map<RobotId, NeighborView> neighbors_;
  std::map<RobotId, std::string> names_;
  std::optional<StatusMessage> status_;
  std::optional<StatusMessage::Neighbor> details_;
  std::optional<Timestamp> heard_;
  double cpu_share_ = 0.0;
  std::string error_;
  Order order_ = Order::kId;
  std::optional<RobotId> picked_;
  Timestamp last_{};  ///< of the last message
  bool shows_details_ = false;
  bool quit_ = false;
  std::string escape_;  ///< what came of a key that sends several bytes
};

}  // namespace crepes
