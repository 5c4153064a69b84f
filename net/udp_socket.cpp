#include "net/udp_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

/// The conversion between address families that the sockets interface requires.
const sockaddr* as_sockaddr(const void* address) { return static_cast<const sockaddr*>(address); }

sockaddr_in to_ipv4(const Endpoint& endpoint) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  std::memcpy(&address.sin_addr, &endpoint.address[12], sizeof(address.sin_addr));
  return address;
}

sockaddr_in6 to_ipv6(const Endpoint& endpoint) {
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_port = htons(endpoint.port);
  address.sin6_scope_id = endpoint.scope;
  std::memcpy(&address.sin6_addr, endpoint.address.data(), endpoint.address.size());
  return address;
}

Endpoint to_endpoint(const sockaddr_storage& storage) {
  if (storage.ss_family == AF_INET) {
    sockaddr_in address{};
    std::memcpy(&address, &storage, sizeof(address));
    return Endpoint::ipv4(std::bit_cast<std::array<std::uint8_t, 4>>(address.sin_addr.s_addr),
                          ntohs(address.sin_port));
  }
  sockaddr_in6 address{};
  std::memcpy(&address, &storage, sizeof(address));
  Endpoint endpoint;
  std::memcpy(endpoint.address.data(), &address.sin6_addr, endpoint.address.size());
  endpoint.scope = address.sin6_scope_id;
  endpoint.port = ntohs(address.sin6_port);
  return endpoint;
}

/// Calls `use(address, length)` with the endpoint as the sockaddr of its family.
template <class Use>
auto with_sockaddr(const Endpoint& endpoint, Use use) {
  if (endpoint.is_ipv4()) {
    const sockaddr_in address = to_ipv4(endpoint);
    return use(as_sockaddr(&address), socklen_t{sizeof(address)});
  }
  const sockaddr_in6 address = to_ipv6(endpoint);
  return use(as_sockaddr(&address), socklen_t{sizeof(address)});
}

std::string_view advice_for(int error) {
  switch (error) {
    case EADDRINUSE:
      return "; another program holds the port: stop it or choose another port";
    case EADDRNOTAVAIL:
      return "; this machine does not have the address: check the interface and the config";
    case EACCES:
      return "; ports below 1024 need privileges: choose a higher one";
    case ENETUNREACH:
    case ENETDOWN:
    case ENODEV:
      return "; the interface is down or has lost its address: see `ip address`";
    default:
      return "";
  }
}

tl::unexpected<Error> fail_errno(const std::string& what, int error) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}{}", what, std::generic_category().message(error),
                                          advice_for(error)));
}

struct FreeInterfaces {
  void operator()(ifaddrs* list) const { ::freeifaddrs(list); }
};

in_addr_t ipv4_of(const sockaddr* address) {
  sockaddr_in ipv4{};
  std::memcpy(&ipv4, address, sizeof(ipv4));
  return ipv4.sin_addr.s_addr;
}

/// An address that was given without a broadcast address (`ip address add` without `brd`) has its
/// own there; all hosts of its network are reached all the same.
std::optional<in_addr_t> broadcast_of(const ifaddrs& entry) {
  if ((entry.ifa_flags & IFF_BROADCAST) == 0 || entry.ifa_netmask == nullptr) return std::nullopt;
  const in_addr_t own = ipv4_of(entry.ifa_addr);
  const in_addr_t of_network = own | ~ipv4_of(entry.ifa_netmask);
  if (of_network == own) return std::nullopt;  // a network of one host
  const in_addr_t given = entry.ifa_broadaddr == nullptr ? 0 : ipv4_of(entry.ifa_broadaddr);
  return given == 0 || given == own ? of_network : given;
}

/// What recvmsg and sendmsg say of a datagram beside its bytes: room for one address.
struct Ancillary {
  alignas(cmsghdr) std::array<std::uint8_t, CMSG_SPACE(sizeof(in6_pktinfo))> bytes{};
};

/// This machine's address that a datagram was sent to, or by which its network is reached. Empty
/// unless the socket was asked for it.
std::optional<Endpoint> destination_of(msghdr& message, std::uint16_t port) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level == IPPROTO_IP && part->cmsg_type == IP_PKTINFO) {
      in_pktinfo info{};
      std::memcpy(&info, CMSG_DATA(part), sizeof(info));
      return Endpoint::ipv4(std::bit_cast<std::array<std::uint8_t, 4>>(info.ipi_spec_dst.s_addr),
                            port);
    }
    if (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_PKTINFO) {
      in6_pktinfo info{};
      std::memcpy(&info, CMSG_DATA(part), sizeof(info));
      if (IN6_IS_ADDR_MULTICAST(&info.ipi6_addr)) return std::nullopt;
      Endpoint endpoint;
      std::memcpy(endpoint.address.data(), &info.ipi6_addr, endpoint.address.size());
      if (IN6_IS_ADDR_LINKLOCAL(&info.ipi6_addr)) endpoint.scope = info.ipi6_ifindex;
      endpoint.port = port;
      return endpoint;
    }
  }
  return std::nullopt;
}

template <class Info>
void append_source(msghdr& message, Ancillary& room, int level, int type, const Info& info) {
  message.msg_control = room.bytes.data();
  message.msg_controllen = CMSG_SPACE(sizeof(info));
  cmsghdr* const part = CMSG_FIRSTHDR(&message);
  part->cmsg_level = level;
  part->cmsg_type = type;
  part->cmsg_len = CMSG_LEN(sizeof(info));
  std::memcpy(CMSG_DATA(part), &info, sizeof(info));
}

/// Makes a datagram leave from this address.
void set_source(msghdr& message, Ancillary& room, const Endpoint& from) {
  if (from.is_ipv4()) {
    in_pktinfo info{};
    info.ipi_spec_dst = to_ipv4(from).sin_addr;
    append_source(message, room, IPPROTO_IP, IP_PKTINFO, info);
  } else {
    in6_pktinfo info{};
    info.ipi6_addr = to_ipv6(from).sin6_addr;
    info.ipi6_ifindex = from.scope;
    append_source(message, room, IPPROTO_IPV6, IPV6_PKTINFO, info);
  }
}

int set_option(int fd, int level, int option) {
  const int on = 1;
  return ::setsockopt(fd, level, option, &on, sizeof(on));
}

}  // namespace

Result<UdpSocket> UdpSocket::open(const Endpoint& address, std::string name, bool broadcast) {
  const int family = address.is_ipv4() ? AF_INET : AF_INET6;
  UdpSocket socket(UniqueFd(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
                   std::move(name));
  if (!socket.fd_) return fail_errno(socket.name_, errno);
  // As large as the kernel allows, twice its default: it holds a burst while the thread is busy.
  constexpr int kBuffer = 1 << 20;
  (void)::setsockopt(socket.fd_.get(), SOL_SOCKET, SO_RCVBUF, &kBuffer, sizeof(kBuffer));
  // Without its interface, nothing may leave by a gateway, unnoticed.
  const bool ready =
      (!broadcast || (set_option(socket.fd_.get(), SOL_SOCKET, SO_REUSEADDR) == 0 &&
                      set_option(socket.fd_.get(), SOL_SOCKET, SO_BROADCAST) == 0 &&
                      set_option(socket.fd_.get(), SOL_SOCKET, SO_DONTROUTE) == 0)) &&
      (family == AF_INET || set_option(socket.fd_.get(), IPPROTO_IPV6, IPV6_V6ONLY) == 0) &&
      (!address.is_any() ||
       (family == AF_INET ? set_option(socket.fd_.get(), IPPROTO_IP, IP_PKTINFO)
                          : set_option(socket.fd_.get(), IPPROTO_IPV6, IPV6_RECVPKTINFO)) == 0) &&
      with_sockaddr(address, [&](const sockaddr* to, socklen_t length) {
        return ::bind(socket.fd_.get(), to, length) == 0;
      });
  if (!ready) return fail_errno(socket.name_, errno);

  sockaddr_storage bound{};
  socklen_t length = sizeof(bound);
  if (::getsockname(socket.fd_.get(), static_cast<sockaddr*>(static_cast<void*>(&bound)),
                    &length) != 0)
    return fail_errno(socket.name_, errno);
  socket.local_ = to_endpoint(bound);
  return socket;
}

Result<Endpoint> UdpSocket::broadcast_address(const std::string& interface, std::uint16_t port) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return fail_errno("interfaces", errno);
  const std::unique_ptr<ifaddrs, FreeInterfaces> owner(list);

  bool exists = false;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (interface != entry->ifa_name) continue;
    exists = true;
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_UP) == 0)
      return fail(ErrorCode::kIo, fmt::format("{}: interface is down; see `ip link`", interface));
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0) return Endpoint::ipv4({127, 255, 255, 255}, port);
    if ((entry->ifa_flags & IFF_RUNNING) == 0) {
      return fail(ErrorCode::kIo,
                  fmt::format("{}: interface has no carrier; is its cable plugged in, or its radio "
                              "part of the mesh? See `ip link`",
                              interface));
    }
    const std::optional<in_addr_t> broadcast = broadcast_of(*entry);
    if (!broadcast) {
      return fail(ErrorCode::kIo,
                  fmt::format("{}: interface cannot broadcast; name another", interface));
    }
    return Endpoint::ipv4(std::bit_cast<std::array<std::uint8_t, 4>>(*broadcast), port);
  }
  if (!exists) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{}: no such interface; `ip link` lists them", interface));
  }
  return fail(
      ErrorCode::kIo,
      fmt::format("{}: interface has no IPv4 address; give it one, see `ip address`", interface));
}

Result<UdpSocket> UdpSocket::open_broadcast(const std::string& interface, std::uint16_t port) {
  // A socket bound to the broadcast address receives nothing else. If the system allows it, also
  // nothing that comes to that address by another interface.
  auto socket = broadcast_address(interface, port).and_then([&](const Endpoint& address) {
    return open(address, fmt::format("{} ({})", interface, address.to_string()), true);
  });
  if (socket) {
    (void)::setsockopt(socket->fd_.get(), SOL_SOCKET, SO_BINDTODEVICE, interface.c_str(),
                       static_cast<socklen_t>(interface.size()));
  }
  return socket;
}

Result<UdpSocket> UdpSocket::bind(const std::string& address, std::uint16_t port) {
  const std::optional<Endpoint> endpoint = Endpoint::parse(address, port);
  if (!endpoint)
    return fail(ErrorCode::kConfig, fmt::format("{}: not a numeric IPv4 or IPv6 address", address));
  return open(*endpoint, endpoint->to_string(), false);
}

Result<void> UdpSocket::broadcast(std::span<const std::uint8_t> bytes) {
  return send_to(bytes, local_);
}

Result<void> UdpSocket::send_to(std::span<const std::uint8_t> bytes, const Endpoint& to,
                                const std::optional<Endpoint>& from) {
  CREPES_EXPECT(fd_, "the socket was moved away");
  const ssize_t sent = with_sockaddr(to, [&](const sockaddr* address, socklen_t length) {
    if (!from)
      return ::sendto(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, address, length);
    // The structures of sendmsg are not const; it changes nothing.
    iovec content{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
    msghdr message{};
    message.msg_name = const_cast<sockaddr*>(address);
    message.msg_namelen = length;
    message.msg_iov = &content;
    message.msg_iovlen = 1;
    Ancillary room;
    set_source(message, room, *from);
    return ::sendmsg(fd_.get(), &message, MSG_NOSIGNAL);
  });
  if (sent >= 0) return {};
  const int error = errno;
  auto failed = fail_errno(fmt::format("{}: send to {}", name_, to.to_string()), error);
  if (error == EAGAIN || error == ENOBUFS) failed.value().code = ErrorCode::kBusy;
  return failed;
}

Result<std::optional<Datagram>> UdpSocket::receive(std::chrono::milliseconds timeout) {
  CREPES_EXPECT(fd_, "the socket was moved away");
  if (timeout.count() > 0) {  // otherwise recvfrom alone reports that nothing is available
    pollfd ready{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    const int count = ::poll(&ready, 1, static_cast<int>(timeout.count()));
    if (count < 0 && errno != EINTR) return fail_errno(name_, errno);
    if (count <= 0) return std::nullopt;
  }

  Datagram datagram;
  datagram.bytes.resize(kMaxDatagram);
  sockaddr_storage from{};
  iovec content{datagram.bytes.data(), datagram.bytes.size()};
  Ancillary room;
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof(from);
  message.msg_iov = &content;
  message.msg_iovlen = 1;
  message.msg_control = room.bytes.data();
  message.msg_controllen = room.bytes.size();
  const ssize_t received = ::recvmsg(fd_.get(), &message, 0);
  if (received < 0) {
    if (errno == EAGAIN || errno == EINTR) return std::nullopt;
    return fail_errno(fmt::format("{}: receive", name_), errno);
  }
  datagram.bytes.resize(static_cast<std::size_t>(received));
  datagram.from = to_endpoint(from);
  datagram.to = destination_of(message, local_.port);
  return datagram;
}

}  // namespace crepes
