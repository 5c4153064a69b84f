/// The examples of config/examples/clients, as a user runs them, with live daemons of a simulated
/// pair: what they print must be the truth.
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/runtime.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "tests/clients/tool_run.hpp"
#include "tests/support/live_daemon.hpp"
#include "tests/support/places.hpp"

namespace crepes::client_examples_test {
namespace {

const std::string kClients = source_dir() + "/config/examples/clients";

/// Where a program of this name is; empty if it is not installed.
std::string path_of(const std::string& program) {
  for (const char* folder : {"/usr/bin/", "/bin/"})
    if (::access((folder + program).c_str(), X_OK) == 0) return folder + program;
  return "";
}

class Clients : public LiveDaemon {
 protected:
  /// Runs a program until `enough` of what it printed; its lines.
  std::vector<std::string> lines_of(const std::string& program,
                                    const std::vector<std::string>& arguments, std::size_t enough) {
    const auto log = scratch_.path() / "log";
    auto child = ChildProcess::start(program, arguments, log);
    if (!child) {
      ADD_FAILURE() << child.error().message;
      return {};
    }
    const Timestamp end = machine_.now() + kPatience;
    std::vector<std::string> lines;
    bool more = true;
    while (lines.size() < enough && more) {
      ::poll(nullptr, 0, 20);
      // Asked before its lines are read, for what it writes last it writes just before its end.
      more = !child->exit_reason() && machine_.now() < end;
      std::istringstream text(read_text_file(log).value_or(""));
      lines.clear();
      for (std::string line; std::getline(text, line) && !text.eof();) lines.push_back(line);
    }
    EXPECT_GE(lines.size(), enough) << read_text_file(log).value_or("");
    return lines;
  }

  /// The pose of a line `t_ns peer mode x y z`, as POSE has it.
  static Json pose_of(const std::string& line) {
    std::istringstream words(line);
    std::string t_ns;
    std::string mode;
    int peer = 0;
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    words >> t_ns >> peer >> mode >> x >> y >> z;
    EXPECT_TRUE(words) << line;
    return {{"t_ns", t_ns},
            {"peer", peer},
            {"mode", mode},
            {"position", {{"x", x}, {"y", y}, {"z", z}}},
            {"orientation", {{"w", 1}, {"x", 0}, {"y", 0}, {"z", 0}}}};
  }

  void expect_truth(const Json& pose) const {
    EXPECT_EQ(pose["peer"], 2);
    EXPECT_LT(error_of(pose, first_).position_m, 0.5) << pose.dump();
  }

  /// Ten poses of the neighbor, each where it is.
  void expect_poses(const std::string& program, const std::vector<std::string>& arguments) {
    for (const std::string& line : lines_of(program, arguments, 10)) expect_truth(pose_of(line));
  }

  Config first_ = pair_config(1, mesh_port_);
  std::string port_ = std::to_string(first_.subscription.port);
  Runtime one_{first_, machine_};
  Runtime two_{pair_config(2, mesh_port_), machine_};
  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

TEST_F(Clients, InEachLanguageGetThePosesThatAreTrue) {
  expect_true_poses(first_);  // so that the programs' own patience is not tried

  {
    SCOPED_TRACE("Python");
    expect_poses("/usr/bin/env",
                 {"PYTHONPATH=" + kClients + "/python", "/usr/bin/python3", "-B", "-m",
                  "crepes_client", "--port", port_, "--rate", "20", "--count", "10"});
  }
  {
    SCOPED_TRACE("C++");
    expect_poses(CREPES_CPP_CLIENT, {"127.0.0.1", port_, "10"});
  }
  if (const std::string node = path_of("node"); !node.empty()) {
    SCOPED_TRACE("Node");
    expect_poses(node, {kClients + "/node/poses.mjs", "127.0.0.1", port_, "10"});
  } else {
    std::puts("not tried: node is not installed (Debian: nodejs)");
  }
  if (!path_of("nc").empty()) {
    SCOPED_TRACE("shell");
    for (const std::string& line :
         lines_of("/bin/sh", {kClients + "/shell/poses.sh", "127.0.0.1", port_, "20"}, 10)) {
      const Json object = Json::parse(line, nullptr, false);
      ASSERT_TRUE(object.is_object()) << line;
      if (object["class"] == "POSE") expect_truth(object);
    }
  } else {
    std::puts("not tried: nc is not installed (Debian: netcat-openbsd)");
  }
}

TEST(ClientExamples, RefuseAPortThatIsNone) {
  std::vector<std::string> programs{std::string(CREPES_CPP_CLIENT)};
  if (const std::string node = path_of("node"); !node.empty())
    programs.push_back(node + " " + kClients + "/node/poses.mjs");
  for (const std::string& program : programs) {
    const Ending ending = run("/bin/sh", {"-c", program + " 127.0.0.1 99999"});

    EXPECT_EQ(ending.how, "exit code 2") << program;
    EXPECT_EQ(ending.errors, "99999 is no port, 1 to 65535\n") << program;
  }
}

TEST_F(Clients, EndTheirSubscriptionWhereNobodyReadsOn) {
  expect_true_poses(first_);
  for (const std::string& program :
       {std::string(CREPES_CPP_CLIENT) + " 127.0.0.1 " + port_,
        "PYTHONPATH=" + kClients + "/python /usr/bin/python3 -B -m crepes_client --port " +
            port_}) {
    SCOPED_TRACE(program);
    for (int i = 0; i <= first_.subscription.max_per_address; ++i) {
      const Ending ending = run("/bin/sh", {"-c", program + " | head -n 1"});
      EXPECT_NE(ending.output, "") << ending.errors;
    }
  }
}

TEST_F(Clients, InRosGetPosesOdometryTransformsAndDiagnostics) {
  expect_true_poses(first_);

  const auto lines = lines_of(
      "/usr/bin/env",
      {"PYTHONPATH=" + source_dir() + "/tests/clients/fake_ros:" + kClients +
           "/python:" + kClients + "/ros2",
       "FAKE_ROS_COUNT=100", "/usr/bin/python3", "-B", "-m", "crepes_bridge.bridge", "--ros-args",
       "-p", "port:=" + port_, "-p", "publish_tf:=true", "-p", "diagnostics_period_s:=0.2"},
      100);

  std::map<std::string, int> reported;
  for (const std::string& line : lines) {
    const Json published = Json::parse(line);
    const auto topic = published["topic"].get<std::string>();
    const Json& message = published["message"];
    ++reported[topic];
    EXPECT_GT(message["header"]["stamp"]["sec"].get<std::int64_t>(), 1'600'000'000);
    if (topic == "/diagnostics") continue;
    EXPECT_EQ(message["header"]["frame_id"], "robot_1/base_link");
    if (topic == "/tf") {
      EXPECT_EQ(message["child_frame_id"], "robot_2/base_link");
      continue;
    }
    const Json& pose = message["pose"];
    ASSERT_EQ(pose["covariance"].size(), 36U);
    EXPECT_GT(pose["covariance"][0].get<double>(), 0.0);
    EXPECT_GT(pose["covariance"][35].get<double>(), 0.0);
    const Json& q = pose["pose"]["orientation"];
    const Eigen::Vector4d wxyz(q["w"].get<double>(), q["x"].get<double>(), q["y"].get<double>(),
                               q["z"].get<double>());
    EXPECT_NEAR(wxyz.norm(), 1.0, 1e-6);
  }
  EXPECT_EQ(reported["crepes/r2/pose"], reported["crepes/r2/odometry"]);
  EXPECT_EQ(reported["crepes/r2/pose"], reported["/tf"]);
  EXPECT_GT(reported["crepes/r2/pose"], 20);
  EXPECT_GT(reported["/diagnostics"], 0);
}

}  // namespace
}  // namespace crepes::client_examples_test
