/// Which settings change while the daemon runs: every key of the schema, one after the other.
#include "config/reloading/config_change.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"

namespace crepes::config_change_test {
namespace {

/// Changes the nth setting of a config struct and remembers which that was.
class NthSetting {
 public:
  explicit NthSetting(int n) : left_(n) {}

  [[nodiscard]] bool is_found() const { return left_ < 0; }
  [[nodiscard]] const std::string& key() const { return key_; }
  [[nodiscard]] Change when() const { return when_; }

  template <class T, class... Rest>
  void required(const std::string& key, T& value, const Rest&... /*rest*/) {
    visit_one(key, value);
  }
  template <class T, class... Rest>
  void field(const std::string& key, T& value, const Rest&... /*rest*/) {
    visit_one(key, value);
  }
  template <class Enum, class Choices>
  void choice(const std::string& key, Enum& value, const Choices& choices, const char* /*help*/) {
    if (!is_next(key)) return;
    value = value == choices.front().value ? choices.back().value : choices.front().value;
  }
  template <class Section>
  void section(const std::string& key, Section& nested, Change when, const char* help) {
    section_when_ = when;
    section(key, nested, help);
  }
  template <class Section>
  void section(const std::string& key, Section& nested, const char* /*help*/) {
    const std::string outer = prefix_;
    prefix_ += key + '.';
    nested.visit(*this);
    prefix_ = outer;
  }
  template <class Item>
  void list(const std::string& key, std::vector<Item>& items, Change when, const char* help) {
    section_when_ = when;
    list(key, items, help);
  }
  /// A change in an item is a change of the list.
  template <class Item>
  void list(const std::string& key, std::vector<Item>& items, const char* /*help*/) {
    const bool was_found = is_found();
    for (Item& item : items) item.visit(*this);
    if (is_next(key)) items.emplace_back();
    if (!was_found && is_found()) name_change_in(key);
  }
  template <class Item>
  void optional_list(const std::string& key, std::vector<Item>& items, const char* help) {
    list(key, items, help);
  }
  void reference(const std::string& /*key*/, const char* /*help*/) {}

 private:
  /// Of a camera, exposure and gain change while it runs.
  void name_change_in(const std::string& key) {
    const bool is_light = key_ == "exposure" || key_ == "exposure_us" || key_ == "gain";
    key_ = is_light ? prefix_ + key + "[0]." + key_ : prefix_ + key;
    if (is_light) when_ = Change::kLive;
  }

  bool is_next(const std::string& key) {
    if (left_-- != 0) return false;
    key_ = prefix_ + key;
    when_ = section_when_;
    return true;
  }
  template <class T>
  void visit_one(const std::string& key, T& value) {
    if (is_next(key)) change(value);
  }

  static void change(bool& value) { value = !value; }
  static void change(int& value) { ++value; }
  static void change(double& value) { value += 1; }
  static void change(std::string& value) { value += 'x'; }
  static void change(RobotId& value) { ++value.value; }
  static void change(Eigen::Vector3d& value) { value.x() += 1; }
  static void change(Eigen::Matrix3d& value) { value(0, 1) += 1; }
  static void change(std::array<int, 2>& value) { ++value[0]; }
  static void change(std::vector<double>& value) { value.push_back(1); }
  static void change(std::vector<std::string>& value) { value.emplace_back("x"); }
  static void change(Pose& value) { value.p.x() += 1; }
  template <class T>
  static void change(std::optional<T>& value) {
    change(value ? *value : value.emplace());
  }

  int left_;
  std::string prefix_;
  std::string key_;
  Change when_ = Change::kRestart;
  Change section_when_ = Change::kRestart;
};

Config reference() { return check_config_text(reference_config(), "reference").config; }

TEST(ConfigChange, TakesEveryLiveSettingAtOnceAndLeavesEveryOtherAsItIs) {
  const Config running = reference();
  int live = 0;
  int restart = 0;
  for (int n = 0;; ++n) {
    Config wanted = running;
    NthSetting nth(n);
    wanted.visit(nth);
    if (!nth.is_found()) break;

    const ConfigChange change = plan_reload(running, wanted);

    const std::vector<std::string> one{nth.key()};
    const bool is_live = nth.when() == Change::kLive;
    EXPECT_EQ(change.live, is_live ? one : std::vector<std::string>{}) << nth.key();
    EXPECT_EQ(change.restart, is_live ? std::vector<std::string>{} : one) << nth.key();
    EXPECT_EQ(write_config(change.config), write_config(is_live ? wanted : running)) << nth.key();
    ++(is_live ? live : restart);
  }
  EXPECT_GT(live, 70);
  EXPECT_GT(restart, 20);
}

TEST(ConfigChange, SaysNothingOfWhatStaysTheSame) {
  const ConfigChange change = plan_reload(reference(), reference());

  EXPECT_TRUE(change.live.empty());
  EXPECT_TRUE(change.restart.empty());
}

TEST(ConfigChange, GoesOnNamingWhatWaitsForARestart) {
  const Config running = reference();
  Config wanted = running;
  wanted.cameras[0].calibration.rate_hz = 50;
  wanted.uwb.noise.noise_m = 0.5;
  const ConfigChange first = plan_reload(running, wanted);
  wanted.uwb.noise.noise_m = 0.6;

  const ConfigChange second = plan_reload(first.config, wanted);

  EXPECT_EQ(second.live, std::vector<std::string>{"uwb.noise_m"});
  EXPECT_EQ(second.restart, std::vector<std::string>{"cameras"});
}

TEST(ConfigChange, TakesTheLightOfACameraThatWaitsForARestart) {
  const Config running = reference();
  Config wanted = running;
  wanted.cameras[0].device.light.exposure_us = 300;
  wanted.cameras[0].calibration.rate_hz = 50;

  const ConfigChange change = plan_reload(running, wanted);

  EXPECT_EQ(change.live, std::vector<std::string>{"cameras[0].exposure_us"});
  EXPECT_EQ(change.restart, std::vector<std::string>{"cameras"});
  EXPECT_EQ(change.config.cameras[0].device.light.exposure_us, 300);
  EXPECT_EQ(change.config.cameras[0].calibration.rate_hz, running.cameras[0].calibration.rate_hz);
}

TEST(ConfigChange, GivesNoLightToACameraOfAnotherName) {
  const Config running = reference();
  Config wanted = running;
  wanted.cameras[0].calibration.name = "other";
  wanted.cameras[0].device.light.gain = 3;

  const ConfigChange change = plan_reload(running, wanted);

  EXPECT_TRUE(change.live.empty());
  EXPECT_EQ(change.restart, std::vector<std::string>{"cameras"});
  EXPECT_FALSE(change.config.cameras[0].device.light.gain);
}

}  // namespace
}  // namespace crepes::config_change_test
