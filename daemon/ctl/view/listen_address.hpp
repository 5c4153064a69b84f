/// An address and a port in one word, as options give them.
#pragma once

#include <string>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// "127.0.0.1:8080", "[::1]:8080". Addresses are numeric. `min_port` is 1, or 0 where that means a
/// free one.
[[nodiscard]] Result<DaemonAddress> parse_address(const std::string& text, int min_port);

/// For a URL: an IPv6 address in brackets.
[[nodiscard]] std::string authority_of(const std::string& host, std::uint16_t port);

}  // namespace crepes
