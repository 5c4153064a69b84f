#include "tests/study/swarm_writer.hpp"

#include <fstream>

#include "daemon/config_file.hpp"
#include "daemon/ctl/csv_file.hpp"

namespace crepes::study {
namespace {

namespace fs = std::filesystem;

/// A row of numbers, each as short as reads back to the same bits.
template <class First, class... Rest>
void append_row(std::string& text, First first, Rest... rest) {
  append_number(text, first);
  ((text += ',', append_number(text, rest)), ...);
  text += '\n';
}

bool write_file(const fs::path& file, const std::string& text) {
  std::error_code status;
  fs::create_directories(file.parent_path(), status);
  std::ofstream out(file, std::ios::binary);
  out << text;
  return static_cast<bool>(out.flush());
}

std::string manifest_text(const SwarmManifest& manifest) {
  std::string text;
  const auto number = [&text](const char* before, auto value) {
    text += before;
    append_number(text, value);
  };
  text += "scenario: " + manifest.scenario;
  number("\nseed: ", manifest.network.seed);
  number("\nduration_s: ", manifest.duration_s);
  number("\nnetwork: {latency_ms: ", manifest.network.latency_ms);
  number(", jitter_ms: ", manifest.network.jitter_ms);
  number(", loss: ", manifest.network.loss);
  number(", seed: ", manifest.network.seed);
  text += "}\nrobots:\n";
  for (const SwarmRobot& robot : manifest.robots) {
    number("- {id: ", robot.id.value);
    text += ", name: " + robot.name + ", dir: " + robot.dir.string();
    number(", clock: {offset_s: ", robot.clock.offset_s);
    number(", skew_ppm: ", robot.clock.skew_ppm);
    text += "}}\n";
  }
  return text;
}

std::string imu_text(const RobotRecording& robot) {
  std::string text = "#timestamp [ns],wx,wy,wz,ax,ay,az\n";
  for (const ImuSample& s : robot.imu) {
    append_row(text, to_ns(s.stamp), s.gyro_radps.x(), s.gyro_radps.y(), s.gyro_radps.z(),
               s.accel_mps2.x(), s.accel_mps2.y(), s.accel_mps2.z());
  }
  return text;
}

std::string range_text(const RobotRecording& robot) {
  std::string text = "#timestamp [ns],peer,distance [m],first path [dBm],received [dBm]\n";
  for (const UwbRange& r : robot.ranges) {
    append_row(text, to_ns(r.stamp), r.neighbor.value, r.range_m, r.first_path_dbm, r.received_dbm);
  }
  return text;
}

std::string spot_text(const CameraRecording& camera) {
  std::string text = "#timestamp [ns],u,v,area,peak\n";
  for (const SpotFrame& frame : camera.spots) {
    const std::int64_t stamp = to_ns(frame.stamp);
    if (frame.spots.empty()) text.append(std::to_string(stamp)).append(",,,,\n");
    for (const Spot& s : frame.spots) append_row(text, stamp, s.u_px, s.v_px, s.area_px2, s.peak);
  }
  return text;
}

std::string truth_text(const Swarm& swarm, RobotId robot) {
  constexpr double kStep = 0.01;  // s
  std::string text = "# t, p_W (3), q_WB (4), v_W (3)\n";
  std::optional<Pose> last;
  for (int i = 0;; ++i) {
    const auto T_W_B = swarm.truth.pose(robot, i * kStep);
    if (!T_W_B) return text;
    const auto& [p, q] = *T_W_B;
    const Eigen::Vector3d v =
        last ? Eigen::Vector3d((p - last->p) / kStep) : Eigen::Vector3d::Zero();
    append_row(text, i * kStep, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(),
               v.z());
    last = T_W_B;
  }
}

}  // namespace

bool write_swarm(const fs::path& dir, const Swarm& swarm) {
  bool good = write_file(dir / "swarm.yaml", manifest_text(swarm.dataset.manifest));
  for (const RobotRecording& robot : swarm.dataset.robots) {
    const fs::path home = dir / robot.robot.dir;
    good &= write_file(home / "crepesd.yaml", write_config(robot.config));
    good &= write_file(home / "imu0/data.csv", imu_text(robot));
    good &= write_file(home / "uwb0/data.csv", range_text(robot));
    for (std::size_t k = 0; k < robot.cameras.size(); ++k)
      good &=
          write_file(home / ("cam" + std::to_string(k)) / "spots.csv", spot_text(robot.cameras[k]));
    good &=
        write_file(dir / "truth" / (robot.robot.name + ".csv"), truth_text(swarm, robot.robot.id));
  }
  return good;
}

}  // namespace crepes::study
