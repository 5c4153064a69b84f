/// Pictures of one daemon's cameras, over its socket for recordings.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/view/pose_history.hpp"
#include "daemon/recording/block.hpp"

namespace crepes {

/// Connected only while somebody looks. One picture is asked for at a time.
class CameraFeed {
 public:
  static constexpr std::uint8_t kMaxCameras = 8;

  /// `socket` is empty where there is none: pictures are for programs on the robot only.
  /// `can_control`: whether the page may ask to change the light, if `view.control` says so.
  CameraFeed(std::filesystem::path socket, bool can_control)
      : socket_(std::move(socket)), can_control_(can_control) {}

  /// Asks for the pictures that are due and takes what has arrived; does not wait. Returns events
  /// for the pages that show each camera.
  [[nodiscard]] std::map<std::uint8_t, std::string> exchange(
      Timestamp now, const std::vector<std::uint8_t>& wanted, const PoseHistory& poses);
  /// What a page that opens now must know.
  [[nodiscard]] std::string greeting() const;

  /// The daemon's, as long as there is a connection.
  [[nodiscard]] const std::optional<Config>& config() const { return config_; }
  [[nodiscard]] std::optional<pid_t> daemon_pid() const;

 private:
  void connect(Timestamp now);
  void hang_up(std::string reason, Timestamp now);
  void request_picture(Timestamp now, const std::vector<std::uint8_t>& wanted);
  void handle_block(const Block& block, Timestamp now, const PoseHistory& poses,
                    std::map<std::uint8_t, std::string>& events);
  [[nodiscard]] Result<void> receive(Timestamp now, const PoseHistory& poses,
                                     std::map<std::uint8_t, std::string>& events);

  std::filesystem::path socket_;
  bool can_control_;
  std::optional<BlockStream> daemon_;
  std::optional<Config> config_;
  std::string reason_;  ///< why there is no picture; empty while there are some
  Timestamp retry_at_{};
  struct Request {
    std::uint8_t camera = 0;
    Timestamp at{};
  };
  std::optional<Request> asked_;
  std::map<std::uint8_t, Timestamp> last_asked_;
  std::optional<std::string> coverage_;  ///< of a calibration that runs
  Timestamp next_coverage_{};
  std::string sent_state_;
};

}  // namespace crepes
