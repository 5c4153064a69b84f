#include "daemon/ctl/view/listen_address.hpp"

#include <fmt/core.h>

#include "drivers/base/number_text.hpp"
#include "net/endpoint.hpp"

namespace crepes {

Result<DaemonAddress> parse_address(const std::string& text, int min_port) {
  constexpr int kMaxPort = 65535;
  const std::size_t colon = text.rfind(':');
  int port = -1;
  std::string address = text.substr(0, colon);
  const bool is_bracketed = address.starts_with('[') && address.ends_with(']');
  if (is_bracketed) address = address.substr(1, address.size() - 2);
  const bool is_ambiguous = !is_bracketed && address.find(':') != std::string::npos;
  if (colon == std::string::npos || is_ambiguous || !Endpoint::parse(address, 1) ||
      !parse_number(text.substr(colon + 1), port).empty() || port < min_port || port > kMaxPort) {
    return fail(ErrorCode::kUsage,
                fmt::format("'{}' is not a numeric address and a port, as 127.0.0.1:8080 or "
                            "[::1]:8080",
                            text));
  }
  return DaemonAddress{address, static_cast<std::uint16_t>(port)};
}

std::string authority_of(const std::string& host, std::uint16_t port) {
  const bool is_ipv6 = host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", is_ipv6 ? "[" : "", host, is_ipv6 ? "]" : "", port);
}

}  // namespace crepes
