#include "net/client/client.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "net/subscription/subscription_json.hpp"
#include "net/subscription/subscription_service.hpp"
#include "net/udp_socket.hpp"

namespace crepes::client::client_test {
namespace {

using namespace std::chrono_literals;

NeighborPose a_pose() {
  NeighborPose pose;
  pose.neighbor = RobotId{3};
  pose.stamp = Timestamp{Duration{1'234'567'890'123'456'789}};
  pose.mode = PoseMode::kGraph;
  pose.T_B_N.pose = {{1.0, -2.0, 3.0}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5)};
  pose.T_B_N.covariance = Eigen::Matrix<double, 6, 1>(1, 2, 3, 4, 5, 6).asDiagonal();
  pose.T_B_N.covariance(0, 5) = pose.T_B_N.covariance(5, 0) = 0.5;
  pose.age_s = 0.25;
  pose.up_B = Eigen::Vector3d(0.6, 0.0, 0.8);
  return pose;
}

TEST(ClientMessages, ReadWhatTheDaemonWrites) {
  const auto pose = std::get<Pose>(parse(pose_json(7, RobotId{1}, "r3", a_pose())).value());

  EXPECT_EQ(pose.self, 1);
  EXPECT_EQ(pose.peer, 3);
  EXPECT_EQ(pose.name, "r3");
  EXPECT_EQ(pose.seq, 7U);
  EXPECT_EQ(pose.t_ns, 1'234'567'890'123'456'789);  // to the nanosecond, although JSON has doubles
  EXPECT_EQ(pose.mode, Mode::kGraph);
  EXPECT_EQ(pose.position.y, -2.0);
  EXPECT_NEAR(pose.orientation.x, -0.5, 1e-9);
  ASSERT_TRUE(pose.covariance);
  const auto P = matrix_of(*pose.covariance);
  EXPECT_EQ(P[5][0], 0.5);
  EXPECT_EQ(P[0][5], 0.5);
  EXPECT_EQ(P[3][3], 4.0);
  EXPECT_EQ(P[1][2], 0.0);
  EXPECT_EQ(pose.age_s, 0.25);
  ASSERT_TRUE(pose.up);
  EXPECT_EQ(pose.up->z, 0.8);
}

TEST(ClientMessages, ReadTheReasonWhereThereIsNoPose) {
  SystemStatus status;
  status.self = RobotId{1};
  status.name = "r1";
  status.sensors = {{.name = "imu",
                     .rate_hz = 99.5,
                     .ok = false,
                     .message = "unplugged",
                     .totals = {.faults = {{"stuck", 3}}, .counts = {{"samples", 500}}}}};
  status.clocks = {{.peer = RobotId{2}, .offset_s = -17.5, .skew_ppm = 3.0, .sigma_s = 1e-4}};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.name = "r2";
  neighbor.reason = NoPoseReason::kNoRange;
  status.estimator.neighbors = {neighbor};

  const auto read = std::get<Status>(parse(status_json(status)).value());

  EXPECT_EQ(read.self, 1);
  ASSERT_EQ(read.neighbors.size(), 1U);
  EXPECT_EQ(read.neighbors[0].reason, "no range");
  EXPECT_EQ(read.neighbors[0].state, "none");
  ASSERT_EQ(read.sensors.size(), 1U);
  EXPECT_EQ(read.sensors[0].message, "unplugged");
  EXPECT_EQ(read.sensors[0].rate_hz, 99.5);
  EXPECT_FALSE(read.sensors[0].ok);
  EXPECT_EQ(read.sensors[0].faults, (Status::Totals{{"stuck", 3}}));
  EXPECT_EQ(read.sensors[0].counts, (Status::Totals{{"samples", 500}}));
  ASSERT_EQ(read.clocks.size(), 1U);
  EXPECT_EQ(read.clocks[0].offset_s, -17.5);
}

TEST(ClientMessages, DistinguishAClockWithoutARateFromAPerfectOne) {
  SystemStatus status;
  for (std::uint16_t id = 2; id <= 12; ++id) {
    NeighborStatus& neighbor = status.estimator.neighbors.emplace_back();
    neighbor.neighbor = RobotId{id};
    neighbor.name = "a-rather-long-name";
    status.clocks.push_back(
        {.peer = RobotId{id}, .offset_s = 1.5, .skew_ppm = 3.0, .sigma_s = 1e-4});
  }

  const auto of_all = std::get<Status>(parse(status_json(status)).value());
  const auto of_one = std::get<Status>(parse(peer_status_json(status, RobotId{2}).value()).value());

  ASSERT_EQ(of_all.clocks.size(), 11U);
  EXPECT_EQ(of_all.clocks[0].skew_ppm, std::nullopt);
  EXPECT_EQ(of_all.clocks[0].sigma_s, std::nullopt);
  ASSERT_EQ(of_one.clocks.size(), 1U);
  EXPECT_EQ(of_one.clocks[0].skew_ppm, 3.0);
}

TEST(ClientMessages, ReadAllAboutOneNeighbor) {
  SystemStatus status;
  status.stamp = Timestamp{100s};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.measurements[0][0] = 17;
  neighbor.newest[0] = NewestReading{.stamp = Timestamp{99s}};
  status.estimator.neighbors = {neighbor};
  status.traffic = {{.peer = RobotId{2}, .received = 70, .lost = 3, .restarts = 1, .age_s = 0.02}};

  const auto read = std::get<Status>(parse(peer_status_json(status, RobotId{2}).value()).value());

  EXPECT_EQ(read.neighbors.at(0).measurements.at("bearing").at("fused"), 17U);
  EXPECT_EQ(read.neighbors.at(0).ages_s.at("bearing"), 1.0);
  EXPECT_EQ(read.neighbors.at(0).reports.value().lost, 3U);
}

TEST(ClientMessages, ReadWhatTheEstimatorCouldNotUse) {
  SystemStatus status;
  status.estimator.refused_samples = 40;
  status.estimator.refused_imu[static_cast<std::size_t>(ImuFault::kHangs)] = 40;
  status.estimator.foreign_boards = 2;

  const auto read = std::get<Status>(parse(status_json(status)).value());

  EXPECT_EQ(read.estimator, (Status::Totals{{"refused_samples", 40}, {"foreign_boards", 2}}));
  EXPECT_EQ(read.refused_imu, (Status::Totals{{"hangs", 40}}));
}

TEST(ClientMessages, ReadPastWhatLaterVersionsAdd) {
  const auto read = parse(
      R"({"class":"STATUS","self":1,"later":{"a":1},"queues":{"graph":3,"by_cause":{"slow":1}},)"
      R"("estimator":{"refused_samples":40,"names":["x"]}})");

  ASSERT_TRUE(read);
  EXPECT_EQ(std::get<Status>(*read).queues, (Status::Totals{{"graph", 3}}));
  EXPECT_EQ(std::get<Status>(*read).estimator, (Status::Totals{{"refused_samples", 40}}));
}

TEST(ClientMessages, RefuseWhatTheyCannotRead) {
  const std::string pose =
      R"({"class":"POSE","self":1,"peer":2,"t_ns":"5","position":{"x":0,"y":0,"z":0},)"
      R"("orientation":{"w":1,"x":0,"y":0,"z":0}})";
  ASSERT_TRUE(parse(pose));
  const auto with = [&](const std::string& what, const std::string& instead) {
    return std::string(pose).replace(pose.find(what), what.size(), instead);
  };
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("3"),
        std::string(R"({"class":"HELLO"})"), std::string(R"({"class":7})"),
        std::string(R"({"class":"POSE"})"), with(R"("5")", R"("soon")"), with(R"("5")", R"("5x")"),
        with(R"("peer":2)", R"("peer":65538)"), with(R"("peer":2)", R"("peer":-1)"),
        with(R"("self":1)", R"("self":1,"covariance":[1,2,3])"),
        std::string(R"({"class":"STATUS","self":1,"neighbors":[{"name":"nobody"}]})")})
    EXPECT_FALSE(parse(text)) << text;
}

TEST(ClientMessages, SurviveAnyBytes) {
  EXPECT_TRUE(rc::check([](const std::string& bytes) {
    Conversation conversation({});
    (void)conversation.take(bytes, Conversation::Time{});
  }));
}

/// When a conversation is tried; any time will do.
constexpr Conversation::Time kStart{1000s};

SubscriptionRequest request_in(const std::string& datagram) {
  return parse_request(datagram).value();
}

TEST(Conversation, AsksAtOnceAndASilentDaemonAgainSoon) {
  Conversation conversation({.rate_hz = 20.0, .peers = {2, 3}});

  const auto first = conversation.due(kStart);

  ASSERT_EQ(first.size(), 1U);
  const auto watch = std::get<WatchRequest>(request_in(first[0]).what);
  EXPECT_TRUE(watch.enable);
  EXPECT_EQ(watch.rate_hz, 20.0);
  EXPECT_EQ(watch.peers, (std::vector{RobotId{2}, RobotId{3}}));
  EXPECT_TRUE(conversation.due(kStart + 200ms).empty());
  EXPECT_EQ(conversation.next_due(), kStart + 250ms);
  EXPECT_EQ(conversation.due(kStart + 250ms).size(), 1U);
}

TEST(Conversation, RenewsWithinTheLease) {
  Conversation conversation({});
  (void)conversation.due(kStart);

  (void)conversation.take(R"({"class":"VERSION","release":"1","lease_s":10})", kStart + 10ms);
  (void)conversation.due(kStart + 250ms);
  EXPECT_EQ(conversation.next_due(), kStart + 1250ms);

  (void)conversation.take(R"({"class":"VERSION","release":"1","lease_s":2})", kStart + 300ms);
  EXPECT_EQ(conversation.next_due(), kStart + 800ms);
  EXPECT_EQ(conversation.version()->lease_s, 2.0);
}

TEST(Conversation, RepeatsEachPollInItsOwnPeriod) {
  Conversation conversation(
      {.watch = false, .polls = {{.peer = 4, .period_s = 3.0}, {.about = "sensors"}}});
  (void)conversation.take(R"({"class":"ERROR","message":"x"})", kStart);

  const auto first = conversation.due(kStart);
  const auto second = conversation.due(kStart + 1s);

  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(std::get<PollRequest>(request_in(first[0]).what).peer, RobotId{4});
  ASSERT_EQ(second.size(), 1U);
  EXPECT_NE(second[0].find(R"("about":"sensors")"), std::string::npos);
  EXPECT_FALSE(conversation.farewell());
}

TEST(Conversation, RepeatsARarePollOnceWhereNothingElseIsHeard) {
  Conversation conversation({.watch = false, .polls = {{.period_s = 5.0}}});
  int asked = 0;
  for (auto t = 0ms; t < 60s; t += 10ms) {
    for (const std::string& request : conversation.due(kStart + t)) {
      (void)request;
      ++asked;
      (void)conversation.take(R"({"class":"ERROR","message":"x"})", kStart + t);
    }
  }
  EXPECT_LE(asked, 13);  // one more before the first answer
}

TEST(Conversation, EchoesTheCookieAtOnceInEveryRequest) {
  Conversation conversation({.polls = {{.peer = 3}}});
  const std::string cookie = cookie_json("0123456789abcdef");
  for (const std::string& request : conversation.due(kStart))
    EXPECT_GE(request.size(), cookie.size());  // else a remote daemon does not answer

  EXPECT_FALSE(conversation.take(cookie, kStart + 1ms));
  const auto again = conversation.due(kStart + 1ms);

  ASSERT_EQ(again.size(), 2U);
  for (const std::string& request : again)
    EXPECT_EQ(request_in(request).cookie, "0123456789abcdef");
  (void)conversation.take(cookie, kStart + 2ms);  // the answer to the second early request
  EXPECT_TRUE(conversation.due(kStart + 2ms).empty());
  (void)conversation.take(cookie_json("fedcba9876543210"), kStart + 3ms);  // of a restarted daemon
  EXPECT_EQ(conversation.due(kStart + 3ms).size(), 2U);
  EXPECT_EQ(request_in(conversation.farewell().value()).cookie, "fedcba9876543210");
}

/// A daemon that may start again, as a program on another machine finds it.
class RemoteDaemon {
 public:
  explicit RemoteDaemon(const HashKey& key)
      : service_(
            {}, "1", [] { return SystemStatus{}; }, key) {}

  /// Whether an answer to the requests that are due is a message.
  bool answers(Conversation& conversation, Conversation::Time now) {
    bool is_answered = false;
    for (const std::string& request : conversation.due(now)) {
      const auto answer = service_.answer(kClient, request, Timestamp{now.time_since_epoch()});
      if (answer && conversation.take(*answer, now)) is_answered = true;
    }
    return is_answered;
  }

 private:
  inline static const Endpoint kClient = Endpoint::ipv4({10, 0, 0, 7}, 40000);
  SubscriptionService service_;
};

TEST(Conversation, ThatOnlyPollsOutlivesItsCookie) {
  RemoteDaemon daemon(HashKey{1});
  RemoteDaemon restarted(HashKey{2});
  Conversation conversation({.watch = false, .polls = {{}}});
  EXPECT_FALSE(daemon.answers(conversation, kStart));
  EXPECT_TRUE(daemon.answers(conversation, kStart));

  EXPECT_FALSE(daemon.answers(conversation, kStart + 150s));  // the cookie has expired
  EXPECT_TRUE(daemon.answers(conversation, kStart + 150s));
  EXPECT_FALSE(restarted.answers(conversation, kStart + 160s));
  EXPECT_TRUE(restarted.answers(conversation, kStart + 160s));
}

TEST(Conversation, EndsPosesThatAreWantedNoMore) {
  Conversation conversation({});
  (void)conversation.due(kStart);

  conversation.ask({.watch = false, .polls = {{}}});
  const auto requests = conversation.due(kStart + 1ms);

  ASSERT_EQ(requests.size(), 2U);
  EXPECT_FALSE(std::get<WatchRequest>(request_in(requests[0]).what).enable);
  EXPECT_TRUE(std::holds_alternative<PollRequest>(request_in(requests[1]).what));
}

TEST(Conversation, EndsPosesEvenIfAskedForSomethingElseBefore) {
  Conversation conversation({});
  (void)conversation.due(kStart);

  conversation.ask({.watch = false, .polls = {{}}});
  conversation.ask({.watch = false, .polls = {{.peer = 3}}});
  const auto requests = conversation.due(kStart + 1ms);

  ASSERT_EQ(requests.size(), 2U);
  EXPECT_FALSE(std::get<WatchRequest>(request_in(requests[0]).what).enable);
  EXPECT_EQ(std::get<PollRequest>(request_in(requests[1]).what).peer, RobotId{3});
}

TEST(Conversation, AsksForOneSensor) {
  Conversation conversation({.watch = false, .polls = {{.sensor = "cam0 spots"}}});

  const auto requests = conversation.due(kStart);

  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(std::get<PollRequest>(request_in(requests[0]).what).sensor, "cam0 spots");
}

/// The daemon's end of a connection.
class Daemon {
 public:
  explicit Daemon(const std::string& address = "127.0.0.1", std::uint16_t port = 0)
      : socket_(UdpSocket::bind(address, port).value()) {}

  [[nodiscard]] std::uint16_t port() const { return socket_.local().port; }
  /// The next request; its sender is answered from now on.
  SubscriptionRequest next_request() {
    const Datagram datagram = socket_.receive(10'000ms).value().value();
    client_ = datagram.from;
    return request_in({datagram.bytes.begin(), datagram.bytes.end()});
  }
  void send(const std::string& text) { send_from(socket_, text); }
  void send_from(UdpSocket& socket, const std::string& text) const {
    EXPECT_TRUE(socket.send_to(std::vector<std::uint8_t>(text.begin(), text.end()), *client_));
  }

 private:
  UdpSocket socket_;
  std::optional<Endpoint> client_;
};

Connection connected_to(const Daemon& daemon, const Requests& requests,
                        const std::string& address = "127.0.0.1") {
  std::string fault;
  auto connection = Connection::open({address, daemon.port()}, requests, fault);
  EXPECT_TRUE(connection) << fault;
  return std::move(connection).value();
}

TEST(ClientConnection, HearsItsDaemonAndNobodyElse) {
  Daemon daemon;
  auto stranger = UdpSocket::bind("127.0.0.1", 0).value();
  Connection connection = connected_to(daemon, {});
  EXPECT_FALSE(connection.receive(0ms));
  EXPECT_TRUE(std::get<WatchRequest>(daemon.next_request().what).enable);

  daemon.send_from(stranger, error_json("not me"));
  daemon.send("garbage");
  daemon.send(error_json("busy"));
  const auto answer = connection.receive(10'000ms);

  ASSERT_TRUE(answer);
  EXPECT_EQ(std::get<Error>(answer->message).message, "busy");
  EXPECT_EQ(answer->text, error_json("busy"));
  EXPECT_EQ(connection.malformed(), 1U);
  EXPECT_LT(connection.silent_for().count(), 10.0);
}

TEST(ClientConnection, FindsADaemonThatStartsAgain) {
  std::optional<Daemon> daemon{std::in_place};
  Connection connection = connected_to(*daemon, {.retry_s = 0.01});
  (void)connection.receive(0ms);
  (void)daemon->next_request();
  const std::uint16_t port = daemon->port();

  daemon.reset();
  EXPECT_FALSE(connection.receive(100ms));  // asks nobody a few times
  daemon.emplace("127.0.0.1", port);
  (void)connection.receive(100ms);
  (void)daemon->next_request();
  daemon->send(error_json("back"));

  EXPECT_TRUE(connection.receive(10'000ms));
}

TEST(ClientConnection, EndsItsSubscription) {
  Daemon daemon;
  {
    Connection connection = connected_to(daemon, {});
    (void)connection.receive(0ms);
    Connection moved = std::move(connection);
    EXPECT_TRUE(std::get<WatchRequest>(daemon.next_request().what).enable);
  }

  EXPECT_FALSE(std::get<WatchRequest>(daemon.next_request().what).enable);
}

TEST(ClientConnection, WorksWithIpv6) {
  Daemon daemon("::1");
  Connection connection = connected_to(daemon, {.watch = false, .polls = {{}}}, "::1");
  (void)connection.receive(0ms);
  EXPECT_TRUE(std::holds_alternative<PollRequest>(daemon.next_request().what));
  daemon.send(error_json("busy"));

  EXPECT_TRUE(connection.receive(10'000ms));
}

TEST(ClientConnection, RefusesAnAddressThatIsNone) {
  std::string fault;
  EXPECT_FALSE(Connection::open({"localhost:1", 1}, {}, fault));
  EXPECT_EQ(fault,
            "'localhost:1' is not a numeric IPv4 or IPv6 address: names are not resolved; say "
            "127.0.0.1 for this machine");
}

}  // namespace
}  // namespace crepes::client::client_test
