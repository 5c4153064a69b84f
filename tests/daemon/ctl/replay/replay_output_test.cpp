#include "daemon/ctl/replay/replay_output.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <sstream>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/dataset/pose_file.hpp"
#include "drivers/dataset/record_file.hpp"
#include "drivers/dataset/team_record_file.hpp"

namespace crepes::replay_output_test {
namespace {

namespace fs = std::filesystem;

double any_finite() {
  const auto bits = *rc::gen::arbitrary<std::uint64_t>();
  const auto value = std::bit_cast<double>(bits);
  return std::isfinite(value) ? value : 0.0;
}

Eigen::Quaterniond any_rotation() {
  const auto angle = [] { return *rc::gen::inRange(-3000, 3000) * 1e-3; };
  return so3_exp({angle(), angle(), angle()});
}

NeighborPose a_pose(std::int64_t t_ns) {
  NeighborPose pose;
  pose.neighbor = RobotId{2};
  pose.stamp = Timestamp{Duration{t_ns}};
  pose.published = pose.stamp + std::chrono::milliseconds(4);
  pose.mode = PoseMode::kGraph;
  pose.T_B_N.covariance = Matrix6d::Identity();
  return pose;
}

Result<std::vector<NeighborPose>> read_text(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  return read_pose_file(file, RobotId{2});
}

MeasurementRecord a_measurement() {
  MeasurementRecord record;
  record.neighbor = RobotId{2};
  record.stamp = Timestamp{Duration{123'456'789'012}};
  record.kind = MeasurementKind::kPeerBearing;
  record.fusion = {.verdict = Verdict::kGated,
                   .nis = 31.25,
                   .dimension = 2,
                   .residual = {0.1, -0.3},
                   .sigma = {0.02, 0.06}};
  record.reading = {0.6, -0.8, 0.0, 0.06, 0.0, 0.01};
  return record;
}

CalibrationRecord a_calibration() {
  CalibrationRecord record;
  record.neighbor = RobotId{2};
  for (std::size_t i = 0; i < record.value.size(); ++i) {
    record.value.at(i) = 0.1 * static_cast<double>(i);
    record.sigma.at(i) = 1.0 / (1.0 + static_cast<double>(i));
  }
  return record;
}

TEST(RecordFile, ReadsBackWhatItWrote) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  std::string innovations = innovation_file_header() + "\n";
  append_innovation_row(innovations, a_measurement());
  append_innovation_row(innovations, {.fusion = {.verdict = Verdict::kLate}});
  std::string calibration = calibration_file_header() + "\n";
  append_calibration_row(calibration, a_calibration());
  std::ofstream(scratch.path() / "i.csv") << innovations;
  std::ofstream(scratch.path() / "c.csv") << calibration;

  const auto measurements = read_innovation_file(scratch.path() / "i.csv");
  const auto calibrations = read_calibration_file(scratch.path() / "c.csv");

  ASSERT_TRUE(measurements) << measurements.error().message;
  ASSERT_EQ(measurements->size(), 2U);
  EXPECT_EQ(measurements->front().stamp, a_measurement().stamp);
  EXPECT_EQ(measurements->front().kind, MeasurementKind::kPeerBearing);
  EXPECT_EQ(measurements->front().fusion.verdict, Verdict::kGated);
  EXPECT_EQ(measurements->front().fusion.residual, a_measurement().fusion.residual);
  EXPECT_EQ(measurements->front().fusion.sigma, a_measurement().fusion.sigma);
  EXPECT_EQ(measurements->front().reading, a_measurement().reading);
  EXPECT_EQ(measurements->back().fusion.dimension, 0U);
  ASSERT_TRUE(calibrations) << calibrations.error().message;
  EXPECT_EQ(calibrations->front().value, a_calibration().value);
  EXPECT_EQ(calibrations->front().sigma, a_calibration().sigma);
}

const RobotNames kNames{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};

TeamRecord a_team_record() {
  TeamRecord record{.stamp = Timestamp{Duration{123'456'789'012}},
                    .residuals = {},
                    .calibrations = {},
                    .faults = {}};
  record.residuals = {{.observer = RobotId{2},
                       .neighbor = RobotId{1},
                       .kind = TeamResidual::Kind::kBearing,
                       .camera = 1,
                       .fused = 9,
                       .refused = 2,
                       .nis = 3.25,
                       .dimension = 2,
                       .residual = {0.1, -0.3},
                       .sigma = {0.02, 0.06}},
                      {.observer = RobotId{1},
                       .neighbor = RobotId{1},
                       .kind = TeamResidual::Kind::kGyro,
                       .fused = 1,
                       .nis = 5.5,
                       .dimension = 6}};
  RobotCalibration& robot = record.calibrations.emplace_back();
  robot.robot = RobotId{2};
  robot.clock_s = 0.003;
  robot.clock_sigma_s = 0.001;
  robot.cameras.push_back({.rotation = {0.1, 0.2, 0.3},
                           .covariance = 0.25 * Eigen::Matrix3d::Identity(),
                           .lens = {0.0, 0.001, -0.002},
                           .lens_sigma = {0.0006, 0.0005, 0.0004}});
  return record;
}

TEST(TeamRecordFile, ReadsBackWhatItWrote) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  std::string innovations = team_innovation_file_header() + "\n";
  append_team_innovation_rows(innovations, a_team_record(), kNames);
  std::string calibration = team_calibration_file_header() + "\n";
  append_team_calibration_rows(calibration, a_team_record(), kNames);
  std::ofstream(scratch.path() / "i.csv") << innovations;
  std::ofstream(scratch.path() / "c.csv") << calibration;

  const auto residuals = read_team_innovation_file(scratch.path() / "i.csv");
  const auto quantities = read_team_calibration_file(scratch.path() / "c.csv");

  ASSERT_TRUE(residuals) << residuals.error().message;
  ASSERT_EQ(residuals->size(), 2U);
  const TeamInnovationRow& bearing = residuals->at(0);
  EXPECT_EQ(bearing.stamp, a_team_record().stamp);
  EXPECT_EQ(bearing.observer, "r2");
  EXPECT_EQ(bearing.neighbor, "r1");
  EXPECT_EQ(bearing.residual.kind, TeamResidual::Kind::kBearing);
  EXPECT_EQ(bearing.residual.camera, 1);
  EXPECT_EQ(bearing.residual.fused, 9);
  EXPECT_EQ(bearing.residual.refused, 2);
  EXPECT_EQ(bearing.residual.residual, a_team_record().residuals[0].residual);
  EXPECT_EQ(bearing.residual.sigma, a_team_record().residuals[0].sigma);
  EXPECT_EQ(residuals->at(1).residual.kind, TeamResidual::Kind::kGyro);
  EXPECT_EQ(residuals->at(1).residual.dimension, 6);
  ASSERT_TRUE(quantities) << quantities.error().message;
  ASSERT_EQ(quantities->size(), 9U);
  EXPECT_EQ(quantities->at(6).quantity, "clock");
  EXPECT_EQ(quantities->at(6).dimension, 1);
  EXPECT_EQ(quantities->at(6).value[0], 0.003);
  EXPECT_EQ(quantities->at(6).sigma[0], 0.001);
  EXPECT_EQ(quantities->at(7).quantity, "camera0");
  EXPECT_EQ(quantities->at(7).dimension, 3);
  EXPECT_EQ(quantities->at(7).value, (std::array{0.1, 0.2, 0.3}));
  EXPECT_EQ(quantities->at(7).sigma, (std::array{0.5, 0.5, 0.5}));
  EXPECT_EQ(quantities->at(8).quantity, "lens0");
  EXPECT_EQ(quantities->at(8).value, (std::array{0.0, 0.001, -0.002}));
  EXPECT_EQ(quantities->at(8).sigma, (std::array{0.0006, 0.0005, 0.0004}));
}

TEST(TeamRecordFile, RefusesAKindThatIsNone) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  std::string text = team_innovation_file_header() + "\n";
  append_team_innovation_rows(text, a_team_record(), kNames);
  text.replace(text.find("bearing"), 4, "pear");
  std::ofstream(scratch.path() / "i.csv") << text;
  const auto read = read_team_innovation_file(scratch.path() / "i.csv");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("i.csv:2: unknown kind"), std::string::npos)
      << read.error().message;
}

TEST(ReplayOutput, WritesTheTeamOfEachObserver) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "r1/team.innovations.csv";
  {
    auto output = ReplayOutput::create(scratch.path(), kNames, ReplayOutput::Detail::kRecords);
    output->write(RobotId{1},
                  Records{.measurements = {}, .calibrations = {}, .team = {a_team_record()}});
    ASSERT_TRUE(output->finish({}));
  }
  EXPECT_EQ(read_team_innovation_file(file)->size(), 2U);
  EXPECT_EQ(read_team_calibration_file(scratch.path() / "r1/team.calibration.csv")->size(), 9U);
  ASSERT_TRUE(ReplayOutput::create(scratch.path(), kNames)->finish({}));
  EXPECT_FALSE(fs::exists(file));
}

TEST(ReplayOutput, RefusesARobotWhoseFilesWouldBeTheTeams) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto output = ReplayOutput::create(
      scratch.path(), {{RobotId{1}, "team"}, {RobotId{2}, "r2"}}, ReplayOutput::Detail::kRecords);
  ASSERT_FALSE(output);
  EXPECT_NE(output.error().message.find("named 'team'"), std::string::npos);
}

TEST(RecordFile, RefusesAKindThatIsNone) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  std::string text = innovation_file_header() + "\n";
  append_innovation_row(text, a_measurement());
  text.replace(text.find("peer_bearing"), 4, "pear");
  std::ofstream(scratch.path() / "i.csv") << text;

  const auto read = read_innovation_file(scratch.path() / "i.csv");

  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("i.csv:2: unknown kind"), std::string::npos)
      << read.error().message;
}

TEST(ReplayOutput, WritesRecordsWhenAskedAndTakesThemAwayWhenNot) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "r1/r2.innovations.csv";
  const ReplayOutput::Names names{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};
  {
    auto output = ReplayOutput::create(scratch.path(), names, ReplayOutput::Detail::kRecords);
    output->write(RobotId{1}, Records{.measurements = {a_measurement()},
                                      .calibrations = {a_calibration(), a_calibration()}});
    ASSERT_TRUE(output->finish({}));
  }
  EXPECT_EQ(read_innovation_file(file)->size(), 1U);
  // Two within a tenth of a second are one.
  EXPECT_EQ(read_calibration_file(scratch.path() / "r1/r2.calibration.csv")->size(), 1U);

  ASSERT_TRUE(ReplayOutput::create(scratch.path(), names)->finish({}));
  EXPECT_FALSE(fs::exists(file));
}

TEST(ReplayOutput, LeavesOutWhatIsMeasuredOfAMemberThatWasNotRecorded) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const ReplayOutput::Names names{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};
  auto output = ReplayOutput::create(scratch.path(), names, ReplayOutput::Detail::kRecords);
  MeasurementRecord of_another = a_measurement();
  of_another.neighbor = RobotId{3};
  CalibrationRecord its_calibration = a_calibration();
  its_calibration.neighbor = RobotId{3};

  output->write(RobotId{1}, Records{.measurements = {of_another, a_measurement()},
                                    .calibrations = {its_calibration}});

  ASSERT_TRUE(output->finish({}));
  EXPECT_EQ(read_innovation_file(scratch.path() / "r1/r2.innovations.csv")->size(), 1U);
}

TEST(PoseFile, ReadsBackEveryBit) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();

  EXPECT_TRUE(rc::check([&] {
    NeighborPose pose = a_pose(*rc::gen::arbitrary<std::int64_t>() / 2);
    pose.mode = *rc::gen::element(PoseMode::kDirect, PoseMode::kGraph, PoseMode::kPredicted);
    pose.T_B_N.pose = {{any_finite(), any_finite(), any_finite()}, any_rotation()};
    for (Eigen::Index i = 0; i < 6; ++i)
      for (Eigen::Index j = i; j < 6; ++j)
        pose.T_B_N.covariance(i, j) = pose.T_B_N.covariance(j, i) = any_finite();
    std::string text = std::string(pose_file_header()) + "\n";
    append_pose_row(text, pose);

    const auto read = read_text(scratch.path() / "pose.csv", text);

    RC_ASSERT(read.has_value());
    RC_ASSERT(read->size() == 1U);
    RC_ASSERT(read->front().stamp == pose.stamp);
    RC_ASSERT(read->front().published == pose.published);
    RC_ASSERT(read->front().mode == pose.mode);
    RC_ASSERT(read->front().T_B_N.pose.p == pose.T_B_N.pose.p);
    RC_ASSERT(read->front().T_B_N.pose.q.coeffs() == pose.T_B_N.pose.q.coeffs());
    RC_ASSERT(read->front().T_B_N.covariance == pose.T_B_N.covariance);
  }));
}

TEST(PoseFile, WritesColumnsInTheAgreedOrder) {
  NeighborPose pose = a_pose(1'000'000'005);
  pose.T_B_N.pose = {{1.5, -2.0, 0.25}, Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};
  double next = 0.0;
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = i; j < 6; ++j)
      pose.T_B_N.covariance(i, j) = pose.T_B_N.covariance(j, i) = next++;
  std::string csv;
  std::string tum;

  append_pose_row(csv, pose);
  append_tum_row(tum, pose);

  EXPECT_EQ(csv,
            "1000000005,1004000005,graph,1.5,-2,0.25,0.5,-0.5,0.5,-0.5,"
            "0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20\n");
  EXPECT_EQ(tum, "1.000000005 1.5 -2 0.25 -0.5 0.5 -0.5 0.5\n");
}

TEST(PoseFile, RefusesWhatNoReplayWrote) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string header = std::string(pose_file_header()) + "\n";
  std::string row;
  append_pose_row(row, a_pose(5));
  const auto error = [&](const std::string& text) {
    const auto read = read_text(scratch.path() / "pose.csv", text);
    return read ? "no error" : read.error().message;
  };

  EXPECT_NE(error("t,x,y\n" + row).find("pose.csv:1: not the header"), std::string::npos);
  EXPECT_NE(error(header + row + row).find("pose.csv:3: stamp does not"), std::string::npos);
  EXPECT_NE(error(header + row.substr(0, 60)).find("pose.csv:2: cut-off"), std::string::npos);
  const std::string guess = "guess" + row.substr(row.find(",0"));
  EXPECT_NE(error(header + "5,6," + guess).find("pose.csv:2: unknown mode"), std::string::npos);
}

TEST(ReplayOutput, LooksWholeOnlyWhenItIs) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const ReplayOutput::Names names{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};
  const fs::path& dir = scratch.path();
  auto first = ReplayOutput::create(dir, names).value();
  ASSERT_TRUE(first.finish({}));
  ASSERT_TRUE(fs::exists(dir / "r1/r2.csv"));

  auto second = ReplayOutput::create(dir, names).value();
  second.write(RobotId{1}, a_pose(20));

  for (const char* file : {"r1/r2.csv", "r1/r2.tum", "r2/r1.csv", "report.json"})
    EXPECT_FALSE(fs::exists(dir / file)) << file;
  ASSERT_TRUE(second.finish({}));
  EXPECT_EQ(read_pose_file(dir / "r1/r2.csv", RobotId{2})->size(), 1U);
  EXPECT_EQ(read_pose_file(dir / "r2/r1.csv", RobotId{1})->size(), 0U);
}

TEST(ReplayOutput, RemovesTheRobotsOfAnEarlierReplayAndNothingElse) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path& dir = scratch.path();
  const ReplayOutput::Names three{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}, {RobotId{3}, "r3"}};
  ASSERT_TRUE(ReplayOutput::create(dir, three, ReplayOutput::Detail::kRecords)->finish({}));
  const ReplayOutput::Names four{{RobotId{3}, "r3"}, {RobotId{4}, "r4"}};
  ASSERT_TRUE(ReplayOutput::create(dir / "other", four));  // never finished
  fs::rename(dir / "other/r4", dir / "r4");
  fs::create_directories(dir / "truth");
  for (const char* file : {"r1/notes.csv", "r1/notes.tum", "truth/r1.csv", "plot.html"})
    std::ofstream(dir / file) << "#t,x\n";

  auto output = ReplayOutput::create(dir, kNames);

  ASSERT_TRUE(output) << output.error().message;
  ASSERT_TRUE(output->finish({}));
  for (const char* file : {"r3", "r4", "r1/r3.csv", "r1/r3.tum", "r1/r3.innovations.csv",
                           "r1/r3.calibration.csv", "r1/team.innovations.csv", "r2/r3.csv"})
    EXPECT_FALSE(fs::exists(dir / file)) << file;
  for (const char* file :
       {"r1/r2.csv", "r2/r1.tum", "r1/notes.csv", "r1/notes.tum", "truth/r1.csv", "plot.html"})
    EXPECT_TRUE(fs::exists(dir / file)) << file;
}

TEST(ReplayOutput, RefusesADirectoryWithADataSetOrARobotOfOne) {
  for (const char* file : {"swarm.yaml", "crepesd.yaml"}) {
    const ScratchDirectory scratch = ScratchDirectory::create({}).value();
    std::ofstream(scratch.path() / file) << "scenario: tiny\n";

    const auto output = ReplayOutput::create(scratch.path(), kNames);

    ASSERT_FALSE(output) << file;
    EXPECT_EQ(output.error().code, ErrorCode::kConfig);
    EXPECT_FALSE(fs::exists(scratch.path() / "r1"));
  }
}

TEST(ReplayOutput, ReportsADirectoryThatCannotBe) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  std::ofstream(scratch.path() / "file") << "in the way";

  const auto output = ReplayOutput::create(scratch.path() / "file", {{RobotId{1}, "r1"}});

  ASSERT_FALSE(output);
  EXPECT_NE(output.error().message.find("file/r1"), std::string::npos);
}

TEST(ReplayReport, GivesBackTheClockSamples) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const ReplayOutput::Names names{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};
  ReplayReport report;
  report.clocks = {
      {.observer = RobotId{1},
       .stamp = Timestamp{std::chrono::seconds(1001)},
       .clock = {.peer = RobotId{2}, .offset_s = -3.25, .skew_ppm = 4.5, .sigma_s = 1e-4}}};
  const fs::path file = scratch.path() / "report.json";
  std::ofstream(file) << report_json(report, names);

  const auto clocks = read_clock_samples(file, names);

  ASSERT_TRUE(clocks);
  ASSERT_EQ(clocks->size(), 1U);
  EXPECT_EQ(clocks->front().stamp, Timestamp{std::chrono::seconds(1001)});
  EXPECT_EQ(clocks->front().clock.offset_s, -3.25);
  EXPECT_EQ(clocks->front().clock.peer, RobotId{2});
  EXPECT_FALSE(read_clock_samples(file, {{RobotId{1}, "r1"}}));  // whose clock?
}

TEST(ReplayReport, RefusesWhatIsNoReport) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "report.json";
  for (const char* text : {"", "{", "[]", R"({"clocks":[{"observer":"r1"}]})", R"({"clocks":3})"}) {
    std::ofstream(file) << text;

    const auto clocks = read_clock_samples(file, {{RobotId{1}, "r1"}});

    ASSERT_FALSE(clocks) << text;
    EXPECT_NE(clocks.error().message.find("report.json: "), std::string::npos);
  }
}

}  // namespace
}  // namespace crepes::replay_output_test
