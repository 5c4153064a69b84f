#include "tests/scenario/recorded_swarm.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iomanip>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "daemon/ctl/demo/demo_swarm.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "drivers/sim/sim_imu.hpp"
#include "drivers/sim/sim_uwb.hpp"
#include "drivers/uwb/nlink.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes::test {
namespace {

namespace fs = std::filesystem;

constexpr double kNear = 5.0;  // px; a spot this close to a ring's true pixel is that ring

std::ofstream create(const fs::path& file, const char* header) {
  fs::create_directories(file.parent_path());
  std::ofstream out(file);
  out << header << '\n' << std::setprecision(12);
  return out;
}

void record_truth(const fs::path& file, const SimWorld& world, RobotId robot, double duration_s) {
  auto out = create(file, "# t, p_W (3), q_WB (4), v_W (3)");
  for (int i = 0; i * 0.01 <= duration_s + 0.1; ++i) {
    const BodyState s = world.state(robot, i * 0.01);
    const auto& [p, q] = s.T_W_B;
    out << i * 0.01 << ',' << p.x() << ',' << p.y() << ',' << p.z() << ',' << q.w() << ',' << q.x()
        << ',' << q.y() << ',' << q.z() << ',' << s.v_W_B.x() << ',' << s.v_W_B.y() << ','
        << s.v_W_B.z() << '\n';
  }
}

std::string imu_rows(const SimWorld& world, const DemoRobot& robot, double duration_s) {
  std::string rows;
  SimImu imu(world, robot.config.robot.id, robot.config.imu.noise);
  WitMotionParser parser;
  for (int i = 1; i * 0.01 <= duration_s; ++i) {
    const auto bytes = imu.sample(i * 0.01);
    const auto write = [&](const ImuSample& sample) { append_rows(rows, sample); };
    parser.parse(bytes, robot.clock.local(i * 0.01), write);
  }
  return rows;
}

std::string range_rows(const SimWorld& world, const DemoRobot& robot, double duration_s) {
  std::string rows;
  const auto module =
      SimUwb::make(world, robot.config.robot.id, robot.config.swarm, robot.config.uwb.noise);
  EXPECT_TRUE(module) << module.error().message;
  NlinkParser parser(uwb_modules_of(robot.config.swarm), robot.config.uwb.noise.max_range_m);
  for (int i = 1; i * 0.02 <= duration_s; ++i) {
    const double t = i * 0.02 - 0.003;
    const auto bytes = module->sample(t);
    parser.parse(Bytes(bytes), robot.clock.local(t),
                 [&](const UwbRange& range) { append_rows(rows, range); });
  }
  return rows;
}

class CameraRecorder {
 public:
  CameraRecorder(const SimWorld& world, const DemoRobot& robot, const RecordingOptions& options)
      : robots_(world.robots()),
        self_(robot.config.robot.id),
        renderer_(RingRenderer::make(world, self_, robot.config.swarm,
                                     robot.config.cameras.at(0).calibration, 0)),
        detector_(robot.config.vision),
        source_(options.spots) {}

  std::vector<Spot> spots(double t_s) {
    Frame frame = renderer_.value().render(t_s);
    const Detection found = detector_.detect(
        {frame.pixels.data(), frame.width, frame.height, static_cast<std::ptrdiff_t>(frame.width)});
    std::vector<Spot> spots(found.spots.begin(), found.spots.end());
    renderer_.value().recycle(std::move(frame));
    if (source_ == SpotSource::kProjection) idealize(spots, t_s);
    return spots;
  }

 private:
  void idealize(std::vector<Spot>& spots, double t_s) {
    for (const RobotId neighbor : robots_) {
      if (neighbor == self_) continue;
      const auto pixel = renderer_.value().project_ring(neighbor, t_s);
      for (Spot& spot : spots) {
        if (!pixel || (*pixel - Eigen::Vector2d(spot.u_px, spot.v_px)).norm() > kNear) continue;
        spot.u_px = pixel->x();
        spot.v_px = pixel->y();
      }
    }
  }

  std::vector<RobotId> robots_;
  RobotId self_;
  Result<RingRenderer> renderer_;
  SpotDetector detector_;
  SpotSource source_;
};

std::string spot_rows(const SimWorld& world, const DemoRobot& robot,
                      const RecordingOptions& options) {
  std::string rows;
  CameraRecorder camera(world, robot, options);
  for (int i = 1; i * 0.005 <= options.duration_s; ++i) {
    const double t = i * 0.005 - 0.001;
    append_rows(rows, SpotFrame{robot.clock.local(t), 0, camera.spots(t)});
  }
  return rows;
}

}  // namespace

void record_swarm(const fs::path& dir, const RecordingOptions& options) {
  SimConfig sim;
  sim.enabled = true;
  sim.scenario = options.scenario;
  sim.seed = options.seed;
  const SimWorld world(sim);
  const auto swarm = demo_swarm(sim, world.robots(), 0.0, 40000, 40100);

  SwarmManifest manifest;
  manifest.scenario = "simulated";
  manifest.duration_s = options.duration_s;
  manifest.network = {options.latency_ms, 3.0, 0.02, static_cast<std::uint64_t>(options.seed)};
  for (const DemoRobot& robot : swarm) {
    const RobotId id = robot.config.robot.id;
    const std::string name = "r" + std::to_string(id.value);
    manifest.robots.push_back({id, name, name, robot.clock});
    RobotFolder folder(dir / name);
    ASSERT_TRUE(folder.write_config(write_config(robot.config)));
    ASSERT_TRUE(folder.append("imu0", imu_rows(world, robot, options.duration_s)));
    ASSERT_TRUE(folder.append("uwb0", range_rows(world, robot, options.duration_s)));
    ASSERT_TRUE(folder.append("cam0", spot_rows(world, robot, options)));
    record_truth(dir / "truth" / (name + ".csv"), world, id, options.duration_s);
  }
  ASSERT_TRUE(write_text_file(dir / "swarm.yaml", manifest_text(manifest)));
}

}  // namespace crepes::test
