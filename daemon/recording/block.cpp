#include "daemon/recording/block.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxBlock = std::size_t{1} << 26;

tl::unexpected<Error> failure() {
  return fail(ErrorCode::kIo, "recording: " + std::generic_category().message(errno));
}

}  // namespace

void append_block(std::string& text, std::string_view kind, std::string_view content) {
  text += fmt::format("{} {}\n", kind, content.size());
  text.append(content);
}

Result<void> BlockStream::request(std::string_view request) {
  const std::string line = std::string(request) + '\n';
  const bool is_sent = ::send(socket_.get(), line.data(), line.size(), MSG_NOSIGNAL) >= 0;
  // A daemon that has hung up may have said why, which can still be received.
  if (!is_sent && errno != EPIPE) return failure();
  return {};
}

Result<bool> BlockStream::receive(int patience_ms) {
  pollfd watched{socket_.get(), POLLIN, 0};
  if (::poll(&watched, 1, patience_ms) <= 0) return true;
  constexpr std::size_t kChunk = 1 << 16;
  std::array<char, kChunk> chunk{};
  const ssize_t count = ::recv(socket_.get(), chunk.data(), chunk.size(), 0);
  if (count < 0 && errno != EINTR) return failure();
  if (count > 0) received_.append(chunk.data(), static_cast<std::size_t>(count));
  return count != 0;
}

Result<std::optional<Block>> BlockStream::next() {
  constexpr std::size_t kMaxHead = 64;
  const std::size_t end = received_.find('\n');
  if (end == std::string::npos && received_.size() <= kMaxHead) return std::nullopt;
  const std::string head = received_.substr(0, std::min(end, kMaxHead));
  const std::size_t space = head.find(' ');
  std::size_t size = 0;
  const bool is_head =
      space != std::string::npos && parse_number(head.substr(space + 1), size).empty();
  if (!is_head || size > kMaxBlock) return fail(ErrorCode::kFormat, "no crepesd speaks there");
  if (received_.size() - end - 1 < size) return std::nullopt;
  Block block{head.substr(0, space), received_.substr(end + 1, size)};
  received_.erase(0, end + 1 + size);
  return block;
}

}  // namespace crepes
