/// crepesctl as a user or a script runs it, with live daemons of a simulated pair.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "config/keys/robot_key.hpp"
#include "daemon/runtime.hpp"
#include "daemon/service/robot_lock.hpp"
#include "tests/clients/tool_run.hpp"
#include "tests/daemon/ctl/tiny_swarm.hpp"
#include "tests/support/places.hpp"

namespace crepes::tools_test {
namespace {

class Tools : public LiveDaemon {
 protected:
  /// With the pair's first robot.
  Ending ask(const std::string& command, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{command, "--port", std::to_string(first_.subscription.port)};
    words.insert(words.end(), more.begin(), more.end());
    return crepesctl(words);
  }

  Config first_ = pair_config(1, mesh_port_);
  Runtime one_{first_, machine_};
  Runtime two_{pair_config(2, mesh_port_), machine_};
};

TEST_F(Tools, WaitForAPoseAndTellOfIt) {
  const Ending there = ask("waitpose", {"--peer", "2", "--timeout", "50", "--max-sigma", "0.5"});
  EXPECT_EQ(there.how, "exit code 0") << there.output;
  EXPECT_NE(there.output.find("r2 direct at"), std::string::npos) << there.output;

  const Ending nobody = ask("waitpose", {"--peer", "9", "--timeout", "1"});
  EXPECT_EQ(nobody.how, "exit code 1");
  EXPECT_NE(nobody.errors.find("no other robot of this swarm"), std::string::npos) << nobody.errors;

  // On an overloaded machine the pose may disappear for a moment.
  constexpr int kAttempts = 10;
  Ending vague;
  for (int i = 0; i < kAttempts && vague.errors.find("is known to") == std::string::npos; ++i)
    vague = ask("waitpose", {"--peer", "2", "--timeout", "1", "--max-sigma", "1e-9"});
  EXPECT_EQ(vague.how, "exit code 1");
  EXPECT_NE(vague.errors.find("is known to"), std::string::npos) << vague.errors;
}

TEST_F(Tools, ShowTheStatusOnOneScreenAndInJson) {
  EXPECT_TRUE(Client(first_).await_status([](const Json& status) {
    return !status["neighbors"].empty() && status["neighbors"][0]["state"] == "direct" &&
           sensor_of(status, "uwb").value("ok", false) &&
           sensor_of(status, "cam0 spots").value("ok", false);
  }));

  const Ending text = ask("status");
  EXPECT_EQ(text.how, "exit code 0");
  for (const char* part : {"robot 1 r1", "% of a core", "MB", "cam0", "imu", "uwb", "mesh", "r2",
                           "direct", "network:"})
    EXPECT_NE(text.output.find(part), std::string::npos) << part << "\n" << text.output;
  EXPECT_LT(std::ranges::count(text.output, '\n'), 24);

  const Json json = Json::parse(ask("status", {"--json"}).output);
  EXPECT_EQ(json["class"], "STATUS");
  EXPECT_GT(json["neighbors"][0]["reports"]["received"], 0);
  EXPECT_TRUE(json["neighbors"][0].contains("measurements"));
  EXPECT_GT(json["cpu_s"], 0.0);
  EXPECT_FALSE(json.contains("truncated"));
  // Counts are not faults: a camera that works well reports no fault.
  for (const char* name : {"cam0", "cam0 spots"}) {
    EXPECT_FALSE(sensor_of(json, name).contains("faults")) << sensor_of(json, name);
    EXPECT_FALSE(sensor_of(json, name)["counts"].empty()) << name;
  }
  EXPECT_GT(sensor_of(json, "cam0")["counts"]["frames"], 0);
  EXPECT_GT(sensor_of(json, "cam0 spots")["counts"]["delay_p99_us"], 0);
}

TEST_F(Tools, NameTheSourcesOfAPose) {
  expect_true_poses(first_);

  const Json sources = Json::parse(ask("sources", {"--json"}).output)["sources"];

  for (const char* kind : {"bearing", "peer_bearing", "range", "reports"}) {
    const auto source =
        std::ranges::find_if(sources, [&](const Json& entry) { return entry["source"] == kind; });
    ASSERT_NE(source, sources.end()) << kind;
    EXPECT_EQ((*source)["peer"], 2);
    EXPECT_GT((*source)["rate_hz"], 0.0) << kind;
    EXPECT_LT((*source)["age_s"], 5.0) << kind;
    EXPECT_GT((*source)["used"], 0) << kind;
  }
}

TEST_F(Tools, WatchOnceAndAsAStream) {
  expect_true_poses(first_);

  // An overloaded machine loses the pose for a moment.
  Ending once;
  for (int i = 0; i < 5 && once.output.find("direct") == std::string::npos; ++i) {
    once = ask("watch", {"--once"});
    EXPECT_EQ(once.how, "exit code 0");
  }
  EXPECT_NE(once.output.find("direct"), std::string::npos) << once.output;

  const Ending stream = ask("watch", {"--json", "--for", "1"});
  EXPECT_EQ(stream.how, "exit code 0");
  EXPECT_NE(stream.output.find(R"({"class":"POSE")"), std::string::npos);
}

TEST_F(Tools, CheckARobotFromSensorsToCalibration) {
  expect_true_poses(first_);
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string file = scratch.path() / "crepesd.yaml";
  Config other = first_;
  other.imu.noise.update_rate = 400.0;
  std::ofstream(file) << write_config(other);

  const Ending text = ask("check", {"--for", "1"});
  const Json reported = Json::parse(ask("check", {"--json", "--config", file}).output);

  for (const char* part : {"cam0 spots", "r2: known to", "r2 sees our board", "not sealed",
                           "crepesctl keygen", "gravity measures", "r2 is"})
    EXPECT_NE(text.output.find(part), std::string::npos) << part << "\n" << text.output;
  std::vector<std::string> sections;
  bool is_rate_named = false;
  for (const Json& finding : reported["findings"]) {
    const auto about = finding["about"].get<std::string>();
    if (sections.empty() || sections.back() != about) sections.push_back(about);
    is_rate_named |= about == "rates" && finding["verdict"] == "doubt" &&
                     finding["text"].get<std::string>().find("of 400 Hz") != std::string::npos;
  }
  EXPECT_EQ(sections, (std::vector<std::string>{"sensors", "rates", "clocks", "exposure", "board",
                                                "mesh", "calibration"}));
  EXPECT_TRUE(is_rate_named) << reported.dump(2);
}

class OneRobot : public LiveDaemon {};

TEST_F(OneRobot, IsCheckedAndTheMissingOneIsAFault) {
  Config config = pair_config(1, mesh_port_);
  config.cameras[0].calibration.calibrated = false;
  const Runtime runtime(config, machine_);
  EXPECT_TRUE(Client(config).await_status([](const Json& status) {
    return mentions(sensor_of(status, "cam0 spots"), "not calibrated");
  }));

  const Ending ending =
      crepesctl({"check", "--port", std::to_string(config.subscription.port), "--for", "1"});

  EXPECT_EQ(ending.how, "exit code 1");
  EXPECT_NE(ending.output.find("fault  r2: never heard"), std::string::npos) << ending.output;
  EXPECT_NE(ending.output.find("fault  cam0 spots: not calibrated"), std::string::npos)
      << ending.output;
}

/// A daemon of its own process, whose camera's light is changed.
TEST_F(OneRobot, IsSetToAnotherExposureWhileItRuns) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const Config config = pair_config(1, mesh_port_);
  const std::string file = scratch.path() / "crepesd.yaml";
  std::ofstream(file) << write_config(config);
  auto daemon = ChildProcess::start(crepesd_path(), {"--config", file}, scratch.path() / "log");
  ASSERT_TRUE(daemon);
  const Runtime other(pair_config(2, mesh_port_), machine_);
  const auto is_bright = [](const Json& status) {
    const Json counts = sensor_of(status, "cam0 spots").value("counts", Json::object());
    return counts.value("brightest", 0) > 200;
  };
  EXPECT_TRUE(Client(config).await(R"({"class":"POLL","about":"sensors"})", "STATUS", is_bright));
  const auto set = [&](const std::string& exposure_us) {
    return crepesctl({"exposure", "--config", file, "--port",
                      std::to_string(config.subscription.port), "--pid",
                      std::to_string(daemon->pid()), "--exposure-us", exposure_us, "--json"});
  };

  const Ending dim = set("2");
  const Ending impossible = set("7000");

  EXPECT_EQ(dim.how, "exit code 0") << dim.errors;
  const Json camera = Json::parse(dim.output)["cameras"][0];
  EXPECT_EQ(camera["exposure_us"], 2.0);
  EXPECT_LT(camera["brightest"], 100);
  EXPECT_EQ(impossible.how, "exit code 1");
  EXPECT_NE(impossible.errors.find("longer than a frame"), std::string::npos) << impossible.errors;
  // What was refused has left nothing behind.
  EXPECT_EQ(load_config(file).value().cameras[0].device.light.exposure_us, 2.0);
}

TEST_F(OneRobot, IsWatchedOnceInJsonThoughItsNeighborIsMissing) {
  const Config config = pair_config(1, mesh_port_);
  const Runtime runtime(config, machine_);
  EXPECT_TRUE(Client(config).await_status([](const Json&) { return true; }));

  const Ending once =
      crepesctl({"watch", "--once", "--json", "--port", std::to_string(config.subscription.port)});

  EXPECT_EQ(once.how, "exit code 0");
  EXPECT_NE(once.output.find("STATUS"), std::string::npos) << once.output;
}

TEST_F(OneRobot, EndsTheSubscriptionOfAWatchThatNobodyReads) {
  const Config config = pair_config(1, mesh_port_);
  const Runtime runtime(config, machine_);
  EXPECT_TRUE(Client(config).await_status([](const Json&) { return true; }));
  const std::string watch =
      crepesctl_path() + " watch --json --port " + std::to_string(config.subscription.port);

  for (int i = 0; i <= config.subscription.max_per_address; ++i) {
    const Ending ending = run("/bin/sh", {"-c", watch + " | head -n 1"});
    EXPECT_NE(ending.output, "");
    EXPECT_EQ(ending.output.find("ERROR"), std::string::npos) << ending.output;
  }
}

TEST(ToolsAlone, LeaveARobotToTheDaemonThatHasItsId) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const Config config = pair_config(1, free_port());
  const std::string file = scratch.path() / "crepesd.yaml";
  std::ofstream(file) << write_config(config);
  const auto lock = RobotLock::claim(config.robot.id, config.net.interface, config.net.port);
  ASSERT_TRUE(lock) << lock.error().message;

  const Ending ending = run(crepesd_path(), {"--config", file});

  // Not one of the service's RestartPreventExitStatus.
  EXPECT_EQ(ending.how, "exit code 3") << ending.errors;
  EXPECT_NE(ending.errors.find("already runs on this machine"), std::string::npos);
}

TEST(ToolsAlone, ReplayNothingWhereNoRowOfASensorIsGood) {
  const TinySwarm files;
  files.write("r1/uwb0/data.csv", "#t_ns,peer,range,fp,rx\n10000000000,2,far,-80,-79\n");

  const Ending ending =
      crepesctl({"replay", files.dir().string(), "--out", (files.dir() / "out").string()});

  EXPECT_EQ(ending.how, "exit code 1");
  EXPECT_NE(ending.errors.find("uwb0/data.csv: none of 1 rows is good"), std::string::npos)
      << ending.errors;
}

TEST(ToolsAlone, SayWhyAReplayHasNoPoses) {
  const TinySwarm files;
  const std::string out = (files.dir() / "out").string();
  files.write("r1/imu0/data.csv", "");

  const Ending empty = crepesctl({"replay", files.dir().string(), "--out", out});
  files.write("r1/imu0/data.csv", "#t_ns,wx,wy,wz,ax,ay,az\n");
  const Ending header = crepesctl({"replay", files.dir().string(), "--out", out});

  for (const Ending& ending : {empty, header}) {
    EXPECT_EQ(ending.how, "exit code 1");
    EXPECT_NE(ending.errors.find("r1/imu0/data.csv: no samples, so there are no poses"),
              std::string::npos)
        << ending.errors;
  }
  EXPECT_NE(empty.errors.find("no header"), std::string::npos) << empty.errors;
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ToolsAlone, ReplayIntoADirectoryOfItsOwnOnly) {
  const TinySwarm files;
  const std::string swarm = files.dir().string();

  const Ending nowhere = crepesctl({"replay", swarm, "--out", ""});
  const Ending into_itself = crepesctl({"replay", swarm, "--out", swarm + "/"});

  EXPECT_EQ(nowhere.how, "exit code 2");
  EXPECT_NE(nowhere.errors.find("--out: names nothing"), std::string::npos) << nowhere.errors;
  EXPECT_EQ(into_itself.how, "exit code 1");
  EXPECT_NE(into_itself.errors.find("has a data set"), std::string::npos) << into_itself.errors;
  EXPECT_FALSE(std::filesystem::exists(files.dir() / "report.json"));
}

TEST(DaemonAlone, RefusesWarningsOnlyIfItIsStrict) {
  const TinySwarm files;  // without lever arms, on a mesh that is not there
  const std::string file = (files.dir() / "r1/crepesd.yaml").string();

  const Ending lenient = run(crepesd_path(), {"--check-config", file});
  const Ending strict = run(crepesd_path(), {"--check-config", file, "--strict"});

  EXPECT_EQ(lenient.how, "exit code 0");
  EXPECT_EQ(strict.how, "exit code 1");
  EXPECT_EQ(lenient.errors, strict.errors);
  for (const char* warning : {"net.interface: there is no such interface", "p_body_led"})
    EXPECT_NE(lenient.errors.find(warning), std::string::npos) << lenient.errors;
}

TEST(ToolsAlone, SayThatNobodyAnswersAndEndWithOne) {
  const std::string port = std::to_string(free_port());
  for (const char* command : {"status", "watch", "sources", "check"}) {
    const Ending ending = crepesctl({command, "--port", port});
    EXPECT_EQ(ending.how, "exit code 1") << command;
    EXPECT_NE(ending.errors.find("no answer from 127.0.0.1"), std::string::npos) << ending.errors;
  }
  EXPECT_EQ(crepesctl({"waitpose", "--peer", "2", "--timeout", "0.3", "--port", port}).how,
            "exit code 1");
}

TEST(ToolsAlone, EndWithTwoWhenTheyAreUsedWrongly) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{},
                                                {"dance"},
                                                {"waitpose"},
                                                {"status", "--nonsense"},
                                                {"waitpose", "--peer", "70000"},
                                                {"completion", "csh"},
                                                {"status", "--address", "home"}})
    EXPECT_EQ(crepesctl(words).how, "exit code 2") << (words.empty() ? "" : words.front());
  EXPECT_NE(crepesctl({"--help"}).output.find("Exit codes: 0"), std::string::npos);
}

TEST(ToolsAlone, WrapTheirHelp) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"--help"},
                                                {"keygen", "--help"},
                                                {"demo", "--help"},
                                                {"calibrate", "range", "--help"}}) {
    std::istringstream help(crepesctl(words).output);
    for (std::string line; std::getline(help, line);) EXPECT_LE(line.size(), 100U) << line;
  }
}

TEST(ToolsAlone, ReplaceNoFileThatTheyDidNotMake) {
  const TinySwarm files;
  const std::string swarm = files.dir().string();
  const std::string measurements = files.read("r1/imu0/data.csv");
  const std::string mcap = (files.dir() / "swarm.mcap").string();

  const Ending refused =
      crepesctl({"convert", swarm, "--to", "mcap", "--out", swarm + "/r1/imu0/data.csv"});
  const Ending first = crepesctl({"convert", swarm, "--to", "mcap", "--out", mcap});
  const Ending again = crepesctl({"convert", swarm, "--to", "mcap", "--out", mcap});

  EXPECT_EQ(refused.how, "exit code 1");
  EXPECT_NE(refused.errors.find("--force"), std::string::npos) << refused.errors;
  EXPECT_EQ(files.read("r1/imu0/data.csv"), measurements);
  EXPECT_EQ(first.how, "exit code 0") << first.errors;
  EXPECT_EQ(again.how, "exit code 0") << again.errors;
}

TEST(ToolsAlone, RefuseNumbersThatAreNone) {
  for (const char* number : {"nan", "NaN"}) {
    const Ending ending = crepesctl({"evaluate", "results", "--truth", "swarm", "--after", number});
    EXPECT_EQ(ending.how, "exit code 2") << number;
    EXPECT_NE(ending.errors.find("is no number"), std::string::npos) << ending.errors;
  }
  EXPECT_EQ(crepesctl({"exposure", "--exposure-us", "300", "--pid=-1"}).how, "exit code 2");
  for (const char* seed : {"--seed=-1", "--seed=99999999999999999999"}) {
    EXPECT_EQ(crepesctl({"replay", "swarm", "--out", "results", seed}).how, "exit code 2") << seed;
    EXPECT_EQ(crepesctl({"codebook", seed}).how, "exit code 2") << seed;
  }
}

TEST(ToolsAlone, NameNoBoundThatNobodyCouldReach) {
  const Ending sigma = crepesctl({"waitpose", "--peer", "2", "--max-sigma", "0"});
  const Ending seed = crepesctl({"demo", "--seed=-1"});

  EXPECT_EQ(sigma.how, "exit code 2");
  EXPECT_NE(sigma.errors.find("--max-sigma: 0 is no number above 0"), std::string::npos)
      << sigma.errors;
  EXPECT_EQ(seed.how, "exit code 2");
  EXPECT_NE(seed.errors.find("not in range 0 to 2147483647"), std::string::npos) << seed.errors;
}

TEST(ToolsAlone, TakeNoEmptyNameForTheWorkingDirectory) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"record", ""},
                                                {"view", ""},
                                                {"replay", "", "--out", "results"},
                                                {"evaluate", "results", "--truth", ""},
                                                {"calibrate", "imu", "", "--out", "imu.yaml"},
                                                {"led", "--port", "", "get"}}) {
    const Ending ending = crepesctl(words);
    EXPECT_EQ(ending.how, "exit code 2") << words.front();
    EXPECT_NE(ending.errors.find("names nothing"), std::string::npos) << ending.errors;
  }
}

TEST(ToolsAlone, RefuseOptionsThatChangeNothing) {
  const TinySwarm files;
  const std::string swarm = files.dir().string();
  const std::string out = (files.dir() / "out").string();
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--delayed", "r1"}, {"--no-forwarding"}}) {
    std::vector<std::string> all{"replay", swarm, "--out", out};
    all.insert(all.end(), words.begin(), words.end());
    EXPECT_EQ(crepesctl(all).how, "exit code 2") << words.front();
  }
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ToolsAlone, TakeTheBoardsPortBeforeOrBehindWhatToDo) {
  const Ending before = crepesctl({"led", "--port", "/nonexistent", "get"});
  const Ending behind = crepesctl({"led", "get", "--port", "/nonexistent"});

  EXPECT_EQ(behind.how, "exit code 1");
  EXPECT_EQ(behind.errors, before.errors);
}

TEST(ToolsAlone, LeaveTheEarlierResultWhereTheDiskIsFull) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto file = scratch.path() / "codebook.yaml";
  EXPECT_EQ(crepesctl({"codebook", "--ids", "5", "--out", file}).how, "exit code 0");
  const std::string before = read_text_file(file).value();

  const Ending ending = run("/bin/sh", {"-c", R"(trap '' XFSZ; ulimit -f 1; exec "$@")", "sh",
                                        crepesctl_path(), "codebook", "--ids", "5", "--out", file});

  EXPECT_EQ(ending.how, "exit code 1");
  EXPECT_EQ(read_text_file(file).value(), before);
}

TEST(ToolsAlone, NameTheNearestSubcommand) {
  const Ending misspelled = crepesctl({"wacht", "--once"});
  EXPECT_EQ(misspelled.how, "exit code 2");
  EXPECT_NE(misspelled.errors.find("crepesctl: there is no 'wacht'; did you mean 'watch'?"),
            std::string::npos)
      << misspelled.errors;

  const Ending inner = crepesctl({"calibrate", "camrea", "--out", "x"});
  EXPECT_NE(inner.errors.find("did you mean 'calibrate camera'?"), std::string::npos)
      << inner.errors;

  const Ending unlike = crepesctl({"xylophone"});
  EXPECT_EQ(unlike.how, "exit code 2");
  EXPECT_EQ(unlike.errors.find("did you mean"), std::string::npos) << unlike.errors;
}

/// Under script(1), which gives it a terminal of 80 columns: standard output and error as one.
std::string on_a_terminal(const std::string& command, const std::string& environment = "") {
  const Ending ending = run("/usr/bin/env", {"-u", "NO_COLOR", "TERM=xterm", "script", "-qec",
                                             "stty cols 80 rows 24; " + environment + " " +
                                                 crepesctl_path() + " " + command + " </dev/null",
                                             "/dev/null"});
  return ending.output;
}

TEST(ToolsOnATerminal, ShowABarAndRemoveIt) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string replay =
      "replay " + source_dir() + "/config/examples/recordings/two-robots --out ";

  const std::string shown = on_a_terminal(replay + (scratch.path() / "out").string());

  EXPECT_NE(shown.find("[#"), std::string::npos) << shown;
  // What remains on the last line is the summary alone.
  const std::size_t end = shown.find("2 robots");
  ASSERT_NE(end, std::string::npos) << shown;
  EXPECT_EQ(shown.substr(end - 2, 2), " \r");
}

/// Of one second, at ports that were free.
std::string demo_on_a_terminal(const std::string& environment) {
  std::string shown;
  do {
    shown = on_a_terminal("demo --scenario two --for 1 --port " + std::to_string(free_port()),
                          environment);
  } while (shown.find("choose another --port") != std::string::npos);
  return shown;
}

TEST(ToolsOnATerminal, UseColorsUnlessTheUserDoesNotWantThem) {
  const std::string colored = demo_on_a_terminal("");
  const std::string plain = demo_on_a_terminal("NO_COLOR=1");

  EXPECT_NE(colored.find("\x1b[1mpair"), std::string::npos) << colored;
  EXPECT_NE(plain.find("pair"), std::string::npos) << plain;
  EXPECT_EQ(plain.find("\x1b[1mpair"), std::string::npos) << plain;
}

TEST(ToolsAlone, MakeAKeyOnceOnly) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string file = scratch.path() / "mesh.key";

  EXPECT_EQ(crepesctl({"keygen", file}).how, "exit code 0");
  EXPECT_EQ(crepesctl({"keygen", file}).how, "exit code 1");
  EXPECT_EQ(std::filesystem::file_size(file), 32U);
}

TEST(ToolsAlone, MakeKeysThatFitTogether) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::string swarm = scratch.path() / "mesh.key";
  const std::string one = scratch.path() / "r1.key";
  const std::string two = scratch.path() / "r2.key";

  const Ending first = crepesctl({"keygen", swarm, one});
  const Ending second = crepesctl({"keygen", swarm, two});

  EXPECT_EQ(first.how, "exit code 0");
  EXPECT_EQ(second.how, "exit code 0");
  EXPECT_EQ(crepesctl({"keygen", swarm, two}).how, "exit code 1");
  EXPECT_EQ(first.output.substr(0, first.output.find('\n')),
            second.output.substr(0, second.output.find('\n')));  // the same swarm's key
  const std::string known = to_text(public_key_of(read_robot_key(one).value()));
  EXPECT_NE(first.output.find("\n  public_key: \"" + known + "\"\n"), std::string::npos)
      << first.output;
  EXPECT_EQ(second.output.find(known), std::string::npos);
}

TEST(ToolsAlone, CompleteTheirWordsInBash) {
  const std::string script =
      std::string("eval \"$(") + crepesctl_path() +
      " completion bash)\"; "
      "try() { COMP_WORDS=(crepesctl \"$@\"); COMP_CWORD=$#; _crepesctl; echo \"${COMPREPLY[*]}\"; "
      "}; try wait; try waitpose --t; try led s; try led set --bri";

  const Ending ending = run("/bin/bash", {"-c", script});

  EXPECT_EQ(ending.how, "exit code 0");
  EXPECT_EQ(ending.output, "waitpose\n--timeout\nset\n--brightness\n");
}

TEST(ToolsAlone, CompleteTheirWordsInZsh) {
  // zsh itself keeps of `found` what begins like the last word.
  const std::string script =
      "compdef() { :; }; _describe() { print -rl -- ${(P)2}; }; eval \"$(" + crepesctl_path() +
      " completion zsh)\"; "
      "try() { words=(crepesctl \"$@\"); CURRENT=$#words; _crepesctl; }; "
      "try '' | grep ^wait; try waitpose - | grep ^--t; try led '' | grep ^set; "
      "try led set - | grep ^--bri";

  const Ending ending = run("/usr/bin/zsh", {"-fc", script});

  EXPECT_EQ(ending.how, "exit code 0") << ending.errors;
  EXPECT_EQ(
      ending.output,
      "waitpose:Wait for a neighbor's pose; exit code 1 and the reason if there is none in "
      "time\n--timeout:seconds to wait\nset:Store a robot's pattern on the board and read it back\n"
      "--brightness:in percent: one value for all LEDs, or one for each of six\n");
}

TEST(ToolsAlone, CompleteTheirWordsInFish) {
  const std::string script = crepesctl_path() +
                             " completion fish | source; for line in 'wait' 'waitpose --t' "
                             "'led s' 'led set --bri'; complete -C \"crepesctl $line\"; end";

  const Ending ending = run("/usr/bin/fish", {"--no-config", "-c", script});

  EXPECT_EQ(ending.how, "exit code 0") << ending.errors;
  EXPECT_EQ(ending.output,
            "waitpose\tWait for a neighbor's pose; exit code 1 and the reason if there is none in "
            "time\n--timeout\tseconds to wait\nset\tStore a robot's pattern on the board and read "
            "it back\n"
            "--brightness\tin percent: one value for all LEDs, or one for each of six\n");
}

}  // namespace
}  // namespace crepes::tools_test
