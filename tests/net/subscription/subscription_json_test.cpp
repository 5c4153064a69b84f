#include "net/subscription/subscription_json.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/places.hpp"

namespace crepes::subscription_json_test {
namespace {

using Json = nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

NeighborPose some_pose() {
  NeighborPose pose;
  pose.neighbor = RobotId{2};
  pose.stamp = Timestamp{Duration{993'638'158'694'177}};
  pose.mode = PoseMode::kDirect;
  pose.T_B_N.pose = {{1.23456789012, -2.0 / 3, 1e-9}, so3_exp({0.1, -0.2, 1.0 / 3})};
  for (int i = 0; i < 36; ++i)
    pose.T_B_N.covariance(i / 6, i % 6) = -1.0 / (1e5 + std::min(i, 6 * (i % 6) + i / 6));
  pose.v_B_N = {-0.123456789, 1e-8, 3.0};
  pose.sources = {.bearing = true, .peer_bearing = true, .range = true, .imu = true, .graph = true};
  return pose;
}

SystemStatus big_status(int neighbors) {
  SystemStatus status;
  status.self = RobotId{1};
  status.name = "r1";
  status.uptime_s = 1.5;
  for (const char* name : {"imu0", "uwb0", "cam0", "cam1"})
    status.sensors.push_back({name,
                              199.98765,
                              false,
                              std::string(300, 'x'),
                              {{{"bad_checksum", 12345}}, {{"frames", 77}}}});
  for (int i = 0; i < neighbors; ++i) {
    NeighborStatus neighbor;
    neighbor.neighbor = RobotId{static_cast<std::uint16_t>(i + 2)};
    neighbor.name = "robot-" + std::to_string(i);
    for (auto& kind : neighbor.measurements) kind.fill(123456);
    if (i % 2 == 0) neighbor.pose = some_pose();
    status.estimator.neighbors.push_back(neighbor);
    status.clocks.push_back({neighbor.neighbor, 993.638158694177, -20.52, 1.5e-5});
  }
  for (const char* name : {"events", "frames", "reports"}) status.queues.push_back({name, 42});
  for (int i = 0; i < 15; ++i)
    status.network.emplace_back("refused_" + std::to_string(i), 1000 + i);
  return status;
}

std::string message_of(std::string_view request) {
  const auto parsed = parse_request(request);
  EXPECT_FALSE(parsed.has_value()) << request;
  return parsed ? "" : parsed.error().message;
}

TEST(SubscriptionJson, ReadsAWatchAndIgnoresKeysItDoesNotKnow) {
  const auto request = parse_request(
      R"({"class":"WATCH","enable":true,"rate_hz":50,"peers":[2,3],"colour":{"a":[1]}})");

  ASSERT_TRUE(request.has_value());
  const auto& watch = std::get<WatchRequest>(request->what);
  EXPECT_TRUE(watch.enable);
  EXPECT_EQ(watch.rate_hz, 50.0);
  EXPECT_EQ(watch.peers, (std::vector{RobotId{2}, RobotId{3}}));
}

TEST(SubscriptionJson, WatchesAllNeighborsByDefault) {
  const auto watch = std::get<WatchRequest>(parse_request(R"({"class":"WATCH"})")->what);

  EXPECT_TRUE(watch.enable);
  EXPECT_FALSE(watch.peers.has_value());
  EXPECT_FALSE(watch.rate_hz.has_value());
}

TEST(SubscriptionJson, ReadsAPollOfEverythingOfOneNeighborOrOfAPart) {
  const auto poll_of = [](std::string_view request) {
    return std::get<PollRequest>(parse_request(request)->what);
  };

  EXPECT_FALSE(poll_of(R"({"class":"POLL"})").peer.has_value());
  EXPECT_EQ(poll_of(R"({"class":"POLL","peer":3})").peer, RobotId{3});
  EXPECT_EQ(poll_of(R"({"class":"POLL","about":"sensors"})").about, StatusPart::kSensors);
  EXPECT_EQ(poll_of(R"({"class":"POLL","about":"network"})").about, StatusPart::kNetwork);
  EXPECT_EQ(poll_of(R"({"class":"POLL","about":"team"})").about, StatusPart::kTeam);
  EXPECT_FALSE(poll_of(R"({"class":"POLL","about":"team"})").peer.has_value());
  EXPECT_EQ(poll_of(R"({"class":"POLL","about":"team","peer":1})").peer, RobotId{1});
  EXPECT_EQ(poll_of(R"({"class":"POLL","about":"pair","peer":3})").about, StatusPart::kPair);
  EXPECT_EQ(poll_of(R"({"class":"POLL","sensor":"cam0"})").sensor, "cam0");
}

TEST(SubscriptionJson, ReadsTheCookieOfAnyRequest) {
  EXPECT_EQ(parse_request(R"({"class":"WATCH","cookie":"0af3"})")->cookie, "0af3");
  EXPECT_EQ(parse_request(R"({"cookie":"0af3","class":"POLL"})")->cookie, "0af3");
  EXPECT_EQ(parse_request(R"({"class":"POLL","pad":"xxxx"})")->cookie, "");
}

TEST(SubscriptionJson, NamesTheErrorInARequest) {
  EXPECT_NE(message_of("").find("not JSON"), std::string::npos);
  EXPECT_NE(message_of("\xff\xfe{").find("not JSON"), std::string::npos);
  EXPECT_NE(message_of("[]").find("JSON object"), std::string::npos);
  EXPECT_NE(message_of("{}").find("class"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"DANCE"})").find("WATCH or POLL"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","enable":1})").find("enable"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","rate_hz":0})").find("rate_hz"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","rate_hz":"9"})").find("rate_hz"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","rate_hz":1e999})").find("not JSON"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","peers":[0]})").find("peers"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","peers":[-1]})").find("peers"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","peers":[70000]})").find("peers"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","peers":2})").find("peers"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"WATCH","cookie":7})").find("cookie"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"POLL","peer":"r2"})").find("peer"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"POLL","sensor":0})").find("sensor"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"POLL","about":"love"})").find("about"), std::string::npos);
  EXPECT_NE(message_of(R"({"class":"POLL","about":"pair"})").find("peer"), std::string::npos);
}

TEST(SubscriptionJson, RefusesHugeAndDeepRequestsUnparsed) {
  EXPECT_NE(message_of(std::string(65000, '[')).find("1200 bytes"), std::string::npos);
  EXPECT_NE(message_of(std::string(1000, '[')).find("deep"), std::string::npos);
}

TEST(SubscriptionJson, SurvivesAnyBytes) {
  EXPECT_TRUE(rc::check([](const std::string& bytes) {
    (void)parse_request(bytes);
    (void)parse_request(R"({"class":"WATCH","peers":)" + bytes);
    RC_ASSERT(Json::accept(error_json(bytes)));
  }));
}

TEST(SubscriptionJson, WritesAPoseAsTheContractSays) {
  const std::string text = pose_json(7, RobotId{1}, "r2", some_pose());
  const Json json = Json::parse(text);

  EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
  EXPECT_EQ(json["class"], "POSE");
  EXPECT_EQ(json["seq"], 7);
  EXPECT_EQ(json["t_ns"], "993638158694177");
  EXPECT_NEAR(json["timestamp"].get<double>(), 993638.158694177, 1e-9);
  EXPECT_EQ(json["self"], 1);
  EXPECT_EQ(json["peer"], 2);
  EXPECT_EQ(json["name"], "r2");
  EXPECT_EQ(json["mode"], "direct");
  EXPECT_NEAR(json["position"]["x"].get<double>(), 1.23456789, 1e-6);
  EXPECT_NEAR(json["orientation"]["w"].get<double>(), some_pose().T_B_N.pose.q.w(), 1e-8);
  ASSERT_EQ(json["covariance"].size(), 21U);
  const Matrix6d& P = some_pose().T_B_N.covariance;
  EXPECT_NEAR(json["covariance"][5].get<double>(), P(0, 5), 1e-10);
  EXPECT_NEAR(json["covariance"][6].get<double>(), P(1, 1), 1e-10);
  EXPECT_NEAR(json["covariance"][20].get<double>(), P(5, 5), 1e-10);
  EXPECT_EQ(json["sources"][0], "bearing");
}

TEST(SubscriptionJson, LeavesOutWhatIsNotKnown) {
  NeighborPose pose = some_pose();
  pose.age_s = kNan;
  pose.v_B_N.x() = kNan;
  pose.T_B_N.covariance(0, 0) = kNan;

  const std::string text = pose_json(0, RobotId{1}, "r2", pose);

  const Json json = Json::parse(text);
  EXPECT_FALSE(json.contains("age_s"));
  EXPECT_FALSE(json.contains("velocity"));
  EXPECT_FALSE(json.contains("covariance"));
  EXPECT_EQ(text.find("null"), std::string::npos);
}

TEST(SubscriptionJson, NeverWritesMoreThanADatagramNorInvalidUtf8) {
  const std::string name = std::string(31, 'a') + "\xC3\xA4" + std::string(2000, 'b') + "\xFF";

  for (const std::string& text : {pose_json(~0ULL, RobotId{65534}, name, some_pose()),
                                  error_json(name), version_json(name, 10.0)}) {
    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    EXPECT_TRUE(Json::accept(text)) << text;
  }
}

TEST(SubscriptionJson, ReportsAllOfASmallStatus) {
  SystemStatus status = big_status(1);
  status.network.resize(2);
  for (auto& sensor : status.sensors) sensor.message.resize(10);
  status.estimator.neighbors[0].measurements = {};
  status.mesh = {.is_sealed = true,
                 .is_signed = false,
                 .warning = "any robot of the swarm could speak for another",
                 .air = {0.012, 0.2345, {}}};

  const Json json = Json::parse(status_json(status));

  EXPECT_FALSE(json.contains("truncated"));
  EXPECT_EQ(json["sensors"][0]["faults"], Json({{"bad_checksum", 12345}}));
  EXPECT_EQ(json["sensors"][0]["counts"], Json({{"frames", 77}}));
  EXPECT_EQ(json["neighbors"][0]["state"], "direct");
  EXPECT_NEAR(json["clocks"][0]["offset_s"].get<double>(), 993.638158694, 1e-8);
  EXPECT_EQ(json["queues"]["events"], 42);
  EXPECT_EQ(json["network"]["refused_1"], 1001);
  EXPECT_EQ(json["mesh"], Json({{"sealed", true},
                                {"signed", false},
                                {"warning", status.mesh.warning},
                                {"airtime", 0.012},
                                {"airtime_of_all", 0.235}}));
}

TEST(SubscriptionJson, ReportsEightNeighborsAndTheirClocksInOneStatus) {
  SystemStatus status = big_status(8);
  for (auto& sensor : status.sensors) {
    sensor.ok = true;
    sensor.message.clear();
  }

  const std::string text = status_json(status);
  const Json json = Json::parse(text);

  EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
  ASSERT_EQ(json["neighbors"].size(), 8U);
  ASSERT_EQ(json["clocks"].size(), 8U);
  EXPECT_EQ(json["sensors"].size(), 4U);
  EXPECT_FALSE(json.contains("more"));
  EXPECT_EQ(json["neighbors"][6]["state"], "direct");
  EXPECT_EQ(json["neighbors"][7]["reason"], "never heard");
  EXPECT_NEAR(json["clocks"][7]["offset_s"].get<double>(), 993.638158694, 1e-6);
}

TEST(SubscriptionJson, TruncatesALargeStatusAndMarksIt) {
  for (const int neighbors : {3, 8, 20, 64, 300}) {
    const std::string text = status_json(big_status(neighbors));
    const Json json = Json::parse(text);

    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    EXPECT_EQ(text.find("null"), std::string::npos);
    EXPECT_EQ(json["truncated"], true);
    EXPECT_EQ(json["sensors"].size(), 4U);
    EXPECT_GE(json["neighbors"].size(), neighbors <= 8 ? static_cast<std::size_t>(neighbors) : 3U);
    EXPECT_EQ(json["neighbors"][1]["reason"], "never heard");
    if (neighbors <= 64) {  // every robot is at least named
      EXPECT_EQ(json["neighbors"].size() + json.value("more", Json::array()).size(),
                static_cast<std::size_t>(neighbors));
    }
  }
}

TEST(SubscriptionJson, ReportsOneNeighborInFull) {
  SystemStatus status = big_status(20);
  status.traffic = {{.peer = RobotId{5}, .received = 70, .lost = 3, .restarts = 1, .age_s = 0.02}};
  status.mesh.air.of_peers[RobotId{5}] = 0.04;
  std::ranges::find(status.estimator.neighbors, RobotId{5}, &NeighborStatus::neighbor)
      ->range_residual_m = -0.03;

  const std::string text = peer_status_json(status, RobotId{5}).value();
  const Json json = Json::parse(text);

  EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
  EXPECT_FALSE(json.contains("truncated"));
  ASSERT_EQ(json["neighbors"].size(), 1U);
  EXPECT_EQ(json["neighbors"][0]["name"], "robot-3");
  EXPECT_EQ(json["neighbors"][0]["measurements"]["peer_range"]["gated"], 123456);
  EXPECT_EQ(json["neighbors"][0]["reports"]["lost"], 3);
  EXPECT_EQ(json["neighbors"][0]["airtime"], 0.04);
  EXPECT_EQ(json["neighbors"][0]["range_residual_m"], -0.03);
  EXPECT_EQ(json["clocks"][0]["sigma_s"], 1.5e-5);
  EXPECT_FALSE(peer_status_json(status, RobotId{1}).has_value());
}

TEST(SubscriptionJson, ReportsWhatWasMeasuredAsItCame) {
  SystemStatus status;
  status.stamp = Timestamp{std::chrono::seconds{100}};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.mounting = {.p_B_M = {0.05, 0.0, 0.01},
                       .p_B_U = {-0.04, 0.02, 0.1},
                       .p_N_M = {0.0, 0.0, 0.3},
                       .p_N_Q = {0.0, 0.0, 0.2}};
  const auto put = [&](MeasurementKind kind, Verdict verdict, const SensorReading& reading) {
    neighbor.newest.at(static_cast<std::size_t>(kind)) =
        NewestReading{status.stamp, verdict, reading};
  };
  put(MeasurementKind::kBearing, Verdict::kFused, {0.6, -0.8, 0.0, 0.06, 0.0, 0.01});
  put(MeasurementKind::kPeerBearing, Verdict::kGated, {0.0, 1.0, 0.0, 0.1, 0.2, 0.3});
  put(MeasurementKind::kRange, Verdict::kFused, {3.21});
  put(MeasurementKind::kPeerRange, Verdict::kFused, {kNan});
  status.estimator.neighbors = {neighbor};

  const Json json = Json::parse(peer_status_json(status, RobotId{2}).value());
  const Json& measured = json["neighbors"][0]["measured"];

  EXPECT_EQ(measured["bearing"],
            Json::parse(R"({"u":[0.6,-0.8,0.0],"from":[0.06,0.0,0.01],"to":[0.0,0.0,0.3]})"));
  EXPECT_EQ(
      measured["peer_bearing"],
      Json::parse(R"({"u":[0.0,1.0,0.0],"from":[0.1,0.2,0.3],"to":[0.05,0.0,0.01],"gated":true})"));
  EXPECT_EQ(measured["range"],
            Json::parse(R"({"m":3.21,"from":[-0.04,0.02,0.1],"to":[0.0,0.0,0.2]})"));
  EXPECT_FALSE(measured.contains("peer_range"));
}

TEST(SubscriptionJson, ReportsRefusedInertialSamplesByReason) {
  SystemStatus status = big_status(1);
  EXPECT_EQ(status_json(status).find("refused_imu"), std::string::npos);
  status.estimator.refused_imu.at(static_cast<std::size_t>(ImuFault::kSpike)) = 3;
  status.estimator.neighbors[0].refused_imu.at(static_cast<std::size_t>(ImuFault::kJump)) = 20;

  EXPECT_EQ(Json::parse(status_json(status, StatusPart::kNetwork))["estimator"]["refused_imu"],
            Json({{"spike", 3}}));
  EXPECT_EQ(Json::parse(peer_status_json(status, status.estimator.neighbors[0].neighbor)
                            .value())["neighbors"][0]["refused_imu"],
            Json({{"jump", 20}}));
}

TEST(SubscriptionJson, ReportsOnePartAlone) {
  const Json sensors = Json::parse(status_json(big_status(20), StatusPart::kSensors));
  const Json network = Json::parse(status_json(big_status(20), StatusPart::kNetwork));

  EXPECT_EQ(sensors["sensors"][3]["faults"]["bad_checksum"], 12345);
  EXPECT_FALSE(sensors.contains("neighbors"));
  EXPECT_EQ(network["network"]["refused_14"], 1014);
  EXPECT_EQ(network["queues"]["events"], 42);
  EXPECT_FALSE(network.contains("sensors"));
}

TEST(SubscriptionJson, ReportsOneSensorWithTheCountsThatFitNowhereElse) {
  SystemStatus status = big_status(2);
  const std::string long_name(40, 'n');
  for (const std::string& name : {std::string("cam0 spots"), std::string("cam1 spots"), long_name})
    status.sensors.push_back({name, 100.0, true, std::string(160, 'x'), {{}, {{"background", 4}}}});
  const Json part = Json::parse(status_json(status, StatusPart::kSensors));
  ASSERT_FALSE(part["sensors"][5].contains("counts"));

  const Json json = Json::parse(sensor_status_json(status, "cam1 spots").value());

  EXPECT_FALSE(json.contains("truncated"));
  ASSERT_EQ(json["sensors"].size(), 1U);
  EXPECT_EQ(json["sensors"][0]["name"], "cam1 spots");
  EXPECT_EQ(json["sensors"][0]["counts"], Json({{"background", 4}}));
  EXPECT_TRUE(sensor_status_json(status, part["sensors"][6]["name"].get<std::string>()));
  EXPECT_FALSE(sensor_status_json(status, "cam9"));
}

TEST(SubscriptionJson, NeverWritesMoreThanADatagramHoweverManyFaultsThereAre) {
  const auto with_faults = [](std::size_t own, std::size_t of_others) {
    SystemStatus status = big_status(3);
    const TeamFault fault{.robot = {}, .kind = TeamFault::Kind::kCameraTurned, .size = 0.1};
    status.estimator.faults.assign(own, fault);
    for (NeighborStatus& neighbor : status.estimator.neighbors)
      neighbor.faults.assign(of_others, fault);
    return status;
  };

  const std::string some = status_json(with_faults(2, 3));
  const std::string many = status_json(with_faults(50, 50));
  const std::string of_one = peer_status_json(with_faults(0, 50), RobotId{2}).value();

  for (const std::string& text : {some, many, of_one}) {
    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    EXPECT_EQ(Json::parse(text)["truncated"], true);
  }
  EXPECT_EQ(Json::parse(some)["faults"].size(), 2U);
  EXPECT_EQ(Json::parse(some)["sensors"].size(), 4U);
  EXPECT_GT(Json::parse(many)["faults"].size(), 0U);
  EXPECT_EQ(Json::parse(many)["neighbors"].size(), 3U);
}

/// Keys of an object and of the objects in it, but not names that the data choose.
void add_keys(const Json& json, std::set<std::string>& keys) {
  const std::set<std::string> named{"faults", "counts", "measurements", "queues", "network"};
  for (const auto& [key, value] : json.items()) {
    keys.insert(key);
    if (named.contains(key)) continue;
    if (value.is_object()) add_keys(value, keys);
    for (const Json& item : value.is_array() ? value : Json::array())
      if (item.is_object()) add_keys(item, keys);
  }
}

TEST(SubscriptionJson, HasOnlyDocumentedKeys) {
  std::ifstream file(std::string(source_dir()) + "/config/docs/formats.md");
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  SystemStatus status = big_status(1);
  for (SensorStatus& sensor : status.sensors) sensor.message = "short";
  status.config = {
      .generation = 2, .since = {}, .restart = {"cameras"}, .fault = "crepesd.yaml:1: no"};
  std::set<std::string> keys{"truncated", "more"};
  add_keys(Json::parse(pose_json(1, RobotId{1}, "r2", some_pose())), keys);
  add_keys(Json::parse(status_json(status, StatusPart::kAll)), keys);
  add_keys(Json::parse(peer_status_json(status, RobotId{2}).value()), keys);
  for (const char* axis : {"x", "y", "z", "w"}) keys.erase(axis);

  EXPECT_GT(keys.size(), 30U);
  for (const std::string& key : keys) {
    EXPECT_TRUE(document.find('`' + key + '`') != std::string::npos ||
                document.find('"' + key + '"') != std::string::npos)
        << key;
  }
}

TEST(SubscriptionJson, AnswersWithItsVersionAndLease) {
  const Json json = Json::parse(version_json("1.2.3", 10.0));

  EXPECT_EQ(json["class"], "VERSION");
  EXPECT_EQ(json["release"], "1.2.3");
  EXPECT_EQ(json["proto_major"], 1);
  EXPECT_EQ(json["proto_minor"], 0);
  EXPECT_EQ(json["lease_s"], 10.0);
}

}  // namespace
}  // namespace crepes::subscription_json_test
