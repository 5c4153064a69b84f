// Poses of a crepesd in C++: one line a pose, t_ns peer mode x y z [m, in our body's axes].
//   ./poses [ADDRESS [PORT [COUNT]]]
#include <chrono>
#include <crepes/client.hpp>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

namespace {

volatile std::sig_atomic_t is_stopped = 0;

extern "C" void stop(int /*signal*/) { is_stopped = 1; }

// Returns whether anybody reads it.
bool print(const crepes::client::Pose& pose) {
  const crepes::client::Vector& p = pose.position;
  std::printf("%lld %u %s %.6f %.6f %.6f\n", static_cast<long long>(pose.t_ns), unsigned{pose.peer},
              std::string(name_of(pose.mode)).c_str(), p.x, p.y, p.z);
  return std::fflush(stdout) == 0;
}

// A number of the command line; `otherwise` without one.
long number(int argc, char** argv, int index, long otherwise) {
  return argc > index ? std::atol(argv[index]) : otherwise;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  crepes::client::Address address;
  if (argc > 1) address.address = argv[1];
  const long port = number(argc, argv, 2, address.port);
  if (port < 1 || port > 65535) {
    std::cerr << argv[2] << " is no port, 1 to 65535\n";
    return 2;
  }
  address.port = static_cast<std::uint16_t>(port);
  long left = number(argc, argv, 3, -1);

  // The end of the connection ends the subscription, which otherwise lasts for its lease.
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, stop);
  std::signal(SIGPIPE, SIG_IGN);

  std::string fault;
  auto daemon = crepes::client::Connection::open(address, {}, fault);
  while (daemon && left != 0 && is_stopped == 0) {
    const auto answer = daemon->receive(200ms);
    if (!answer) {
      // A robot would fly on and wait: the library asks again by itself.
      if (daemon->silent_for() > 3s) {
        const std::string why = daemon->send_fault();
        fault = "no answer from " + address.address + " port " + std::to_string(address.port) +
                (why.empty() ? "" : ": " + why);
      }
    } else if (const auto* refusal = std::get_if<crepes::client::Error>(&answer->message)) {
      fault = refusal->message;
    } else if (const auto* pose = std::get_if<crepes::client::Pose>(&answer->message)) {
      if (!print(*pose)) break;
      if (left > 0) --left;
    }
    if (!fault.empty()) break;
  }
  if (!fault.empty()) std::cerr << fault << '\n';
  return fault.empty() ? 0 : 1;
}
