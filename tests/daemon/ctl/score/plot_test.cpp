#include "daemon/ctl/score/plot.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/score/svg_chart.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::plot_test {
namespace {

using std::chrono::milliseconds;

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size()))
    ++count;
  return count;
}

TEST(SvgChart, ThinsASeriesWithoutLosingAPeak) {
  Series series;
  for (int i = 0; i < 10'000; ++i) series.push_back({0.01 * i, i == 4321 ? 7.0 : 0.0});

  const Series thin = decimated(series, 100);

  EXPECT_LE(thin.size(), 200U);
  EXPECT_TRUE(std::is_sorted(thin.begin(), thin.end(),
                             [](const auto& a, const auto& b) { return a.x < b.x; }));
  EXPECT_TRUE(std::any_of(thin.begin(), thin.end(),
                          [](const ChartPoint& p) { return p.x == 43.21 && p.y == 7.0; }));
}

TEST(SvgChart, PutsTicksAtRoundNumbers) {
  const std::vector<double> ticks = nice_ticks(-0.13, 0.13, 5);

  ASSERT_EQ(ticks.size(), 3U);
  EXPECT_NEAR(ticks.front(), -0.1, 1e-12);
  EXPECT_NEAR(ticks.back(), 0.1, 1e-12);
}

TEST(SvgChart, BreaksALineAtAGapAndClipsPointsToItsBorder) {
  SvgChart chart({.title = "a < b", .x = "s", .y = "m"});
  chart.set_gap(0.5);
  chart.set_y_range(0.0, 1.0);
  chart.add_line({{0.0, 0.1}, {0.1, 0.2}, {2.0, 0.3}}, "#123456", "line");
  chart.add_points({{1.0, 99.0}}, "#654321", {});

  const std::string svg = chart.svg();

  const auto line = svg.substr(svg.find("stroke='#123456'"), 120);
  EXPECT_EQ(count_of(line.substr(0, line.find("/>")), "M"), 2U) << line;
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  EXPECT_NE(svg.find(",38.0h0"), std::string::npos) << svg;  // at the upper border
}

/// r2 stands 2 m ahead of r1 for a fifth of a second, and is seen 0.1 m off.
class Plot : public testing::Test {
 protected:
  void SetUp() override {
    swarm_.write("truth/r1.csv", "#\n0,0,0,0,1,0,0,0,0,0,0\n1,0,0,0,1,0,0,0,0,0,0\n");
    swarm_.write("truth/r2.csv", "#\n0,2,0,0,1,0,0,0,0,0,0\n1,2,0,0,1,0,0,0,0,0,0\n");
  }

  void write_results(ReplayOutput::Detail detail, MeasurementKind kind = MeasurementKind::kRange) {
    auto output =
        ReplayOutput::create(results(), {{RobotId{1}, "r1"}, {RobotId{2}, "r2"}}, detail).value();
    for (int ms = 10'000; ms <= 10'200; ms += 20) {
      NeighborPose pose;
      pose.neighbor = RobotId{2};
      pose.stamp = Timestamp{milliseconds(ms)};
      pose.published = pose.stamp + milliseconds(7);
      pose.mode = ms < 10'100 ? PoseMode::kDirect : PoseMode::kPredicted;
      pose.T_B_N.pose.p = {2.1, 0.0, 0.0};
      pose.T_B_N.covariance = 0.01 * Matrix6d::Identity();
      output.write(RobotId{1}, pose);
      if (detail == ReplayOutput::Detail::kPoses) continue;
      Records records;
      records.measurements.push_back(
          {.neighbor = RobotId{2},
           .stamp = pose.stamp,
           .kind = kind,
           .fusion = {.verdict = ms == 10'040 ? Verdict::kGated : Verdict::kFused,
                      .nis = ms == 10'040 ? 40.0 : 0.5,
                      .dimension = 1,
                      .residual = {0.1},
                      .sigma = {0.1}}});
      records.calibrations.push_back({.neighbor = RobotId{2}, .stamp = pose.stamp});
      records.team.push_back(team_record(pose.stamp));
      output.write(RobotId{1}, records);
    }
    ASSERT_TRUE(output.finish({}));
  }

  /// r2's bearings to r1, and its camera.
  static TeamRecord team_record(Timestamp stamp) {
    TeamRecord record{.stamp = stamp, .residuals = {}, .calibrations = {}, .faults = {}};
    record.residuals.push_back({.observer = RobotId{2},
                                .neighbor = RobotId{1},
                                .kind = TeamResidual::Kind::kBearing,
                                .fused = 3,
                                .refused = 1,
                                .nis = 1.5,
                                .dimension = 2,
                                .residual = {1e-3, -1e-3},
                                .sigma = {1e-3, 2e-3}});
    RobotCalibration& robot = record.calibrations.emplace_back();
    robot.robot = RobotId{2};
    robot.cameras.emplace_back();
    return record;
  }

  [[nodiscard]] std::filesystem::path results() const { return swarm_.dir() / "out"; }

  [[nodiscard]] std::string page(const PlotOptions& options) const {
    const auto file = plot(options);
    EXPECT_TRUE(file) << file.error().message;
    std::ostringstream text;
    text << std::ifstream(file.value_or("")).rdbuf();
    return text.str();
  }

  TinySwarm swarm_;
};

TEST_F(Plot, DrawsErrorsInnovationsAndBiasesOnOnePage) {
  write_results(ReplayOutput::Detail::kRecords);

  const std::string html =
      page({.results = results(), .swarm = swarm_.dir(), .out = swarm_.dir() / "page.html"});

  EXPECT_TRUE(std::filesystem::exists(swarm_.dir() / "page.html"));
  EXPECT_NE(html.find("r2 as seen by r1"), std::string::npos);
  EXPECT_NE(html.find("<td>0.1000</td>"), std::string::npos);  // the error that was put in
  EXPECT_NE(html.find("range: 10 fused (0.0 % above), 1 gated"), std::string::npos);
  EXPECT_NE(html.find("gyro bias of the observer"), std::string::npos);
  EXPECT_NE(html.find("age of the state"), std::string::npos);
  EXPECT_NE(html.find(">predicted<"), std::string::npos);
  EXPECT_NE(html.find("The team as r1 estimates it"), std::string::npos);
  EXPECT_NE(html.find("bearing of r2: 33 fused, 11 refused"), std::string::npos);
  EXPECT_NE(html.find("r2: misalignment of camera 0"), std::string::npos);
  EXPECT_NE(html.find("r2: lens error of camera 0"), std::string::npos);
  constexpr std::size_t kOfTeam = 1U + 6U;  // residuals; biases, delay, clock, camera, lens
  EXPECT_EQ(count_of(html, "<svg"), 1U + 6U + 2U + 1U + 7U + 1U + kOfTeam);
  EXPECT_EQ(count_of(html, "<svg"), count_of(html, "</svg>"));
  EXPECT_EQ(count_of(html, "nan"), 0U);
  EXPECT_EQ(count_of(html, "<script>"), 1U);
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(html.find("http://"), std::string::npos) << "the page needs nobody else";
}

TEST_F(Plot, DrawsPathsWithEqualScales) {
  write_results(ReplayOutput::Detail::kPoses);

  const std::string html = page({.results = results(), .swarm = swarm_.dir(), .out = {}});

  const std::string above = html.substr(html.find(">from above<"));
  EXPECT_NE(above.find("r1, truth"), std::string::npos);
  EXPECT_NE(above.find("r2, estimate"), std::string::npos);
  // r1 at 0, the true r2 at 2 and the estimate at 2.1 on 448 px for 1.08 * 2.1 m.
  const double scale = 448.0 / (1.08 * 2.1);
  const auto u = [&](double x) {
    return fmt::format("M{:.1f},", 62.0 + 224.0 + scale * (x - 1.05));
  };
  for (const double x : {0.0, 2.0, 2.1}) EXPECT_NE(above.find(u(x)), std::string::npos) << u(x);
}

TEST_F(Plot, ExplainsItsWords) {
  write_results(ReplayOutput::Detail::kPoses);

  const std::string html = page({.results = results(), .swarm = {}, .out = {}});

  for (const char* word : {"NEES, normalized", "NIS, normalized", "3 sigma", "gated"})
    EXPECT_NE(html.find(word), std::string::npos) << word;
}

TEST_F(Plot, ExplainsWhyFewBearingsLieAboveTheBoundOfTheNis) {
  const PlotOptions options{.results = results(), .swarm = {}, .out = {}};
  write_results(ReplayOutput::Detail::kRecords, MeasurementKind::kRange);
  EXPECT_EQ(page(options).find("vision.bearing_sigma_px"), std::string::npos);

  write_results(ReplayOutput::Detail::kRecords, MeasurementKind::kBearing);
  EXPECT_NE(page(options).find("vision.bearing_sigma_px"), std::string::npos);
}

TEST_F(Plot, ShowsUncertaintyAloneWithoutTruthAndRecords) {
  write_results(ReplayOutput::Detail::kPoses);

  const std::string html = page({.results = results(), .swarm = {}, .out = {}});

  EXPECT_TRUE(std::filesystem::exists(results() / "plot.html"));
  EXPECT_NE(html.find("position x uncertainty"), std::string::npos);
  EXPECT_EQ(html.find("Innovations"), std::string::npos);
}

TEST_F(Plot, ReplacesAnEarlierPageAndNoOtherFile) {
  write_results(ReplayOutput::Detail::kPoses);
  const std::filesystem::path report = results() / "report.json";
  swarm_.write("out/report.json", "{}");

  const auto refused = plot({.results = results(), .swarm = {}, .out = report});
  const auto page = plot({.results = results(), .swarm = {}, .out = {}});
  const auto again = plot({.results = results(), .swarm = {}, .out = {}});

  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("no earlier result of this command"), std::string::npos);
  EXPECT_EQ(swarm_.read("out/report.json"), "{}");
  EXPECT_TRUE(page && again);
  EXPECT_TRUE(plot({.results = results(), .swarm = {}, .out = report, .force = true}));
}

TEST_F(Plot, SaysWhatIsMissing) {
  const auto message = [&](const std::filesystem::path& swarm) {
    const auto file = plot({.results = results(), .swarm = swarm, .out = {}});
    return file ? std::string() : file.error().message;
  };
  EXPECT_NE(message({}).find("out: no <observer>/<neighbor>.csv"), std::string::npos);

  write_results(ReplayOutput::Detail::kRecords);
  EXPECT_NE(message(swarm_.dir() / "nowhere").find("nowhere/swarm.yaml"), std::string::npos);
  swarm_.write("out/r1/r2.innovations.csv", "t_ns,kind\n");
  EXPECT_NE(message({}).find("r2.innovations.csv:1"), std::string::npos) << message({});

  write_results(ReplayOutput::Detail::kPoses);
  std::filesystem::rename(results() / "r1/r2.csv", results() / "r1/stranger.csv");
  EXPECT_NE(message(swarm_.dir()).find("no robot 'stranger'"), std::string::npos);
}

TEST_F(Plot, TakesNoTruthForResults) {
  const auto file = plot({.results = swarm_.dir(), .swarm = {}, .out = {}});

  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("it is a data set"), std::string::npos)
      << file.error().message;
}

TEST_F(Plot, RefusesTheTruthOfAnotherRecording) {
  write_results(ReplayOutput::Detail::kPoses);
  swarm_.write("out/report.json", R"({"scenario":"manual"})");

  const auto file = plot({.results = results(), .swarm = swarm_.dir(), .out = {}});

  ASSERT_FALSE(file);
  for (const char* part : {"scenario manual", "scenario tiny"})
    EXPECT_NE(file.error().message.find(part), std::string::npos) << file.error().message;
}

}  // namespace
}  // namespace crepes::plot_test
