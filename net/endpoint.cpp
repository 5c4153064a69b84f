#include "net/endpoint.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

namespace crepes {
namespace {

constexpr std::array<std::uint8_t, 12> kMappedPrefix{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
constexpr std::array<std::uint8_t, 16> kLoopback6{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};

}  // namespace

bool Endpoint::is_ipv4() const {
  return std::equal(kMappedPrefix.begin(), kMappedPrefix.end(), address.begin());
}

bool Endpoint::is_any() const {
  const auto begin = address.begin() + (is_ipv4() ? kMappedPrefix.size() : 0);
  return std::all_of(begin, address.end(), [](std::uint8_t byte) { return byte == 0; });
}

bool Endpoint::is_loopback() const {
  return is_ipv4() ? address[12] == 127 : address == kLoopback6;
}

bool Endpoint::is_unicast() const {
  constexpr std::uint8_t kFirstMulticast4 = 224;  // this and above: multicast, reserved, broadcast
  constexpr std::array<std::uint8_t, 4> kLoopbackBroadcast{127, 255, 255, 255};
  if (port == 0) return false;
  if (!is_ipv4()) return address[0] != 0xFF && address != std::array<std::uint8_t, 16>{};
  const bool is_broadcast =
      std::equal(kLoopbackBroadcast.begin(), kLoopbackBroadcast.end(), &address[12]);
  return address[12] != 0 && address[12] < kFirstMulticast4 && !is_broadcast;
}

std::string Endpoint::to_string() const {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (is_ipv4()) {
    ::inet_ntop(AF_INET, &address[12], text.data(), text.size());
    return fmt::format("{}:{}", text.data(), port);
  }
  ::inet_ntop(AF_INET6, address.data(), text.data(), text.size());
  return fmt::format("[{}]:{}", text.data(), port);
}

std::optional<Endpoint> Endpoint::parse(const std::string& address, std::uint16_t port) {
  if (std::array<std::uint8_t, 4> v4{}; ::inet_pton(AF_INET, address.c_str(), v4.data()) == 1)
    return ipv4(v4, port);
  Endpoint endpoint;
  endpoint.port = port;
  if (::inet_pton(AF_INET6, address.c_str(), endpoint.address.data()) == 1) return endpoint;
  return std::nullopt;
}

Endpoint Endpoint::ipv4(const std::array<std::uint8_t, 4>& address, std::uint16_t port) {
  Endpoint endpoint;
  std::copy(kMappedPrefix.begin(), kMappedPrefix.end(), endpoint.address.begin());
  std::copy(address.begin(), address.end(), endpoint.address.begin() + kMappedPrefix.size());
  endpoint.port = port;
  return endpoint;
}

}  // namespace crepes
