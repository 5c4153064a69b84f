#include "config/reloading/config_change.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "config/writing/config_writer.hpp"

namespace crepes {
namespace {

/// Visits every setting of a config struct; a list is one setting. Calls `on_setting(key, value,
/// text, when)`, where `text` is the value as YAML.
template <class OnSetting>
class SettingWalk {
 public:
  SettingWalk(OnSetting& on_setting, std::string prefix, Change when)
      : on_setting_(on_setting), prefix_(std::move(prefix)), when_(when) {}

  template <class T, class... Rest>
  void required(std::string_view key, T& value, const Rest&... rest) {
    leaf(key, value, [&](ConfigWriter& writer) { writer.required(key, value, rest...); });
  }
  template <class T, class... Rest>
  void field(std::string_view key, T& value, const Rest&... rest) {
    leaf(key, value, [&](ConfigWriter& writer) { writer.field(key, value, rest...); });
  }
  template <class Enum, class Choices>
  void choice(std::string_view key, Enum& value, const Choices& choices, std::string_view help) {
    leaf(key, value, [&](ConfigWriter& writer) { writer.choice(key, value, choices, help); });
  }
  template <class Section>
  void section(std::string_view key, Section& nested, Change when, std::string_view /*help*/) {
    SettingWalk walk(on_setting_, fmt::format("{}{}.", prefix_, key), when);
    nested.visit(walk);
  }
  template <class Section>
  void section(std::string_view key, Section& nested, std::string_view help) {
    section(key, nested, when_, help);
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, Change when, std::string_view help) {
    ConfigWriter writer;
    writer.list(key, items, help);
    on_setting_(prefix_ + std::string(key), items, writer.text(), when);
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    list(key, items, when_, help);
  }
  template <class Item>
  void optional_list(std::string_view key, std::vector<Item>& items, std::string_view help) {
    list(key, items, help);
  }
  void reference(std::string_view /*key*/, std::string_view /*help*/) {}

 private:
  template <class T, class Write>
  void leaf(std::string_view key, T& value, const Write& write) {
    ConfigWriter writer;
    write(writer);
    on_setting_(prefix_ + std::string(key), value, writer.text(), when_);
  }

  OnSetting& on_setting_;
  std::string prefix_;
  Change when_;
};

template <class OnSetting>
void walk_settings(Config& config, OnSetting on_setting) {
  SettingWalk<OnSetting> walk(on_setting, "", Change::kRestart);
  config.visit(walk);
}

/// Takes over the light of every camera that both have, whatever else of it waits for a
/// restart. Adds the keys that change.
void change_lights(const std::vector<CameraConfig>& wanted, std::vector<CameraConfig>& cameras,
                   std::vector<std::string>& live) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto same = std::ranges::find_if(wanted, [&](const CameraConfig& camera) {
      return camera.calibration.name == cameras[i].calibration.name;
    });
    if (same == wanted.end()) continue;
    CameraLight& light = cameras[i].device.light;
    const CameraLight before = std::exchange(light, same->device.light);
    if (before.exposure_us != light.exposure_us)
      live.push_back(fmt::format("cameras[{}].exposure_us", i));
    if (before.gain != light.gain) live.push_back(fmt::format("cameras[{}].gain", i));
    if (std::exchange(cameras[i].device.exposure, same->device.exposure) != same->device.exposure)
      live.push_back(fmt::format("cameras[{}].exposure", i));
  }
}

}  // namespace

ConfigChange plan_reload(const Config& running, const Config& wanted) {
  struct Setting {
    void* value;
    std::string text;
  };
  Config source = wanted;  // visit() needs mutable fields
  std::vector<Setting> settings;
  walk_settings(source, [&](const std::string& /*key*/, auto& value, const std::string& text,
                            Change /*when*/) {
    settings.push_back({&value, text});
  });

  ConfigChange change;
  change.config = running;
  change_lights(wanted.cameras, change.config.cameras, change.live);
  std::size_t next = 0;
  walk_settings(change.config, [&]<class T>(const std::string& key, T& value,
                                            const std::string& text, Change when) {
    // The same walk over the same schema: the same types in the same order.
    const Setting& setting = settings[next++];
    if (setting.text == text) return;
    (when == Change::kLive ? change.live : change.restart).push_back(key);
    if (when == Change::kLive) value = *static_cast<T*>(setting.value);
  });
  return change;
}

}  // namespace crepes
