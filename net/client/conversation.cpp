#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "net/client/client.hpp"

namespace crepes::client {
namespace {

using Json = nlohmann::json;
using Seconds = std::chrono::duration<double>;

/// Far below the lease of ten seconds: a lost datagram does not matter.
constexpr Seconds kRenewal{1.0};
constexpr Seconds kSilence{2.0};

Conversation::Time after(Conversation::Time time, Seconds period) {
  return time + std::chrono::duration_cast<Conversation::Time::duration>(period);
}

std::string without_brace(const Json& request) {
  std::string text = request.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.pop_back();
  return text;
}

std::string watch_request(const Requests& requests) {
  Json request{{"class", "WATCH"}, {"enable", true}};
  if (requests.rate_hz) request["rate_hz"] = *requests.rate_hz;
  if (!requests.peers.empty()) request["peers"] = requests.peers;
  return without_brace(request);
}

std::string poll_request(const Poll& poll) {
  Json request{{"class", "POLL"}};
  if (poll.peer) request["peer"] = *poll.peer;
  if (!poll.about.empty()) request["about"] = poll.about;
  if (!poll.sensor.empty()) request["sensor"] = poll.sensor;
  return without_brace(request);
}

std::string unwatch_request() { return without_brace({{"class", "WATCH"}, {"enable", false}}); }

/// The cookie, if this is one: the proof that a remote daemon wants in every further request.
std::optional<std::string> cookie_in(std::string_view datagram) {
  const Json json = Json::parse(datagram, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || json.value("class", Json()) != "COOKIE") return std::nullopt;
  const Json cookie = json.value("cookie", Json());
  if (!cookie.is_string()) return std::nullopt;
  return cookie.get<std::string>();
}

}  // namespace

void Conversation::ask(const Requests& requests) {
  if (requests.watch) once_.clear();  // else the end of the poses may still have to be sent
  if (is_watching_ && !requests.watch) once_.push_back(unwatch_request());
  is_watching_ = requests.watch;
  retry_ = Seconds(requests.retry_s);
  periodic_.clear();
  if (requests.watch) periodic_.push_back({watch_request(requests), renewal_, Time{}});
  for (const Poll& poll : requests.polls)
    periodic_.push_back({poll_request(poll), Seconds(poll.period_s), Time{}});
}

/// Polls that are rarer than the silence are answered as rarely.
bool Conversation::is_silent(Time now) const {
  constexpr double kLate = 1.5;
  Seconds patience(kSilence);
  if (!periodic_.empty()) {
    const auto often =
        std::min_element(periodic_.begin(), periodic_.end(),
                         [](const Periodic& a, const Periodic& b) { return a.period < b.period; });
    patience = std::max(patience, kLate * often->period);
  }
  return !heard_ || now - *heard_ > patience;
}

std::vector<std::string> Conversation::due(Time now) {
  std::vector<std::string> datagrams;
  for (const std::string& request : std::exchange(once_, {}))
    datagrams.push_back(signed_with_cookie(request));
  for (Periodic& periodic : periodic_) {
    if (now < periodic.due) continue;
    const Seconds period = is_silent(now) ? std::min(periodic.period, retry_) : periodic.period;
    periodic.due = after(now, period);
    datagrams.push_back(signed_with_cookie(periodic.request));
  }
  return datagrams;
}

Conversation::Time Conversation::next_due() const {
  if (!once_.empty()) return Time{};
  const auto next =
      std::min_element(periodic_.begin(), periodic_.end(),
                       [](const Periodic& a, const Periodic& b) { return a.due < b.due; });
  return next == periodic_.end() ? Time::max() : next->due;
}

/// A daemon elsewhere sends no cookie in reply to a request that is shorter. Any request may need
/// that answer: a cookie expires, and a daemon that restarts accepts no older one.
std::string Conversation::signed_with_cookie(const std::string& request) const {
  constexpr std::size_t kCookieAnswer = 64;
  const std::string padded = request + R"(,"pad":")" + std::string(kCookieAnswer, ' ') + '"';
  return cookie_.empty() ? padded + "}" : padded + R"(,"cookie":)" + Json(cookie_).dump() + "}";
}

std::optional<Answer> Conversation::take(std::string datagram, Time now) {
  std::optional<Message> message = parse(datagram);
  if (message) {
    heard_ = now;
    if (const auto* version = std::get_if<Version>(&*message)) {
      version_ = *version;
      renew_within(version->lease_s);
    }
    std::optional<Answer> answer(std::in_place);
    answer->message = std::move(*message);
    answer->text = std::move(datagram);
    return answer;
  }
  const std::optional<std::string> cookie = cookie_in(datagram);
  if (!cookie) {
    ++malformed_;
  } else if (*cookie != cookie_) {  // a second one is an answer to what was sent before the first
    cookie_ = *cookie;
    for (Periodic& periodic : periodic_) periodic.due = now;
  }
  return std::nullopt;
}

void Conversation::renew_within(double lease_s) {
  if (!is_watching_ || !(lease_s > 0.0)) return;
  renewal_ = std::min(kRenewal, Seconds(lease_s) / 4);
  Periodic& watch = periodic_.front();
  watch.period = renewal_;
  watch.due = std::min(watch.due, after(*heard_, renewal_));
}

std::optional<std::string> Conversation::farewell() const {
  if (!is_watching_) return std::nullopt;
  return signed_with_cookie(unwatch_request());
}

}  // namespace crepes::client
