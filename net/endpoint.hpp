/// The source or destination of a datagram: an IPv4 or IPv6 address and a UDP port.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>

namespace crepes {

/// IPv4 addresses are stored as IPv4-mapped IPv6 (::ffff:a.b.c.d), so that all compare alike.
struct Endpoint {
  std::array<std::uint8_t, 16> address{};
  std::uint32_t scope = 0;  ///< interface of a link-local IPv6 address, 0 for others
  std::uint16_t port = 0;

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the 0 behind <=> for a pointer
  auto operator<=>(const Endpoint&) const = default;

  [[nodiscard]] bool is_ipv4() const;
  /// 0.0.0.0 or ::, all addresses of a machine.
  [[nodiscard]] bool is_any() const;
  /// From this machine: 127.0.0.0/8 or ::1.
  [[nodiscard]] bool is_loopback() const;
  /// False for broadcast and multicast addresses and for port 0. The broadcast address of a
  /// network is not known here; sockets refuse it.
  [[nodiscard]] bool is_unicast() const;
  /// "127.0.0.1:47475" or "[::1]:47475".
  [[nodiscard]] std::string to_string() const;

  /// Parses a numeric address. Empty for anything else: names are never resolved.
  [[nodiscard]] static std::optional<Endpoint> parse(const std::string& address,
                                                     std::uint16_t port);
  [[nodiscard]] static Endpoint ipv4(const std::array<std::uint8_t, 4>& address,
                                     std::uint16_t port);
};

}  // namespace crepes
