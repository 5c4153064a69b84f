#include "tests/study/swarm_writer.hpp"

#include "config/reading/config_file.hpp"
#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "drivers/base/number_text.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"

namespace crepes::study {
namespace {

namespace fs = std::filesystem;

template <class Measurements>
std::string rows_of(const Measurements& measurements) {
  std::string rows;
  for (const auto& measurement : measurements) append_rows(rows, measurement);
  return rows;
}

std::string truth_text(const Swarm& swarm, RobotId robot) {
  constexpr double kStep = 0.01;  // s
  std::string text = "# t, p_W (3), q_WB (4), v_W (3)\n";
  for (int i = 0;; ++i) {
    const auto T_W_B = swarm.truth.pose(robot, i * kStep);
    if (!T_W_B) return text;
    const auto& [p, q] = *T_W_B;
    const auto before = swarm.truth.pose(robot, (i - 1) * kStep);
    const auto after = swarm.truth.pose(robot, (i + 1) * kStep);
    const double apart_s = kStep * ((before ? 1 : 0) + (after ? 1 : 0));
    const Eigen::Vector3d v = ((after ? after->p : p) - (before ? before->p : p)) / apart_s;
    append_number(text, i * kStep);
    for (const double value :
         {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z()})
      append_number(text += ',', value);
    text += '\n';
  }
}

}  // namespace

bool write_swarm(const fs::path& dir, const Swarm& swarm) {
  bool good = true;
  const auto note = [&good](const Result<void>& written) { good &= written.has_value(); };
  note(write_text_file(dir / "swarm.yaml", manifest_text(swarm.dataset.manifest)));
  for (const RobotRecording& robot : swarm.dataset.robots) {
    RobotFolder folder(dir / robot.robot.dir);
    note(folder.write_config(write_config(robot.config)));
    note(folder.append("imu0", rows_of(robot.imu)));
    note(folder.append("uwb0", rows_of(robot.ranges)));
    for (std::size_t k = 0; k < robot.cameras.size(); ++k)
      note(folder.append("cam" + std::to_string(k), rows_of(robot.cameras[k].spots)));
    note(write_text_file(dir / "truth" / (robot.robot.name + ".csv"),
                         truth_text(swarm, robot.robot.id)));
  }
  return good;
}

}  // namespace crepes::study
