#include "daemon/ctl/view/recorded_feed.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/view/page_files.hpp"
#include "drivers/dataset/pose_file.hpp"
#include "drivers/dataset/record_file.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::recorded_feed_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

/// A replay of the tiny swarm: r1 saw r2 a metre ahead, at 50 Hz of its clock.
class RecordedFeedTest : public testing::Test {
 protected:
  RecordedFeedTest() {
    std::string rows = std::string(pose_file_header()) + "\n";
    for (int i = 0; i < 10; ++i) {
      NeighborPose pose;
      pose.stamp = Timestamp{10s + i * 20ms};
      pose.published = pose.stamp;
      pose.T_B_N.pose = {{1.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
      pose.T_B_N.covariance = 1e-4 * Matrix6d::Identity();
      append_pose_row(rows, pose);
    }
    swarm_.write("results/r1/r2.csv", rows);
    const std::string header = "#t,px,py,pz,qw,qx,qy,qz,vx,vy,vz\n";
    swarm_.write("truth/r1.csv", header + "0,0,0,0,1,0,0,0,0,0,0\n0.2,0,0,0,1,0,0,0,0,0,0\n");
    swarm_.write("truth/r2.csv", header + "0,2,0,0,1,0,0,0,0,0,0\n0.2,2,0,0,1,0,0,0,0,0,0\n");
  }

  [[nodiscard]] std::filesystem::path results() const { return swarm_.dir() / "results"; }

  TinySwarm swarm_;
};

TEST_F(RecordedFeedTest, HasThinnedPosesOnTheTruthsTimeAndTheTruth) {
  const auto feed = RecordedFeed::open(results(), swarm_.dir());
  ASSERT_TRUE(feed) << feed.error().message;

  const Json json = Json::parse(feed->json_of("r1").value());

  EXPECT_EQ(feed->observers(), std::vector<std::string>{"r1"});
  ASSERT_EQ(json["neighbors"].size(), 1U);
  const Json& r2 = json["neighbors"][0];
  EXPECT_EQ(r2["name"], "r2");
  EXPECT_EQ(r2["rows"].size(), 5U);  // 25 of 50 Hz
  EXPECT_NEAR(r2["rows"][0][0].get<double>(), 0.0, 1e-3);
  EXPECT_EQ(r2["truth"][0][1], 2.0);
  EXPECT_EQ(json["up"][0], Json({0.0, 0.0, 0.0, 1.0}));
  ASSERT_EQ(json["cameras"].size(), 1U);
  EXPECT_EQ(json["cameras"][0]["border"].size(), 40U);
}

TEST_F(RecordedFeedTest, HasMeasurementsAsTheyCameWithAgesAndWhatWasGated) {
  const auto record = [](Duration t, MeasurementKind kind, Verdict verdict,
                         const SensorReading& reading) {
    return MeasurementRecord{.stamp = Timestamp{10s + t},
                             .kind = kind,
                             .fusion = {.verdict = verdict, .nis = 3.0, .dimension = 2},
                             .reading = reading};
  };
  const SensorReading ahead{1.0, 0.0, 0.0, 0.06, 0.0, 0.01};
  std::string rows = innovation_file_header() + "\n";
  // In the order of the verdicts, which is not that of time.
  append_innovation_row(rows, record(60ms, MeasurementKind::kRange, Verdict::kGated, {1.5}));
  append_innovation_row(rows, record(30ms, MeasurementKind::kBearing, Verdict::kFused, ahead));
  append_innovation_row(rows, record(70ms, MeasurementKind::kPeerRange, Verdict::kGated, {1.4}));
  swarm_.write("results/r1/r2.innovations.csv", rows);
  const auto feed = RecordedFeed::open(results(), swarm_.dir());
  ASSERT_TRUE(feed) << feed.error().message;

  const Json r2 = Json::parse(feed->json_of("r1").value())["neighbors"][0];

  ASSERT_EQ(r2["innovations"].size(), 3U);
  EXPECT_EQ(r2["innovations"][0], Json({0.03, 0, 0, 1.5, 1.0, 0.0, 0.0, 0.06, 0.0, 0.01}));
  EXPECT_EQ(r2["innovations"][1], Json({0.06, 2, 1, 1.5, 1.5}));
  EXPECT_EQ(r2["gated"], Json::parse("[[0,2]]"));
  // Rows 40 ms apart; the bearing is of 30 ms. Before it nothing was measured.
  EXPECT_EQ(r2["rows"][0][17], 0.0);
  EXPECT_EQ(r2["rows"][1][17], 0.01);
  EXPECT_EQ(r2["rows"][2][17], 0.05);
  EXPECT_EQ(r2["mounting"]["led"].size(), 3U);
}

TEST_F(RecordedFeedTest, ShowsPosesWithoutTruth) {
  const auto feed = RecordedFeed::open(results(), {});
  ASSERT_TRUE(feed) << feed.error().message;

  const Json json = Json::parse(feed->json_of("r1").value());

  EXPECT_FALSE(json["has_truth"].get<bool>());
  EXPECT_TRUE(json["up"].empty());
  EXPECT_TRUE(json["neighbors"][0]["truth"].empty());
}

TEST_F(RecordedFeedTest, SaysHowToReplayARecording) {
  const auto recording = RecordedFeed::open(swarm_.dir(), {});
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().message.find("crepesctl replay"), std::string::npos);
}

TEST_F(RecordedFeedTest, NamesARobotThatTheTruthDoesNotKnow) {
  std::filesystem::rename(results() / "r1" / "r2.csv", results() / "r1" / "r9.csv");

  const auto feed = RecordedFeed::open(results(), swarm_.dir());

  ASSERT_FALSE(feed);
  EXPECT_NE(feed.error().message.find("'r9'"), std::string::npos);
}

TEST_F(RecordedFeedTest, RefusesTheTruthOfAnotherRecording) {
  swarm_.write("results/report.json", R"({"scenario":"manual","duration_s":0.2})");

  const auto feed = RecordedFeed::open(results(), swarm_.dir());

  ASSERT_FALSE(feed);
  EXPECT_NE(feed.error().message.find("scenario manual"), std::string::npos)
      << feed.error().message;
}

TEST(PageFiles, AreFoundByTheirNamesOnly) {
  ASSERT_NE(page_file("/"), nullptr);
  EXPECT_EQ(page_file("/"), page_file("/index.html"));
  EXPECT_EQ(page_file("/main.js")->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(page_file("/style.css")->type, "text/css; charset=utf-8");
  EXPECT_EQ(page_file("/icon.svg")->type, "image/svg+xml; charset=utf-8");
  for (const char* path : {"", "main.js", "/../main.js", "//", "/page/main.js", "/MAIN.JS"})
    EXPECT_EQ(page_file(path), nullptr) << path;
}

TEST(PageFiles, HaveNoScriptOrStyleInlineAndNothingFromElsewhere) {
  const std::string html(page_file("/")->text);
  for (const char* part : {"<script>", "<style", " style=", " onclick=", "http://", "https://"})
    EXPECT_EQ(html.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace crepes::recorded_feed_test
