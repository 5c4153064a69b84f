// Poses of a crepesd in C++: POSIX sockets and nlohmann's json.hpp, one file.
//   g++ -std=c++17 -o poses poses.cpp && ./poses [ADDRESS [PORT [COUNT]]]
// prints one line a pose: t_ns peer mode x y z [m, in our body's axes].
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

using Json = nlohmann::json;

namespace {

// A socket that speaks with this daemon and hears nobody else; -1 if there is none.
int connect_to(const char* address, const char* port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (getaddrinfo(address, port, &hints, &found) != 0) return -1;
  const int line = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool connected = line >= 0 && connect(line, found->ai_addr, found->ai_addrlen) == 0;
  freeaddrinfo(found);
  if (!connected && line >= 0) close(line);
  return connected ? line : -1;
}

void ask(int line, bool enable, const std::string& cookie) {
  Json request{{"class", "WATCH"}, {"enable", enable}};
  if (cookie.empty()) {
    request["pad"] = std::string(64, ' ');  // a daemon elsewhere answers no shorter request
  } else {
    request["cookie"] = cookie;
  }
  const std::string text = request.dump();
  (void)!send(line, text.data(), text.size(), 0);  // no daemon yet: asked again in a second
}

// The next object; null if none came for a while.
Json receive(int line) {
  pollfd ready{line, POLLIN, 0};
  char bytes[2048];
  if (poll(&ready, 1, 200) <= 0) return nullptr;
  const ssize_t size = recv(line, bytes, sizeof bytes, 0);
  return size < 0 ? Json() : Json::parse(bytes, bytes + size, nullptr, /*allow_exceptions=*/false);
}

void print(const Json& pose) {
  const Json& p = pose.at("position");
  std::printf("%s %d %s %.6f %.6f %.6f\n", pose.at("t_ns").get<std::string>().c_str(),
              pose.at("peer").get<int>(), pose.at("mode").get<std::string>().c_str(),
              p.at("x").get<double>(), p.at("y").get<double>(), p.at("z").get<double>());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  using std::chrono::seconds;
  using std::chrono::steady_clock;
  const int line = connect_to(argc > 1 ? argv[1] : "127.0.0.1", argc > 2 ? argv[2] : "47475");
  long left = argc > 3 ? std::atol(argv[3]) : -1;
  if (line < 0) return std::fputs("not a numeric address and port\n", stderr), 2;

  std::string cookie;
  steady_clock::time_point renewal{}, heard = steady_clock::now();
  while (left != 0) {
    const auto now = steady_clock::now();
    if (now - heard > seconds(3)) return std::fputs("no answer\n", stderr), 1;
    if (now >= renewal) {
      renewal = now + seconds(1);  // the lease is ten seconds: a lost datagram does not matter
      ask(line, true, cookie);
    }
    const Json message = receive(line);
    if (!message.is_object()) continue;
    heard = now;
    const std::string name = message.value("class", "");
    if (name == "COOKIE") {
      cookie = message.value("cookie", "");
      renewal = {};
    } else if (name == "ERROR") {
      return std::fprintf(stderr, "%s\n", message.value("message", "").c_str()), 1;
    } else if (name == "POSE") {
      print(message);
      if (left > 0) --left;
    }
  }
  ask(line, false, cookie);
  close(line);
}
