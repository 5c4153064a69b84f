#include "daemon/ctl/dataset/swarm_dataset.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::swarm_dataset_test {
namespace {

constexpr std::size_t kImu = 20;
constexpr std::size_t kRanges = 10;
constexpr std::size_t kFrames = 10;

void expect_sizes(const RobotRecording& robot, std::size_t imu, std::size_t ranges,
                  std::size_t frames) {
  EXPECT_EQ(robot.imu.size(), imu);
  EXPECT_EQ(robot.ranges.size(), ranges);
  EXPECT_EQ(robot.cameras.at(0).spots.size(), frames);
}

/// One fault, listed with its place and reason; only the stated part of `robot` is lost.
void expect_one_fault(const SwarmDataset& swarm, const std::string& place,
                      const std::string& reason) {
  ASSERT_EQ(swarm.faults.list().size(), 1U);
  const std::string& fault = swarm.faults.list().front();
  EXPECT_NE(fault.find(place + ": " + reason), std::string::npos) << fault;
  EXPECT_EQ(swarm.faults.counts().at(reason), 1U);
  expect_sizes(swarm.robots.at(1), kImu, kRanges, kFrames);
}

std::string error_of(const TinySwarm& files) {
  const Result<SwarmDataset> swarm = load_swarm(files.dir());
  return swarm ? "no error" : swarm.error().message;
}

TEST(SwarmDataset, HoldsEverythingThatWasRecorded) {
  const TinySwarm files;

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  EXPECT_TRUE(swarm.faults.empty());
  ASSERT_EQ(swarm.robots.size(), 2U);
  for (const RobotRecording& robot : swarm.robots) expect_sizes(robot, kImu, kRanges, kFrames);
  EXPECT_EQ(swarm.manifest.network.jitter_ms, 2.0);
  EXPECT_EQ(swarm.manifest.network.seed, 7U);
  const RobotRecording& r2 = swarm.robots[1];
  EXPECT_EQ(to_ns(r2.imu[1].stamp), 20'010'000'000);
  EXPECT_EQ(r2.imu[1].gyro_radps, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(r2.imu[1].accel_mps2, Eigen::Vector3d(0.01, -0.02, 9.81));
  EXPECT_EQ(r2.ranges[0].neighbor, RobotId{1});
  EXPECT_EQ(r2.ranges[0].range_m, 5.5);
  EXPECT_EQ(r2.ranges[0].first_path_dbm, -80.5);
  ASSERT_EQ(r2.cameras[0].spots[3].spots.size(), 2U);
  EXPECT_EQ(r2.cameras[0].spots[3].spots[0].v_px, 200.25);
}

TEST(SwarmDataset, KnowsAFrameWithoutSpots) {
  const TinySwarm files;
  files.write("r1/cam0/spots.csv", "#\n10000000000,,,,\n10010000000,1,2,3,4\n10020000000,,,,\n");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  EXPECT_TRUE(swarm.faults.empty());
  const auto& frames = swarm.robots[0].cameras[0].spots;
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_TRUE(frames[0].spots.empty());
  EXPECT_EQ(frames[1].spots.size(), 1U);
  EXPECT_TRUE(frames[2].spots.empty());
}

TEST(SwarmDataset, RefusesACutOffLastLineOnly) {
  const TinySwarm files;
  std::string text = files.read("r1/imu0/data.csv");
  text.resize(text.size() - 2);  // "...,9.8": a whole row in appearance, and wrong
  files.write("r1/imu0/data.csv", text);

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:21", "cut-off last line");
  expect_sizes(swarm.robots[0], kImu - 1, kRanges, kFrames);
}

TEST(SwarmDataset, RefusesARowWithTooFewColumns) {
  const TinySwarm files;
  files.replace_line("r1/imu0/data.csv", 4, "10020000000,0,0,0,0,0");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:4", "wrong number of columns");
  expect_sizes(swarm.robots[0], kImu - 1, kRanges, kFrames);
}

TEST(SwarmDataset, RefusesNotANumber) {
  const TinySwarm files;
  files.replace_line("r1/imu0/data.csv", 5, "10030000000,0,nan,0,0,0,9.8");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:5", "not finite");
  expect_sizes(swarm.robots[0], kImu - 1, kRanges, kFrames);
}

TEST(SwarmDataset, RefusesInfinityAndRubbishInARange) {
  const TinySwarm files;
  files.replace_line("r1/uwb0/data.csv", 3, "10020000000,2,inf,-80,-80");
  files.replace_line("r1/uwb0/data.csv", 5, "10060000000,2,5.5m,-80,-80");
  files.replace_line("r1/uwb0/data.csv", 6, "10080000000,2,1e999,-80,-80");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  EXPECT_EQ(swarm.faults.counts().at("not finite"), 1U);
  EXPECT_EQ(swarm.faults.counts().at("not a number"), 1U);
  EXPECT_EQ(swarm.faults.counts().at("number out of range"), 1U);
  expect_sizes(swarm.robots[0], kImu, kRanges - 3, kFrames);
}

TEST(SwarmDataset, RefusesAnUnknownPeer) {
  const TinySwarm files;
  files.replace_line("r1/uwb0/data.csv", 3, "10020000000,77,5.5,-80,-80");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "uwb0/data.csv:3", "unknown peer");
  expect_sizes(swarm.robots[0], kImu, kRanges - 1, kFrames);
}

TEST(SwarmDataset, KnowsARobotThatCarriesAnothersModuleByRangesToItself) {
  const TinySwarm files;
  const auto set_range = [&](std::size_t line, const std::string& row) {
    files.replace_line("r1/uwb0/data.csv", line, row);
  };
  set_range(3, "10020000000,1,5.5,-80,-80");
  const SwarmDataset once = load_swarm(files.dir()).value();
  EXPECT_EQ(once.faults.total(), 0U);
  EXPECT_TRUE(check_modules(once));

  set_range(4, "10040000000,1,5.5,-80,-80");
  set_range(5, "10060000000,1,5.5,-80,-80");
  const auto checked = check_modules(load_swarm(files.dir()).value());
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().message.find("r1: 3 of its"), std::string::npos);
}

TEST(SwarmDataset, RefusesAStampThatGoesBack) {
  const TinySwarm files;
  files.replace_line("r1/imu0/data.csv", 12, "10050000000,0,0,0,0,0,9.8");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:12", "stamp out of order");
  expect_sizes(swarm.robots[0], kImu - 1, kRanges, kFrames);
}

TEST(SwarmDataset, AStampThatJumpsAheadDoesNotCostTheRowsAfterIt) {
  const TinySwarm files;
  files.replace_line("r1/imu0/data.csv", 3, "10180000000,0,0,0,0,0,9.8");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:3", "stamp out of order");
  expect_sizes(swarm.robots[0], kImu - 1, kRanges, kFrames);
}

TEST(SwarmDataset, RefusesAStampFarFromTheRecording) {
  const TinySwarm files;
  files.replace_line("r1/cam0/spots.csv", 2, "9223372036854775807,1,2,3,4");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "cam0/spots.csv:2", "stamp outside the recording");
  expect_sizes(swarm.robots[0], kImu, kRanges, kFrames);  // the frame's other spot is there
  EXPECT_EQ(swarm.robots[0].cameras[0].spots[0].spots.size(), 1U);
}

TEST(SwarmDataset, ReportsAMissingHeaderAndKeepsTheRow) {
  const TinySwarm files;
  std::string text = files.read("r1/imu0/data.csv");
  text.erase(0, text.find('\n') + 1);
  files.write("r1/imu0/data.csv", text);

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "imu0/data.csv:1", "no header that begins with '#'");
  expect_sizes(swarm.robots[0], kImu, kRanges, kFrames);
}

TEST(SwarmDataset, ReadsWhatASpreadsheetHasSaved) {
  const TinySwarm files;
  files.write("r1/imu0/data.csv", "\xEF\xBB\xBF" + files.read("r1/imu0/data.csv"));

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  EXPECT_EQ(swarm.faults.total(), 0U);
  expect_sizes(swarm.robots[0], kImu, kRanges, kFrames);
}

TEST(SwarmDataset, ReportsACameraWithoutCalibration) {
  const TinySwarm files;
  files.write("r1/cam1/spots.csv", files.read("r1/cam0/spots.csv"));

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  expect_one_fault(swarm, "r1/cam1", "camera without calibration");
  expect_sizes(swarm.robots[0], kImu, kRanges, kFrames);
}

TEST(SwarmDataset, RefusesPicturesThatAreNotThere) {
  const TinySwarm files;
  files.write("r1/cam0/data.csv",
              "#t_ns,file\n10000000000,a.png\n10005000000,../../swarm.yaml\n10010000000,b.png\n");
  files.write("r1/cam0/data/b.png", "");

  const SwarmDataset swarm = load_swarm(files.dir()).value();

  EXPECT_EQ(swarm.faults.counts().at("no such picture"), 2U);
  EXPECT_EQ(swarm.robots[0].cameras[0].images.size(), 1U);
}

TEST(SwarmDataset, NamesASensorOfWhichNoRowIsGood) {
  const TinySwarm files;
  files.write("r1/uwb0/data.csv", "#t_ns,peer,range,fp,rx\n10000000000,2,far,-80,-79\n");

  EXPECT_NE(error_of(files).find("uwb0/data.csv: none of 1 rows is good; the last: "),
            std::string::npos)
      << error_of(files);
}

TEST(SwarmDataset, NamesAFileThatIsMissing) {
  for (const char* file :
       {"swarm.yaml", "r2/crepesd.yaml", "r2/imu0/data.csv", "r2/uwb0/data.csv", "r2/cam0"}) {
    const TinySwarm files;
    std::filesystem::remove_all(files.dir() / file);

    EXPECT_NE(error_of(files).find((files.dir() / file).string()), std::string::npos)
        << error_of(files);
  }
}

TEST(SwarmDataset, NamesLineAndKeyOfAFaultInTheManifest) {
  const TinySwarm files;
  files.replace_line("swarm.yaml", 4,
                     "network: {latency_ms: 3.0, jitter_ms: 2.0, loss: 1.5, seed: 7}");
  EXPECT_NE(error_of(files).find("swarm.yaml:4: loss: outside [0, 1]"), std::string::npos)
      << error_of(files);

  files.replace_line("swarm.yaml", 4,
                     "network: {latency_ms: 3.0, jitter_ms: .nan, loss: 0, seed: 7}");
  EXPECT_NE(error_of(files).find("swarm.yaml:4: jitter_ms"), std::string::npos) << error_of(files);

  files.replace_line("swarm.yaml", 4, "network: {");
  EXPECT_NE(error_of(files).find("swarm.yaml:"), std::string::npos) << error_of(files);
}

TEST(SwarmDataset, RefusesAConfigurationOfAnotherRobot) {
  const TinySwarm files;
  files.write("r2/crepesd.yaml", files.read("r1/crepesd.yaml"));

  EXPECT_NE(error_of(files).find("r2/crepesd.yaml: robot.id"), std::string::npos)
      << error_of(files);
}

}  // namespace
}  // namespace crepes::swarm_dataset_test
