#include "net/subscription/subscription_service.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

namespace crepes::subscription_service_test {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};
constexpr RobotId kNeighbor{2};
const Endpoint kLocal = Endpoint::ipv4({127, 0, 0, 1}, 40000);
const Endpoint kRemote = Endpoint::ipv4({10, 0, 0, 7}, 40000);

SystemStatus some_status() {
  SystemStatus status;
  status.self = RobotId{1};
  status.estimator.neighbors.resize(1);
  status.estimator.neighbors[0].neighbor = kNeighbor;
  status.sensors.resize(1);
  status.sensors[0].name = "imu";
  return status;
}

class Service : public ::testing::Test {
 protected:
  std::optional<std::string> answer(const Endpoint& client, const std::string& request,
                                    Timestamp now = kStart) {
    return service_.answer(client, request, now);
  }
  Json json_answer(const Endpoint& client, const std::string& request, Timestamp now = kStart) {
    const auto text = answer(client, request, now);
    return text ? Json::parse(*text) : Json{{"class", "nothing"}};
  }
  /// The cookie that a remote client receives on request.
  std::string cookie_of(const Endpoint& client, Timestamp now = kStart) {
    return json_answer(client, padded("WATCH"), now).value("cookie", "");
  }
  static std::string padded(const std::string& name, const std::string& cookie = "") {
    return Json{{"class", name},
                {"cookie", cookie.empty() ? "none" : cookie},
                {"pad", std::string(60, ' ')}}
        .dump();
  }
  std::uint64_t count(const std::string& name) const {
    const auto totals = service_.counters();
    return std::map<std::string, std::uint64_t>(totals.begin(), totals.end()).at(name);
  }
  std::size_t subscribers(Timestamp now = kStart) {
    return service_.deliveries(kNeighbor, now, now).size();
  }

  SubscriptionService service_{SubscriptionConfig{}, "1.2.3", some_status,
                               HashKey{7, 1, 8, 2, 8, 1, 8, 2, 8, 4, 5, 9, 0, 4, 5, 2}};
};

TEST_F(Service, RepliesToThisMachineImmediately) {
  EXPECT_EQ(json_answer(kLocal, R"({"class":"WATCH"})")["class"], "VERSION");
  EXPECT_EQ(json_answer(kLocal, R"({"class":"POLL"})")["class"], "STATUS");
  EXPECT_EQ(subscribers(), 1U);
}

TEST_F(Service, SendsNothingToRemoteClientsBeforeTheirCookie) {
  EXPECT_EQ(json_answer(kRemote, padded("WATCH"))["class"], "COOKIE");
  EXPECT_EQ(json_answer(kRemote, padded("POLL"))["class"], "COOKIE");
  EXPECT_EQ(subscribers(), 0U);

  const std::string cookie = cookie_of(kRemote);

  EXPECT_EQ(json_answer(kRemote, R"({"class":"WATCH","cookie":")" + cookie + "\"}")["class"],
            "VERSION");
  EXPECT_EQ(json_answer(kRemote, R"({"class":"POLL","cookie":")" + cookie + "\"}")["class"],
            "STATUS");
  EXPECT_EQ(subscribers(), 1U);
}

TEST_F(Service, NeverRepliesToAnUnverifiedClientWithMoreThanItsRequest) {
  const std::string long_watch = padded("WATCH");
  for (std::size_t size = 0; size <= long_watch.size(); ++size) {
    // Truncated or whole, garbage or request: each from an unknown address.
    const auto host = static_cast<std::uint8_t>(size + 1);
    for (const std::string& request :
         {long_watch.substr(0, size), std::string(size, '['),
          R"({"class":"POLL","pad":")" + std::string(size, ' ') + "\"}"}) {
      const auto text =
          answer(Endpoint::ipv4({10, 0, 1, host}, 4000), request, kStart + seconds{size});
      EXPECT_LE(text ? text->size() : 0, request.size());
    }
  }
}

TEST_F(Service, DoesNotReplyToAShortRemoteRequest) {
  EXPECT_FALSE(answer(kRemote, R"({"class":"WATCH"})").has_value());
  EXPECT_FALSE(answer(kRemote, "?").has_value());
}

TEST_F(Service, AcceptsACookieOnlyFromItsClient) {
  const std::string cookie = cookie_of(kRemote);
  const Endpoint thief = Endpoint::ipv4({10, 0, 0, 8}, kRemote.port);

  EXPECT_EQ(json_answer(thief, padded("WATCH", cookie))["class"], "COOKIE");
  EXPECT_EQ(subscribers(), 0U);
}

TEST_F(Service, SendsANewCookieWhenTheOldOneHasExpired) {
  const std::string old = cookie_of(kRemote);
  const Timestamp later = kStart + seconds{150};

  const Json answer = json_answer(kRemote, padded("WATCH", old), later);
  ASSERT_EQ(answer["class"], "COOKIE");
  EXPECT_EQ(json_answer(kRemote, padded("WATCH", answer["cookie"]), later)["class"], "VERSION");
}

TEST_F(Service, LetsNoUnverifiedClientEndASubscription) {
  const std::string cookie = cookie_of(kRemote);
  ASSERT_EQ(json_answer(kRemote, padded("WATCH", cookie))["class"], "VERSION");

  (void)answer(kRemote, R"({"class":"WATCH","enable":false,"pad":"                        "})");

  EXPECT_EQ(subscribers(), 1U);
}

TEST_F(Service, NeverRepliesToAddressesThatAreNoHost) {
  const std::string watch = padded("WATCH");
  Endpoint multicast6 = kLocal;
  multicast6.address.fill(0);
  multicast6.address[0] = 0xFF;
  multicast6.address[15] = 1;

  for (const Endpoint& forged :
       {Endpoint::ipv4({127, 0, 0, 1}, 0), Endpoint::ipv4({10, 0, 0, 7}, 0),
        Endpoint::ipv4({255, 255, 255, 255}, 4000), Endpoint::ipv4({127, 255, 255, 255}, 4000),
        Endpoint::ipv4({224, 0, 0, 1}, 4000), Endpoint::ipv4({239, 255, 255, 250}, 1900),
        Endpoint::ipv4({0, 0, 0, 0}, 4000), multicast6, Endpoint{.port = 4000}})
    EXPECT_FALSE(answer(forged, watch).has_value()) << forged.to_string();
  EXPECT_EQ(count("requests_unanswerable"), 9U);
}

TEST_F(Service, NeverRepliesToItselfOrAnotherDaemon) {
  EXPECT_FALSE(answer(Endpoint::ipv4({127, 0, 0, 1}, 47475), "garbage").has_value());
  EXPECT_FALSE(answer(Endpoint::ipv4({10, 0, 0, 2}, 47475), padded("WATCH")).has_value());
}

TEST_F(Service, DropsRequestsInExcessUnreadAndCountsThem) {
  std::size_t bytes = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto text = answer(kLocal, R"({"class":"POLL"})", kStart + Duration{10'000LL * i});
    bytes += text ? text->size() : 0;
  }

  // A burst of 100, and a second at 50; both buckets keep part of a token.
  EXPECT_NEAR(count("requests"), 149.0, 1.0);
  EXPECT_EQ(count("requests_in_excess"), 100'000 - count("requests"));
  EXPECT_LE(bytes, 150 * kMaxSubscriptionDatagram);
}

TEST_F(Service, RenewsASubscriptionInTheMiddleOfAFlood) {
  ASSERT_EQ(json_answer(kLocal, R"({"class":"WATCH"})")["class"], "VERSION");
  const auto flood = [&](Timestamp now) {
    for (int port = 1024; port < 40'000; ++port)
      (void)answer(Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(port)), "{}", now);
  };

  for (int second = 1; second <= 30; ++second) {
    const Timestamp now = kStart + seconds{second};
    flood(now);
    EXPECT_EQ(json_answer(kLocal, R"({"class":"WATCH"})", now)["class"], "VERSION");
  }
  EXPECT_EQ(subscribers(kStart + seconds{30}), 1U);
}

TEST_F(Service, RenewsASubscriptionWhileOthersForgeItsAddress) {
  const std::string cookie = cookie_of(kRemote);
  const auto renew = [&](Timestamp now) {
    return json_answer(kRemote, padded("WATCH", cookie), now)["class"];
  };
  ASSERT_EQ(renew(kStart), "VERSION");

  for (int second = 1; second <= 30; ++second) {
    const Timestamp now = kStart + seconds{second};
    for (int i = 0; i < 1000; ++i) (void)answer(kRemote, padded("WATCH", "0123456789abcdef"), now);
    EXPECT_EQ(renew(now), "VERSION");
  }
  EXPECT_EQ(subscribers(kStart + seconds{30}), 1U);
}

TEST_F(Service, ServesALightUserDuringFloodsFromItsAddress) {
  const auto local = [](int port) {
    return Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(port));
  };
  const auto flood = [&](Timestamp now) {
    for (int i = 0; i < 6400; ++i)
      (void)answer(local(30'000 + i % 64), R"({"class":"WATCH"})", now + Duration{i * 10'000LL});
  };
  flood(kStart);
  ASSERT_EQ(subscribers(kStart + milliseconds{64}), 4U);
  const std::uint64_t before = count("requests");

  for (int tick = 1; tick <= 100; ++tick) {
    const Timestamp now = kStart + tick * milliseconds{100};
    if (tick % 20 == 0) {
      EXPECT_EQ(json_answer(kLocal, R"({"class":"WATCH"})", now)["class"], "VERSION") << tick;
    }
    flood(now);
  }

  // A client that was replaced and returns gains nothing: 500 a second, and 50 for each of four.
  EXPECT_LT(count("requests") - before, 10 * (500 + 4 * 50) + 4 * 100 + 200);
}

TEST_F(Service, ReportsOneNeighborInFullAndRefusesTheUnknown) {
  EXPECT_EQ(json_answer(kLocal, R"({"class":"POLL","peer":2})")["neighbors"][0]["peer"], 2);
  EXPECT_EQ(json_answer(kLocal, R"({"class":"POLL","peer":9})")["class"], "ERROR");
}

TEST_F(Service, ReportsOneSensorAndRefusesTheUnknown) {
  EXPECT_EQ(json_answer(kLocal, R"({"class":"POLL","sensor":"imu"})")["sensors"][0]["name"], "imu");
  EXPECT_EQ(json_answer(kLocal, R"({"class":"POLL","sensor":"cam9"})")["message"],
            "\"sensor\" is no sensor of this robot");
}

TEST_F(Service, SendsOneErrorASecondAtMost) {
  EXPECT_EQ(json_answer(kLocal, "garbage")["class"], "ERROR");
  EXPECT_FALSE(answer(kLocal, "garbage", kStart + milliseconds{900}).has_value());
  EXPECT_EQ(json_answer(kLocal, "garbage", kStart + milliseconds{1000})["class"], "ERROR");
}

}  // namespace
}  // namespace crepes::subscription_service_test
