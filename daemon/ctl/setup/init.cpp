#include "daemon/ctl/setup/init.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/setup/swarm_members.hpp"
#include "drivers/base/number_text.hpp"
#include "estimator/vision/codebook.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kMembersName = "swarm.yaml";
constexpr std::string_view kDevicesName = "crepesd.d/10-devices.yaml";

/// Thrown and caught in this file only: the first question without an answer ends the interview.
struct Unanswered {
  Error error;
};

template <class T>
T taken(Result<T> result) {
  if (!result) throw Unanswered{result.error()};
  return std::move(*result);
}

std::string number_fault(const std::string& text, double min, double max) {
  double value = 0.0;
  if (!parse_number(text, value).empty()) return "expected a number";
  return value >= min && value <= max ? "" : fmt::format("must be {} to {}", min, max);
}

double number_in(const std::string& text) {
  double value = 0.0;
  static_cast<void>(parse_number(text, value));
  return value;
}

/// The numbers in "1 2 3" or "1,2,3"; empty if it has anything else.
std::vector<double> numbers_in(std::string text) {
  std::ranges::replace(text, ',', ' ');
  std::ranges::replace(text, 'x', ' ');
  std::vector<double> numbers;
  for (std::size_t at = text.find_first_not_of(' '); at != std::string::npos;
       at = text.find_first_not_of(' ', at)) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    double value = 0.0;
    if (!parse_number(std::string_view(text).substr(at, end - at), value).empty()) return {};
    numbers.push_back(value);
    at = end;
  }
  return numbers;
}

Eigen::Vector3d vector_of(const std::vector<double>& numbers) {
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::string numbers_text(const std::vector<double>& numbers) {
  std::string text;
  for (const double number : numbers) text += fmt::format("{}{}", text.empty() ? "" : " ", number);
  return text;
}

/// Asks for what the options do not say.
class Interview {
 public:
  Interview(const InitOptions& options, Questions& questions)
      : options_(options), questions_(questions) {
    if (options.search_devices) found_ = find_devices(options.devices);
  }

  RobotPlan plan() {
    RobotPlan plan;
    choose_members(plan);
    plan.camera = camera();
    plan.imu = serial(options_.imu_port, false);
    plan.uwb = serial(options_.uwb_port, true);
    plan.interface =
        options_.interface ? *options_.interface : ask("network interface of the mesh", "bat0", is_given);
    return plan;
  }

 private:
  static std::string is_given(const std::string& answer) {
    return answer.empty() ? "expected an answer" : "";
  }

  std::string ask(const std::string& question, const std::string& proposal,
                  const Questions::Check& check) {
    return taken(questions_.ask(question, proposal, check));
  }
  double ask_number(const std::string& question, double proposal, double min, double max) {
    return number_in(ask(question, fmt::format("{}", proposal), [&](const std::string& answer) {
      return number_fault(answer, min, max);
    }));
  }
  double given_or_asked(const std::optional<double>& given, const std::string& question,
                        double proposal, double min, double max) {
    return given ? *given : ask_number(question, proposal, min, max);
  }
  std::vector<double> ask_numbers(const std::string& question, const std::vector<double>& proposal,
                                  double least, double most) {
    return numbers_in(ask(question, numbers_text(proposal), [&](const std::string& answer) {
      const std::vector<double> numbers = numbers_in(answer);
      const bool are_good =
          numbers.size() == proposal.size() &&
          std::ranges::all_of(numbers, [&](double x) { return x >= least && x <= most; });
      return are_good
                 ? std::string()
                 : fmt::format("expected {} numbers, each {} to {}", proposal.size(), least, most);
    }));
  }
  Eigen::Vector3d arm(const std::optional<std::vector<double>>& given, const std::string& what) {
    constexpr double kLongestArm = 5.0;
    return vector_of(given
                         ? *given
                         : ask_numbers(what + " from the IMU, x y z in m; 0 0 0: not yet measured",
                                       {0.0, 0.0, 0.0}, -kLongestArm, kLongestArm));
  }

  void choose_members(RobotPlan& plan) {
    const fs::path file = options_.dir / kMembersName;
    std::error_code error;
    if (!options_.robots && fs::exists(file, error))
      plan.members = taken(load_members(file)).members;
    const auto ids = [&] {
      std::string text;
      for (const MemberConfig& member : plan.members)
        text += fmt::format("{}{}", text.empty() ? "" : ", ", member.id.value);
      return text;
    };
    const auto id_fault = [&](const std::string& answer) {
      constexpr int kLastId = 65534;
      int number = 0;
      if (!parse_number(answer, number).empty()) return std::string("expected a whole number");
      if (number < 1 || number > kLastId) return fmt::format("must be 1 to {}", kLastId);
      const auto id = RobotId{static_cast<std::uint16_t>(number)};
      const bool is_member =
          plan.members.empty() || std::ranges::count(plan.members, id, &MemberConfig::id) > 0;
      return is_member ? std::string() : fmt::format("{} has the members {}", file.string(), ids());
    };
    const std::string given = options_.id ? std::to_string(*options_.id) : "";
    if (const std::string fault = given.empty() ? "" : id_fault(given); !fault.empty())
      throw Unanswered{{ErrorCode::kUsage, "--id: " + fault}};
    const std::string id = given.empty() ? ask("id of this robot (--id)",
                                               questions_.has_answers() ? "1" : "", id_fault)
                                         : given;
    plan.id = RobotId{static_cast<std::uint16_t>(number_in(id))};
    if (plan.members.empty()) {
      plan.members = new_members(plan.id);
    } else {
      check_arms(plan, file);
    }
  }

  /// The file of the members stays as it is, so it must have what the options say.
  void check_arms(const RobotPlan& plan, const fs::path& file) const {
    const auto own = std::ranges::find(plan.members, plan.id, &MemberConfig::id);
    const auto check = [&](const std::optional<std::vector<double>>& given,
                           const Eigen::Vector3d& kept, const char* option, const char* key) {
      if (!given || vector_of(*given) == kept) return;
      throw Unanswered{{ErrorCode::kUsage,
                        fmt::format("{}: {} is there and stays as it is: write {} of robot {} into "
                                    "it",
                                    option, file.string(), key, plan.id.value)}};
    };
    check(options_.p_body_led, own->p_body_led, "--led", "p_body_led");
    check(options_.p_body_uwb, own->p_body_uwb, "--uwb", "p_body_uwb");
  }

  /// Robots 1 to n, with the shortest patterns that a camera can distinguish.
  std::vector<MemberConfig> new_members(RobotId self) {
    constexpr double kMostRobots = 64;
    if (self.value > kMostRobots) {
      throw Unanswered{{ErrorCode::kUsage,
                        fmt::format("id {}: ids above {} need a swarm.yaml: crepesctl codebook",
                                    self.value, kMostRobots)}};
    }
    const auto least = std::max<double>(2.0, self.value);
    const double count =
        options_.robots ? static_cast<double>(*options_.robots)
                        : ask_number("number of robots in the swarm", least, least, kMostRobots);
    if (count < least || count > kMostRobots) {
      throw Unanswered{{ErrorCode::kUsage,
                        fmt::format("number of robots: must be {} to {}, with robot {} among them",
                                    least, kMostRobots, self.value)}};
    }
    const Eigen::Vector3d p_body_led = arm(options_.p_body_led, "center of the LED ring");
    const Eigen::Vector3d p_body_uwb = arm(options_.p_body_uwb, "UWB antenna");
    const Codebook book = search_codebook({}, static_cast<std::size_t>(count));
    std::vector<MemberConfig> members;
    for (const std::string& pattern : book.patterns) {
      MemberConfig& member = members.emplace_back();
      member.id = RobotId{static_cast<std::uint16_t>(members.size())};
      member.name = fmt::format("r{}", members.size());
      member.pattern = pattern;
      member.p_body_led = p_body_led;
      member.p_body_uwb = p_body_uwb;
    }
    return members;
  }

  PlannedCamera camera() {
    PlannedCamera camera;
    choose_camera(camera);
    constexpr double kLeastSide = 16;
    constexpr double kMostSide = 2048;
    std::vector<double> size{static_cast<double>(camera.resolution[0]),
                             static_cast<double>(camera.resolution[1])};
    size = options_.resolution
               ? std::vector<double>(options_.resolution->begin(), options_.resolution->end())
               : ask_numbers("resolution, width and height in pixels", size, kLeastSide, kMostSide);
    camera.resolution = {static_cast<int>(size[0]), static_cast<int>(size[1])};
    camera.rate_hz = given_or_asked(options_.rate_hz, "frames a second", camera.rate_hz, 10, 1000);
    camera.fov_deg = given_or_asked(
        options_.fov_deg, "field of view of the lens in degrees, roughly", camera.fov_deg, 60, 220);
    const std::string look =
        options_.look ? *options_.look : ask("where the camera looks", "forward", look_fault);
    for (const Choice<Look>& choice : kLooks)
      if (choice.name == look) camera.look = choice.value;
    return camera;
  }

  static std::string look_fault(const std::string& answer) {
    const bool is_known = std::ranges::count(kLooks, answer, &Choice<Look>::name) > 0;
    return is_known ? "" : "expected forward, backward, left, right, up or down";
  }

  void choose_camera(PlannedCamera& camera) {
    if (options_.camera_driver) {
      camera.driver = *options_.camera_driver;
      camera.device = options_.camera_device.value_or("");
      return;
    }
    std::string question = "camera: 0 none";
    for (std::size_t i = 0; i < found_.cameras.size(); ++i)
      question += fmt::format(", {} {}", i + 1, found_.cameras[i].found.description);
    if (found_.cameras.empty()) return;
    const auto most = static_cast<double>(found_.cameras.size());
    const double chosen = found_.cameras.size() == 1 ? 1.0 : ask_number(question, 1, 0, most);
    if (chosen < 1) return;
    const CameraDevice& device = found_.cameras[static_cast<std::size_t>(chosen) - 1];
    camera.driver = device.driver;
    camera.device = device.found.device;
  }

  /// The IMU of the kernel that is named; or the only one, if there is none on a serial port.
  [[nodiscard]] std::optional<PlannedSerial> kernel_imu(const std::optional<std::string>& given,
                                                        bool is_alone) const {
    const std::vector<FoundIioImu>& imus = found_.kernel_imus;
    const bool is_only = !given && is_alone && imus.size() == 1;
    const bool is_named = given && std::ranges::count(imus, *given, &FoundIioImu::port) > 0;
    if (!is_only && !is_named) return std::nullopt;
    return PlannedSerial{.port = is_named ? *given : imus.front().port, .protocol = "iio"};
  }

  PlannedSerial serial(const std::optional<std::string>& given, bool is_uwb) {
    std::vector<const SerialDevice*> fitting;
    for (const SerialDevice& device : found_.serial)
      if (device.speaks && is_of_uwb(*device.speaks) == is_uwb) fitting.push_back(&device);
    std::string proposal = fitting.empty() ? "" : fitting.front()->port;
    std::string others;
    for (const SerialDevice* device : fitting) others += " " + device->port;
    const std::string question = fmt::format(
        "serial port of the {}{}", is_uwb ? "UWB module" : "IMU",
        fitting.size() > 1 ? "; found:" + others : "; empty if it is not connected yet");
    const auto any = [](const std::string& /*answer*/) { return std::string(); };
    if (const auto imu = is_uwb ? std::nullopt : kernel_imu(given, fitting.empty())) return *imu;
    PlannedSerial line;
    line.port = given ? *given : fitting.size() == 1 ? proposal : ask(question, proposal, any);
    const auto same = std::ranges::find(fitting, line.port, &SerialDevice::port);
    if (same == fitting.end()) return line;
    line.baud = (*same)->baud;
    line.protocol =
        (*same)->speaks == SerialProtocol::kNlink ? "linktrack" : name_of(*(*same)->speaks);
    return line;
  }

  const InitOptions& options_;
  Questions& questions_;
  ConnectedDevices found_;
};

struct PlannedFile {
  fs::path path;
  std::string text;
};

std::vector<PlannedFile> files_of(const RobotPlan& plan, const InitOptions& options) {
  std::vector<PlannedFile> files{{options.dir / "crepesd.yaml", robot_file(plan)},
                                 {options.dir / kDevicesName, devices_file(plan)},
                                 {options.dir / "camchain-imucam.yaml", lens_file(plan)}};
  std::error_code error;
  const fs::path members = options.dir / kMembersName;
  if (options.robots || !fs::exists(members, error)) files.push_back({members, members_file(plan)});
  return files;
}

fs::path with_suffix(fs::path file, const char* suffix) { return file += suffix; }

Result<void> refuse_to_replace(const std::vector<PlannedFile>& files) {
  std::string taken_names;
  std::error_code error;
  for (const PlannedFile& file : files)
    if (fs::exists(file.path, error)) taken_names += "\n  " + file.path.string();
  if (taken_names.empty()) return {};
  return fail(ErrorCode::kConfig,
              "these files exist and are not overwritten without --force:" + taken_names);
}

/// Writes all under other names first: a full disk must not cost a configuration that works. What
/// is replaced keeps a copy, NAME~.
Result<void> write_files(const std::vector<PlannedFile>& files) {
  constexpr auto kNew = ".new";
  const auto failure = [&files](const fs::path& path, const std::error_code& reason) {
    std::error_code ignored;
    for (const PlannedFile& one : files) fs::remove(with_suffix(one.path, kNew), ignored);
    return fail(ErrorCode::kIo, path.string() + ": " + reason.message());
  };
  std::error_code error;
  for (const PlannedFile& file : files) {
    fs::create_directories(file.path.parent_path(), error);
    if (error) return failure(file.path.parent_path(), error);
    std::ofstream out(with_suffix(file.path, kNew), std::ios::binary);
    out << file.text;
    out.close();
    if (!out) return failure(file.path, {errno, std::generic_category()});
  }
  for (const PlannedFile& file : files) {
    if (fs::exists(file.path, error)) fs::rename(file.path, with_suffix(file.path, "~"), error);
    if (!error) fs::rename(with_suffix(file.path, kNew), file.path, error);
    if (error) return failure(file.path, error);
  }
  return {};
}

std::string next_steps(const RobotPlan& plan, const InitOptions& options) {
  const std::string dir = options.dir.string();
  return fmt::format(
      "\nNext:\n"
      "  1. Keys, without which anybody can read and forge (first copy mesh.key from a robot that\n"
      "     has one; robot.key stays here):\n"
      "     crepesctl keygen {0}/mesh.key {0}/robot.key\n"
      "     chgrp crepes {0}/*.key; chmod 640 {0}/*.key\n"
      "     In {0}/crepesd.yaml, under net: key_file: mesh.key, robot_key_file: robot.key\n"
      "  2. Measure (above). Write it and the public_key that each robot printed into its item of\n"
      "     {0}/swarm.yaml, then copy that file to all robots.\n"
      "  3. crepesctl led --port /dev/ttyUSB0 set --id {1} --library {0}/swarm.yaml\n"
      "  4. systemctl start crepesd; crepesctl check\n"
      "  5. crepesctl calibrate camera RECORDING --live --out {0}/camchain-imucam.yaml\n"
      "     (another robot's board at rest in view, this robot turned by hand)\n"
      "  6. systemctl restart crepesd; crepesctl check\n",
      dir, plan.id.value);
}

std::string text_of(const RobotPlan& plan, const InitOptions& options,
                    const std::vector<PlannedFile>& files) {
  std::string text;
  for (const PlannedFile& file : files) text += fmt::format("written: {}\n", file.path.string());
  return text + "\n" + measuring_sheet(plan) + next_steps(plan, options);
}

/// Devices that nobody has named and none was found of. A valid configuration may do without them.
void add_missing_devices(const RobotPlan& plan, const fs::path& file,
                         std::vector<ConfigFault>& warnings) {
  const auto add_if = [&](bool is_missing, const char* key, const char* reason) {
    if (is_missing) warnings.push_back({file.string(), 0, key, reason});
  };
  add_if(plan.camera.driver == "none", "cameras[0].driver", "is none: crepesctl devices");
  add_if(plan.imu.port.empty(), "imu.port", "is missing: crepesctl devices");
  add_if(plan.uwb.port.empty(), "uwb.port", "is missing: crepesctl devices");
}

Json lines_of(const std::vector<ConfigFault>& faults) {
  Json lines = Json::array();
  for (const ConfigFault& fault : faults) lines.push_back(to_string(fault));
  return lines;
}

Json json_of(const RobotPlan& plan, const std::vector<PlannedFile>& files,
             const CheckedConfig& checked) {
  Json json{{"ok", checked.faults.empty()}, {"id", plan.id.value}, {"written", Json::array()}};
  for (const PlannedFile& file : files) json["written"].push_back(file.path.string());
  json["faults"] = lines_of(checked.faults);
  json["warnings"] = lines_of(checked.warnings);
  return json;
}

Result<InitReport> write_plan(const RobotPlan& plan, const InitOptions& options) {
  const std::vector<PlannedFile> files = files_of(plan, options);
  if (!options.force) {
    if (auto free = refuse_to_replace(files); !free) return tl::unexpected(free.error());
  }
  if (auto written = write_files(files); !written) return tl::unexpected(written.error());
  CheckedConfig checked = check_config(options.dir / "crepesd.yaml");
  add_missing_devices(plan, options.dir / kDevicesName, checked.warnings);
  InitReport report;
  report.text =
      options.json ? json_line(json_of(plan, files, checked)) : text_of(plan, options, files);
  report.faults = std::move(checked.faults);
  report.warnings = std::move(checked.warnings);
  return report;
}

}  // namespace

Result<InitReport> init(const InitOptions& options, Questions& questions) {
  try {
    return write_plan(Interview(options, questions).plan(), options);
  } catch (const Unanswered& unanswered) {
    return tl::unexpected(unanswered.error);
  }
}

}  // namespace crepes
