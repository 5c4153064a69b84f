/// A tool that records or looks, as the daemon sees it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/base/unique_fd.hpp"

namespace crepes {

inline constexpr std::string_view kRecordRequest = "RECORD 1";
inline constexpr std::string_view kPicturesRequest = "RECORD 1 pictures";
/// Followed by the index of a camera. Each such line asks for one picture.
inline constexpr std::string_view kLookRequest = "LOOK 1 ";

/// Never blocks. Its requests are at most a few short lines.
class Recipient {
 public:
  explicit Recipient(UniqueFd socket) : socket_(std::move(socket)) {}

  [[nodiscard]] int descriptor() const { return socket_.get(); }
  [[nodiscard]] bool records() const { return request_.starts_with(kRecordRequest); }
  [[nodiscard]] bool records_pictures() const { return request_ == kPicturesRequest; }
  /// The camera of which it requests a picture. Empty until the tool has read the last one.
  [[nodiscard]] std::optional<std::uint8_t> looks_at() const {
    return is_idle() ? camera_ : std::nullopt;
  }
  /// Whether it is up to date with the configuration; true afterwards.
  [[nodiscard]] bool needs_config() { return !std::exchange(is_config_sent_, true); }
  void forget_config() { is_config_sent_ = false; }

  /// Everything has been sent, so there is room for more.
  [[nodiscard]] bool is_idle() const { return sent_ == waiting_.size(); }
  void put(std::string text);
  /// The picture that it waited for.
  void put_look(std::string text);
  /// Sends the reason why it is not served; the connection ends soon.
  void refuse(std::string_view reason);

  /// Reads requests and sends what the socket accepts without blocking. Returns whether the tool is
  /// to be served further.
  [[nodiscard]] bool exchange();

 private:
  [[nodiscard]] bool read_requests();
  [[nodiscard]] bool parse_request(const std::string& line);
  [[nodiscard]] bool send_some();

  UniqueFd socket_;
  std::string received_;
  std::string request_;  ///< the first line
  std::optional<std::uint8_t> camera_;
  std::string waiting_;
  std::size_t sent_ = 0;
  bool is_config_sent_ = false;
};

}  // namespace crepes
