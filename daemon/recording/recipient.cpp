#include "daemon/recording/recipient.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>

#include "daemon/recording/block.hpp"
#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxLine = 100;

}  // namespace

void Recipient::put(std::string text) {
  if (is_idle()) {
    waiting_ = std::move(text);
    sent_ = 0;
  } else {
    waiting_ += text;
  }
}

void Recipient::put_look(std::string text) {
  camera_.reset();
  put(std::move(text));
}

void Recipient::refuse(std::string_view reason) {
  std::string block;
  append_block(block, "refused", reason);
  put(std::move(block));
  static_cast<void>(send_some());
}

bool Recipient::exchange() { return read_requests() && send_some(); }

bool Recipient::read_requests() {
  std::array<char, kMaxLine> buffer{};
  const ssize_t count = ::recv(socket_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (count == 0) return false;
  if (count < 0) return errno == EAGAIN || errno == EINTR;
  received_.append(buffer.data(), static_cast<std::size_t>(count));
  for (std::size_t end = received_.find('\n'); end != std::string::npos;
       end = received_.find('\n')) {
    const std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    if (!parse_request(line)) return false;
  }
  return received_.size() < kMaxLine;
}

/// A recording is one request, and the only one of its connection; looks are many.
bool Recipient::parse_request(const std::string& line) {
  const bool is_look = line.starts_with(kLookRequest);
  if (records() || (!is_look && !request_.empty())) return false;
  request_ = line;
  if (!is_look) return records();
  std::uint8_t camera = 0;
  if (!parse_number(std::string_view(line).substr(kLookRequest.size()), camera).empty())
    return false;
  camera_ = camera;
  return true;
}

bool Recipient::send_some() {
  while (!is_idle()) {
    const ssize_t count = ::send(socket_.get(), waiting_.data() + sent_, waiting_.size() - sent_,
                                 MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    sent_ += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace crepes
