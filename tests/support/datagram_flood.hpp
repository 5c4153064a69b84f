/// Forged datagrams over loopback at a counted rate, and what the kernel had no room for.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/unique_fd.hpp"

namespace crepes {

class DatagramFlood {
 public:
  static constexpr double kRate = 100'000;  // a second
  static constexpr double kMost = 400'000;  // in all

  /// Damaged copies of `sample` to all robots at `port`; from that port as well, which is a
  /// member's address, or from another one.
  DatagramFlood(std::uint16_t port, bool from_member, std::vector<std::uint8_t> sample)
      : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
        sample_(std::move(sample)) {
    const int on = 1;
    (void)::setsockopt(fd_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    (void)::setsockopt(fd_.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof(on));
    const sockaddr_in from = address(INADDR_LOOPBACK, from_member ? port : std::uint16_t{0});
    const sockaddr_in to = address(0x7fffffff, port);
    is_open_ = ::bind(fd_.get(), any(from), sizeof(from)) == 0 &&
               ::connect(fd_.get(), any(to), sizeof(to)) == 0;
  }

  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] long sent() const { return sent_; }

  /// Sends what is due since the start.
  void send_due() {
    if (start_ == Timestamp{}) start_ = clock_.now();
    const double due = std::min(kMost, kRate * to_seconds(clock_.now() - start_));
    for (; static_cast<double>(tried_) < due; tried_ += kBatch) send_batch();
    timespec pause{.tv_sec = 0, .tv_nsec = 500'000};
    ::nanosleep(&pause, nullptr);
  }

  /// Datagrams to sockets of this port that the kernel dropped so far.
  [[nodiscard]] static long dropped(std::uint16_t port) {
    std::ifstream table("/proc/net/udp");
    std::ostringstream wanted;
    wanted << "FFFFFF7F:" << std::uppercase << std::hex << port;
    long sum = 0;
    for (std::string line; std::getline(table, line);) {
      if (line.find(wanted.str()) == std::string::npos) continue;
      std::istringstream words(line);
      std::string last;
      for (std::string word; words >> word;) last = word;
      sum += std::stol(last);
    }
    return sum;
  }

 private:
  static constexpr std::size_t kBatch = 50;

  static sockaddr_in address(std::uint32_t host, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(host);
    address.sin_port = htons(port);
    return address;
  }
  static const sockaddr* any(const sockaddr_in& address) {
    return static_cast<const sockaddr*>(static_cast<const void*>(&address));
  }

  void send_batch() {
    std::array<mmsghdr, kBatch> messages{};
    std::array<iovec, kBatch> parts{};
    std::array<std::vector<std::uint8_t>, kBatch> forged;
    for (std::size_t i = 0; i < kBatch; ++i) {
      forged.at(i) = sample_;
      forged.at(i)[random_() % sample_.size()] ^= 0x10U;
      parts.at(i) = {forged.at(i).data(), forged.at(i).size()};
      messages.at(i).msg_hdr.msg_iov = &parts.at(i);
      messages.at(i).msg_hdr.msg_iovlen = 1;
    }
    const int sent = ::sendmmsg(fd_.get(), messages.data(), kBatch, 0);
    if (sent > 0) sent_ += sent;
  }

  MonotonicClock clock_;
  UniqueFd fd_;
  std::vector<std::uint8_t> sample_;
  std::minstd_rand random_{1};
  Timestamp start_{};
  bool is_open_ = false;
  long tried_ = 0;
  std::atomic<long> sent_{0};
};

}  // namespace crepes
