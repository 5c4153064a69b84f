/// The output of crepesctl --json: one object a line, nothing else, with the same content as the
/// text.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/runtime.hpp"
#include "daemon/stages/worker.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "tests/clients/tool_run.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"
#include "tests/support/places.hpp"
#include "tests/support/witmotion_sensor.hpp"

namespace crepes::tools_json_test {
namespace {

namespace fs = std::filesystem;

const std::string kSource = source_dir();

TEST(ToolsInJson, AreAllButTheOneThatPrintsAScript) {
  std::istringstream script(crepesctl({"completion", "bash"}).output);
  std::set<std::string> without;
  std::set<std::string> inner{""};  // those that have commands of their own
  for (std::string line; std::getline(script, line);) {
    const auto words = line.find("\") words=\"");
    if (words == std::string::npos) continue;
    const std::string path = line.substr(5, words - 5);
    if (const auto space = path.rfind(' '); space != std::string::npos)
      inner.insert(path.substr(0, space));
    if (line.find("--json") == std::string::npos) without.insert(path);
  }

  for (const std::string& path : inner) without.erase(path);
  EXPECT_EQ(inner, (std::set<std::string>{"", "calibrate", "led"}));
  EXPECT_EQ(without, (std::set<std::string>{"completion"}));
}

TEST(ToolsInJson, WriteSectionsThatAConfigurationTakes) {
  const Json library = object_of({"codebook", "--ids", "5", "--json"});
  const std::string calibration = kSource + "/tests/config/calibration/";
  const Json sections = object_of({"import-calibration", calibration + "camchain-imucam.yaml",
                                   calibration + "imu.yaml", "--json"});
  ASSERT_TRUE(library.is_object() && sections.is_object());

  Json whole = sections;
  whole["robot"]["id"] = 1;
  whole["swarm"] = library["swarm"];
  const CheckedConfig checked = check_config_text(whole.dump(), "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  EXPECT_EQ(checked.config.swarm.members.size(), 5U);
  EXPECT_EQ(checked.config.cameras.size(), sections["cameras"].size());
  EXPECT_EQ(checked.config.imu.noise.update_rate, sections["imu"]["update_rate"]);
}

TEST(ToolsInJson, ReplaceNoJsonOfAnotherTool) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string file = scratch.path() / "calibration.json";
  const std::string camchain = kSource + "/tests/config/calibration/camchain-imucam.yaml";
  std::ofstream(file) << R"({"value0":{"resolution":[[640,480]]}})";

  const Ending refused = crepesctl({"import-calibration", camchain, "--json", "--out", file});
  const std::string kept = read_text_file(file).value_or("");
  const Ending first =
      crepesctl({"import-calibration", camchain, "--json", "--out", file, "--force"});
  const Ending again = crepesctl({"import-calibration", camchain, "--json", "--out", file});

  EXPECT_EQ(refused.how, "exit code 1");
  EXPECT_NE(refused.errors.find("--force"), std::string::npos) << refused.errors;
  EXPECT_TRUE(kept.starts_with(R"({"value0")")) << kept;
  EXPECT_EQ(first.how, "exit code 0") << first.errors;
  EXPECT_EQ(again.how, "exit code 0") << again.errors;
}

TEST(ToolsInJson, TellWhatAReplayGaveAndWhatItRefused) {
  const TinySwarm swarm;
  swarm.replace_line("r1/imu0/data.csv", 5, "what,is,this");
  const std::string out = swarm.dir() / "out";

  const Ending replayed = crepesctl({"replay", swarm.dir(), "--out", out, "--json"});

  EXPECT_EQ(replayed.how, "exit code 0");
  EXPECT_NE(replayed.errors.find("r1/imu0/data.csv:5"), std::string::npos) << replayed.errors;
  const std::vector<Json> reported = objects_in(replayed);
  ASSERT_EQ(reported.size(), 1U) << replayed.output;
  EXPECT_EQ(reported[0]["out"], out);
  EXPECT_EQ(reported[0]["robots"], 2);
  EXPECT_NEAR(reported[0]["duration_s"], 0.2, 1e-9);
  EXPECT_EQ(reported[0]["poses"], 0);
  EXPECT_EQ(reported[0]["refused"].size(), 1U);
  EXPECT_EQ(object_of({"plot", out, "--json"})["page"], out + "/plot.html");
}

/// The one object of a calibration that could not begin.
void expect_refused(const std::vector<std::string>& arguments, const std::string& how,
                    const std::string& reason) {
  std::vector<std::string> words{"calibrate"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  words.insert(words.end(), {"--out", "/tmp/none.yaml", "--json"});
  const Ending ending = crepesctl(words);
  EXPECT_EQ(ending.how, how) << ending.errors;
  const std::vector<Json> told = objects_in(ending);
  ASSERT_EQ(told.size(), 1U) << ending.output;
  EXPECT_EQ(told[0]["ok"], false);
  ASSERT_EQ(told[0]["reasons"].size(), 1U);
  EXPECT_NE(told[0]["reasons"][0].get<std::string>().find(reason), std::string::npos)
      << told[0]["reasons"][0];
  EXPECT_NE(ending.errors.find(reason), std::string::npos) << ending.errors;
}

TEST(ToolsInJson, SayWhyACalibrationCouldNotBegin) {
  const std::string none = "/nonexistent/recording";
  expect_refused({"camera", none}, "exit code 1", none);
  expect_refused({"camera", none, "--model", "fisheye"}, "exit code 2", "'fisheye'");
  expect_refused({"camera", none, "--grid", "5", "--pitch", "0.05"}, "exit code 2", "'5'");
  expect_refused({"camera", none, "--grid", "5x7", "--pitch", "0.05"}, "exit code 1", none);
  expect_refused({"imu", none}, "exit code 1", none);
  expect_refused({"range", none}, "exit code 2", "--distance");
  expect_refused({"range", none, "--distance", "r1,r2=5.00"}, "exit code 1", none);
  expect_refused({"swarm", none}, "exit code 1", none);
}

TEST(ToolsInJson, TellWhereAKeyIs) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string file = scratch.path() / "mesh.key";

  const Json made = object_of({"keygen", file, "--json"});
  EXPECT_EQ(made["file"], file);
  EXPECT_EQ(made["fingerprint"].get<std::string>().size(), 8U);

  const Ending again = crepesctl({"keygen", file, "--json"});
  EXPECT_EQ(again.how, "exit code 1");
  EXPECT_EQ(again.output, "");
  EXPECT_NE(again.errors.find("not overwritten"), std::string::npos) << again.errors;

  const std::string own = scratch.path() / "robot.key";
  const Json both = object_of({"keygen", file, own, "--json"});
  EXPECT_EQ(both["fingerprint"], made["fingerprint"]);
  EXPECT_EQ(both["robot_file"], own);
  EXPECT_EQ(both["public_key"].get<std::string>().size(), 44U);
}

TEST(ToolsInJson, ListDevices) {
  const Json devices = object_of({"devices", "--json"});

  EXPECT_TRUE(devices["cameras"].is_array());
  EXPECT_TRUE(devices["serial_ports"].is_array());
  EXPECT_TRUE(devices["kernel_imus"].is_array());
}

TEST(ToolsInJson, TellWhatASensorWasSetTo) {
  PseudoTerminal line = PseudoTerminal::open().value();
  const Worker sensor("sensor",
                      [&](const std::stop_token& stop) { run_witmotion_at_20_hz(line, stop); });

  const Json reported =
      object_of({"setup-witmotion", "--port", line.path(), "--rate", "20", "--json"});

  EXPECT_EQ(reported["update_rate"], 20);
  EXPECT_NEAR(reported["measured_hz"], 20.0, 5.0);
}

TEST(ToolsInJson, SayAnErrorInWordsAndNothingOnStandardOutput) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"replay", "/not/there", "--out", "/not/there/either"},
        {"evaluate", "/not/there", "--truth", "/not/there"},
        {"plot", "/not/there"},
        {"spots", "/not/there", "--config", "/not/there"},
        {"record", "/not/there", "--socket", "/not/there"},
        {"import-calibration", "/not/there"},
        {"setup-witmotion", "--port", "/not/there"}}) {
    std::vector<std::string> asked = words;
    asked.emplace_back("--json");
    const Ending ending = crepesctl(asked);
    EXPECT_EQ(ending.how, "exit code 1") << words.front();
    EXPECT_EQ(ending.output, "") << words.front();
    EXPECT_TRUE(ending.errors.starts_with("crepesctl: ")) << words.front() << ending.errors;
  }
}

TEST(ToolsInJson, SayThatNobodyTakesTheAnswer) {
  const Ending ending = run("/bin/sh", {"-c", crepesctl_path() + " completion bash >/dev/full"});

  EXPECT_EQ(ending.how, "exit code 1");
  EXPECT_NE(ending.errors.find("standard output"), std::string::npos) << ending.errors;
}

TEST(ToolsInJson, SumUpADemo) {
  Ending demo;
  do {  // it needs two ports in a row
    demo = crepesctl({"demo", "--scenario", "two", "--for", "5", "--port",
                      std::to_string(free_port()), "--json"});
  } while (demo.errors.find("choose another --port") != std::string::npos);

  // An overloaded machine may have no pose after five seconds; the summary then reports it.
  const std::vector<Json> reported = objects_in(demo);
  ASSERT_EQ(reported.size(), 1U) << demo.output << demo.errors;
  EXPECT_EQ(reported[0]["scenario"], "two");
  EXPECT_GE(reported[0]["to_s"], 5.0);
  ASSERT_EQ(reported[0]["pairs"].size(), 2U);
  bool has_all = true;
  for (const Json& pair : reported[0]["pairs"]) {
    has_all = has_all && pair.contains("first_pose_s");
    EXPECT_LT(pair["position_m"].value("median", 0.0), 1.0);
  }
  EXPECT_EQ(demo.how, has_all ? "exit code 0" : "exit code 1") << demo.errors;
}

class LiveToolsInJson : public LiveDaemon {
 protected:
  LiveToolsInJson() {
    first_.recording.socket = folder_.path() / "socket";
    one_.emplace(first_, machine_);
  }

  std::vector<std::string> to_first(std::vector<std::string> words) const {
    words.insert(words.end(), {"--port", std::to_string(first_.subscription.port), "--json"});
    return words;
  }

  ScratchDirectory folder_ = ScratchDirectory::create({}).value();
  Config first_ = pair_config(1, mesh_port_);
  std::optional<Runtime> one_;
  Runtime two_{pair_config(2, mesh_port_), machine_};
};

TEST_F(LiveToolsInJson, AreTheDaemonsOwnObjects) {
  const Json pose = object_of(to_first({"waitpose", "--peer", "2", "--timeout", "50"}));
  const Json status = object_of(to_first({"status"}));
  const Json sources = object_of(to_first({"sources"}));
  const Ending watched = crepesctl(to_first({"watch", "--for", "5"}));

  EXPECT_EQ(pose["class"], "POSE");
  EXPECT_EQ(status["class"], "STATUS");
  EXPECT_GT(sources["over_s"], 0.5);
  EXPECT_EQ(sources["sources"][0]["peer"], 2);
  std::set<std::string> classes;
  for (const Json& object : objects_in(watched)) classes.insert(object["class"]);
  EXPECT_EQ(classes, (std::set<std::string>{"VERSION", "POSE", "STATUS"}));
}

TEST_F(LiveToolsInJson, SumUpARecording) {
  object_of(to_first({"waitpose", "--peer", "2", "--timeout", "50"}));
  const std::string dir = folder_.path() / "recording";

  const Json reported =
      object_of({"record", dir, "--duration", "1", "--socket", first_.recording.socket, "--json"});

  EXPECT_EQ(reported["folder"], dir + "/r1");
  EXPECT_EQ(reported["ended"], "--duration is over");
  EXPECT_GE(reported["duration_s"], 1.0);
  EXPECT_GT(reported["rows"], 50);
  EXPECT_GT(reported["bytes"], 1000);
  EXPECT_EQ(reported["pictures"], 0);
  EXPECT_EQ(reported["configurations"], 1);
}

}  // namespace
}  // namespace crepes::tools_json_test
