#include <fmt/core.h>
#include <gtest/gtest.h>

#include <string>

#include "config/reading/config_file.hpp"
#include "tests/support/config_texts.hpp"

namespace crepes::config_rules_test {
namespace {

using test::faults_of;
using test::replaced;

TEST(ConfigRules, RefusesPatternsThatCannotBlinkAnId) {
  const std::string good = "011111111111111111";
  EXPECT_EQ(faults_of(replaced(good, "01112111")),
            R"(f:4: swarm.members[0].pattern: a pattern is made of 0 and 1 only, not "01112111")");
  EXPECT_EQ(faults_of(replaced(good, "0111")),
            "f:4: swarm.members[0].pattern: a pattern has 8 to 32 slots, not 4");
  EXPECT_EQ(faults_of(replaced(good, "11111111")),
            "f:4: swarm.members[0].pattern: a pattern has both lit and dark slots");
}

TEST(ConfigRules, RefusesCodesThatNoCameraCanTellApart) {
  EXPECT_EQ(faults_of(replaced("duty: 0.3", "pattern: \"111111111111110111\"")),
            "f:5: swarm.members[1].pattern: the same pattern, shifted, as that of "
            "swarm.members[0]: no camera can tell the two apart");
  EXPECT_EQ(faults_of(replaced("pattern: \"011111111111111111\"", "duty: 0.3")),
            "f:5: swarm.members[1].duty: within 0.02 of the duty of swarm.members[0]: no camera "
            "can tell the two apart");
}

TEST(ConfigRules, KnowsAPatternThatIsLitOnceForADuty) {
  std::string text = replaced("011111111111111111", "11110000");
  text.replace(text.find("duty: 0.3"), 9, "duty: 0.51");
  text.replace(text.find("swarm:"), 6, "swarm:\n  slot_ms: 5\n  period_ms: 40");

  EXPECT_EQ(faults_of(text),
            "f:7: swarm.members[1].duty: within 0.02 of the pattern of swarm.members[0]: no camera "
            "can tell the two apart");
}

TEST(ConfigRules, KnowsARepeatedPatternForTheSameLight) {
  std::string text = replaced("011111111111111111", "0111101111");
  text.replace(text.find("duty: 0.3"), 9, "pattern: \"110111101111011\"");

  EXPECT_NE(faults_of(text).find("the same pattern, shifted"), std::string::npos);
}

TEST(ConfigRules, WantsExactlyOneCodeAMember) {
  const std::string expected = "f:5: swarm.members[1]: give exactly one of pattern and duty";
  EXPECT_EQ(faults_of(replaced(", duty: 0.3", "")), expected);
  EXPECT_EQ(faults_of(replaced("duty: 0.3", "duty: 0.3, pattern: \"0011111111\"")), expected);
}

TEST(ConfigRules, WantsDistinctMembersAndThisRobotAmongThem) {
  EXPECT_EQ(faults_of(replaced("{id: 2, name: r2", "{id: 1, name: r2, uwb_id: 9")),
            "f:5: swarm.members[1].id: 1 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("name: r2", "name: r1")),
            "f:5: swarm.members[1].name: r1 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("name: r2", "name: r2, uwb_id: 1")),
            "f:5: swarm.members[1].uwb_id: 1 is taken by swarm.members[0]");
  std::string both_zero = replaced("name: r2", "name: r2, uwb_id: 0");
  both_zero.replace(both_zero.find("name: r1"), 8, "name: r1, uwb_id: 0");
  EXPECT_EQ(faults_of(both_zero), "f:5: swarm.members[1].uwb_id: 0 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("{id: 1}", "{id: 3}")),
            "f:1: robot.id: 3 is not among swarm.members");
}

TEST(ConfigRules, RefusesNamesThatLeadOutOfADirectory) {
  EXPECT_EQ(faults_of(replaced("name: r2", "name: ../r2")),
            "f:5: swarm.members[1].name: a name is 1 to 32 letters, digits, - or _, not \"../r2\"");
}

TEST(ConfigRules, WantsMembersAndCameras) {
  const std::string text = "robot: {id: 1}\nswarm: {members: []}\ncameras: []\n";

  EXPECT_EQ(faults_of(text),
            "f:2: swarm.members: is empty: list every robot, this one too\n"
            "f:3: cameras: is empty: without a camera nobody is recognized");
}

TEST(ConfigRules, PushesPosesToOneHostEach) {
  const auto with = [](const std::string& push) {
    return replaced("uwb: {noise_m: 0.05}", "subscription: {push: [" + push + "]}");
  };

  EXPECT_EQ(faults_of(with("{address: 10.0.0.9, port: 9870, rate_hz: 20, format: json}, {}")), "");
  EXPECT_EQ(faults_of(with("{address: laptop}")),
            "f:11: subscription.push[0].address: \"laptop\" is not one host's numeric IPv4 or IPv6 "
            "address");
  for (const char* nobody : {"255.255.255.255", "239.1.2.3", "0.0.0.0", "\"ff02::1\""})
    EXPECT_NE(faults_of(with(std::string("{address: ") + nobody + "}")).find("is not one host's"),
              std::string::npos);
  EXPECT_EQ(faults_of(with("{}, {port: 47475}")),
            "f:11: subscription.push[1].port: is the daemon's own");
  EXPECT_NE(faults_of(with("{format: xml}")).find("expected one of json, plotjuggler"),
            std::string::npos);
  EXPECT_EQ(faults_of(with("{}, {}, {}, {}, {}, {}, {}, {}, {}")),
            "f:11: subscription.push: more than 8");
}

TEST(ConfigRules, ServesPosesAtNumericAddresses) {
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}",
                               "subscription: {listen: [\"::1\", 0.0.0.0, localhost]}")),
            "f:11: subscription.listen: \"localhost\" is not a numeric IPv4 or IPv6 address");
}

TEST(ConfigRules, RefusesAddressesThatCannotServe) {
  const auto listening = [](const std::string& addresses) {
    return faults_of(
        replaced("uwb: {noise_m: 0.05}", "subscription: {listen: [" + addresses + "]}"));
  };
  EXPECT_EQ(listening("224.0.0.1"),
            "f:11: subscription.listen: \"224.0.0.1\" is no host's address");
  EXPECT_EQ(listening("127.0.0.1, 127.0.0.1"),
            "f:11: subscription.listen: \"127.0.0.1\" is listed twice");
  EXPECT_EQ(
      listening("127.0.0.1, \"::1\", 0.0.0.0"),
      "f:11: subscription.listen: \"127.0.0.1\" is contained in \"0.0.0.0\": name one of them");
  EXPECT_EQ(listening("127.0.0.1, \"::\", \"::1\""),
            "f:11: subscription.listen: \"::1\" is contained in \"::\": name one of them");
  EXPECT_EQ(listening("0.0.0.0, \"::\""), "");  // each of its own family only
}

TEST(ConfigRules, RefusesNumbersThatCannotBeMeant) {
  const auto with = [](const std::string& from, const std::string& to) {
    const std::string faults = faults_of(replaced(from, to));
    EXPECT_FALSE(faults.empty()) << to;
    return faults.substr(0, faults.find(':', faults.find(':', 2) + 2));
  };
  EXPECT_EQ(with("0.01], [1", "1.0e+4], [1"), "f:10: cameras[0].T_cam_imu");
  EXPECT_EQ(with("0.01], [1", "1.0e+300], [1"), "f:10: cameras[0].T_cam_imu");
  EXPECT_EQ(with("316.7", "1.0e-300"), "f:8: cameras[0].intrinsics");
  EXPECT_EQ(with("uwb:", "imu: {accelerometer: {bias: [1.0e+300, 0, 0]}}\nuwb:"),
            "f:11: imu.accelerometer.bias");
  EXPECT_EQ(with("uwb: {", "imu: {port: /dev/ttyUSB0}\nuwb: {port: /dev/ttyUSB0, "),
            "f:12: uwb.port");
  EXPECT_EQ(with("duty: 0.3", "duty: 0.3, p_body_uwb: [0, 0, 60]"),
            "f:5: swarm.members[1].p_body_uwb");
  EXPECT_EQ(with("uwb:", "net: {interface: " + std::string(5000, 'x') + "}\nuwb:"),
            "f:11: net.interface");
  EXPECT_EQ(with("uwb:", "recording: {socket: /" + std::string(200, 'x') + "}\nuwb:"),
            "f:11: recording.socket");
  EXPECT_EQ(with("uwb:", "recording: {socket: \"/a\\0b\"}\nuwb:"), "f:11: recording.socket");
}

TEST(ConfigRules, WarnsOfWhatCanHardlyBeMeant) {
  const auto warnings_of = [](const std::string& text) {
    const CheckedConfig checked = check_config_text(text, "f");
    EXPECT_TRUE(checked.faults.empty());
    std::string keys;
    for (const ConfigFault& warning : checked.warnings)
      keys += fmt::format("{} {}\n", warning.line, warning.key);
    return keys;
  };
  const std::string sound =
      replaced("duty: 0.3", "duty: 0.3, p_body_led: [0.1, 0, 0], p_body_uwb: [0, 0, 0.1]");
  const auto and_in = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    text.replace(text.find("\"}"), 2, "\", p_body_led: [0.1, 0, 0], p_body_uwb: [0, 0, 0.1]}");
    return text.replace(text.find(from), from.size(), to) + "net: {interface: lo}\n";
  };

  EXPECT_EQ(warnings_of(and_in("id: 1", "id: 1")), "");
  EXPECT_EQ(warnings_of(sound + "net: {interface: lo}\n"),
            "4 swarm.members[0].p_body_led\n4 swarm.members[0].p_body_uwb\n");
  EXPECT_EQ(warnings_of(and_in("[0.1, 0, 0]", "[3, 0, 0]")), "4 swarm.members[0].p_body_led\n");
  for (const char* name : {"name: truth", "name: \"2\""})
    EXPECT_EQ(warnings_of(and_in("name: r1", name)), "4 swarm.members[0].name\n") << name;
  EXPECT_EQ(warnings_of(and_in("[0.1, 0, 0]", "[0.1, 0, 0], ring_leds: 8")),
            "4 swarm.members[0].ring_leds\n");
  EXPECT_EQ(warnings_of(and_in("[0.1, 0, 0]", "[0.1, 0, 0], ring_leds: 8, ring_radius_m: 0.03")),
            "");
  EXPECT_EQ(warnings_of(and_in("[[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]",
                               "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]")),
            "10 cameras[0].T_cam_imu\n");
  EXPECT_EQ(warnings_of(and_in("resolution:", "rate_hz: 120\n    resolution:")),
            "9 cameras[0].rate_hz\n");
  EXPECT_EQ(
      warnings_of(and_in("resolution:", "driver: folder\n    folder: /nowhere\n    resolution:")),
      "10 cameras[0].folder\n");
  EXPECT_EQ(warnings_of(and_in("{noise_m: 0.05}", "{noise_m: 0.05}") + "#"), "");
  std::string elsewhere = and_in("id: 1", "id: 1");
  elsewhere.replace(elsewhere.find("interface: lo"), 13, "interface: nowhere9");
  EXPECT_EQ(warnings_of(elsewhere), "12 net.key_file\n12 net.interface\n");
}

}  // namespace
}  // namespace crepes::config_rules_test
