/// The messages of the daemon on the socket of recordings, and how a tool reads them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One message: a line `KIND BYTES`, then that number of bytes.
struct Block {
  std::string kind;
  std::string content;
};

void append_block(std::string& text, std::string_view kind, std::string_view content);

/// The tool's end of the socket.
class BlockStream {
 public:
  explicit BlockStream(UniqueFd socket) : socket_(std::move(socket)) {}

  /// Sends a line. A daemon that has hung up is no error here: `receive` has its last words.
  [[nodiscard]] Result<void> request(std::string_view request);
  /// Waits at most `patience_ms` for data. Returns false once the daemon has closed the connection.
  [[nodiscard]] Result<bool> receive(int patience_ms);
  /// The next complete block, if it has arrived.
  [[nodiscard]] Result<std::optional<Block>> next();

  [[nodiscard]] int descriptor() const { return socket_.get(); }

 private:
  UniqueFd socket_;
  std::string received_;
};

}  // namespace crepes
