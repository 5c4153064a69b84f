#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "net/subscription/subscription_json.hpp"

namespace crepes {
namespace {

using ParsedJson = nlohmann::json;

constexpr int kMaxDepth = 8;
constexpr double kMinRate = 0.01;  // Hz
constexpr double kMaxRate = 1000.0;
constexpr std::size_t kMaxCookie = 64;

struct Part {
  const char* name;
  StatusPart part;
};
constexpr std::array kParts{Part{"sensors", StatusPart::kSensors},
                            Part{"network", StatusPart::kNetwork}, Part{"team", StatusPart::kTeam},
                            Part{"pair", StatusPart::kPair}};

/// Limits the brackets outside strings before the JSON parser allocates memory for them.
bool is_nested_deeply(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
    } else if (!in_string && (c == '{' || c == '[')) {
      depth += 1;
    } else if (!in_string && (c == '}' || c == ']')) {
      depth -= 1;
    }
    if (depth > kMaxDepth) return true;
  }
  return false;
}

std::optional<RobotId> id_from(const ParsedJson& json) {
  const std::uint64_t id = json.is_number_unsigned() ? json.get<std::uint64_t>() : 0;
  if (id < 1 || id > 65534) return std::nullopt;
  return RobotId{static_cast<std::uint16_t>(id)};
}

Result<std::vector<RobotId>> read_peers(const ParsedJson& json) {
  const auto refused =
      fail(ErrorCode::kFormat, "\"peers\" must be a list of robot ids, 1 to 65534");
  if (!json.is_array()) return refused;
  std::vector<RobotId> peers;
  for (const ParsedJson& entry : json) {
    const std::optional<RobotId> id = id_from(entry);
    if (!id) return refused;
    peers.push_back(*id);
  }
  return peers;
}

Result<WatchRequest> read_watch(const ParsedJson& json) {
  WatchRequest watch;
  if (const auto enable = json.find("enable"); enable != json.end()) {
    if (!enable->is_boolean()) return fail(ErrorCode::kFormat, "\"enable\" must be true or false");
    watch.enable = enable->get<bool>();
  }
  if (const auto rate = json.find("rate_hz"); rate != json.end()) {
    const double rate_hz = rate->is_number() ? rate->get<double>() : 0.0;
    if (!(rate_hz >= kMinRate && rate_hz <= kMaxRate))
      return fail(ErrorCode::kFormat, "\"rate_hz\" must be a number from 0.01 to 1000");
    watch.rate_hz = rate_hz;
  }
  if (const auto peers = json.find("peers"); peers != json.end()) {
    auto ids = read_peers(*peers);
    if (!ids) return tl::unexpected(std::move(ids.error()));
    watch.peers = std::move(*ids);
  }
  return watch;
}

Result<PollRequest> read_poll(const ParsedJson& json) {
  PollRequest poll;
  if (const auto peer = json.find("peer"); peer != json.end()) {
    poll.peer = id_from(*peer);
    if (!poll.peer) return fail(ErrorCode::kFormat, "\"peer\" must be a robot id, 1 to 65534");
  }
  if (const auto sensor = json.find("sensor"); sensor != json.end()) {
    if (!sensor->is_string())
      return fail(ErrorCode::kFormat, "\"sensor\" must be the name of a sensor");
    poll.sensor = sensor->get<std::string>();
  }
  if (const auto about = json.find("about"); about != json.end()) {
    const auto* const part = std::ranges::find(kParts, *about, &Part::name);
    if (part == kParts.end())
      return fail(ErrorCode::kFormat, R"("about" must be "sensors", "network", "team" or "pair")");
    poll.about = part->part;
  }
  if (poll.about == StatusPart::kPair && !poll.peer)
    return fail(ErrorCode::kFormat, R"("about":"pair" needs a "peer")");
  return poll;
}

Result<std::string> read_cookie(const ParsedJson& json) {
  const auto cookie = json.find("cookie");
  if (cookie == json.end()) return std::string();
  std::string text = cookie->is_string() ? cookie->get<std::string>() : "";
  if (text.empty() || text.size() > kMaxCookie)
    return fail(ErrorCode::kFormat, "\"cookie\" must be the text that COOKIE gave");
  return text;
}

Result<decltype(SubscriptionRequest::what)> read_what(const ParsedJson& json) {
  const auto name = json.find("class");
  if (name == json.end() || !name->is_string())
    return fail(ErrorCode::kFormat, "a request has a \"class\", WATCH or POLL");
  if (*name == "WATCH") return read_watch(json);
  if (*name == "POLL") return read_poll(json);
  return fail(ErrorCode::kFormat, "unknown class, use WATCH or POLL");
}

}  // namespace

Result<SubscriptionRequest> parse_request(std::string_view datagram) {
  if (datagram.size() > kMaxSubscriptionDatagram)
    return fail(ErrorCode::kFormat, "a request has at most 1200 bytes");
  if (is_nested_deeply(datagram)) return fail(ErrorCode::kFormat, "nested too deeply");
  const ParsedJson json = ParsedJson::parse(datagram, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return fail(ErrorCode::kFormat, "not JSON");
  if (!json.is_object()) return fail(ErrorCode::kFormat, "a request is a JSON object");

  auto what = read_what(json);
  if (!what) return tl::unexpected(std::move(what.error()));
  return read_cookie(json).map([&](std::string cookie) {
    return SubscriptionRequest{std::move(*what), std::move(cookie)};
  });
}

}  // namespace crepes
