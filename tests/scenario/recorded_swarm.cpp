#include "tests/scenario/recorded_swarm.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iomanip>
#include <vector>

#include "daemon/config_file.hpp"
#include "daemon/ctl/demo_swarm.hpp"
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

void record_imu(const fs::path& file, const SimWorld& world, const DemoRobot& robot,
                double duration_s) {
  auto out = create(file, "#timestamp [ns],wx,wy,wz,ax,ay,az");
  SimImu imu(world, robot.config.robot.id, robot.config.imu);
  WitMotionParser parser;
  for (int i = 1; i * 0.01 <= duration_s; ++i) {
    const auto bytes = imu.sample(i * 0.01);
    const auto write = [&](const ImuSample& sample) {
      const auto& w = sample.gyro_radps;
      const auto& a = sample.accel_mps2;
      out << to_ns(sample.stamp) << ',' << w.x() << ',' << w.y() << ',' << w.z() << ',' << a.x()
          << ',' << a.y() << ',' << a.z() << '\n';
    };
    parser.parse(bytes, robot.clock.local(i * 0.01), write);
  }
}

void record_uwb(const fs::path& file, const SimWorld& world, const DemoRobot& robot,
                double duration_s) {
  auto out = create(file, "#timestamp [ns],peer,distance [m],first path [dBm],received [dBm]");
  const auto module =
      SimUwb::make(world, robot.config.robot.id, robot.config.swarm, robot.config.uwb);
  ASSERT_TRUE(module) << module.error().message;
  NlinkParser parser(uwb_modules_of(robot.config.swarm), robot.config.uwb.max_range_m);
  for (int i = 1; i * 0.02 <= duration_s; ++i) {
    const double t = i * 0.02 - 0.003;
    const auto bytes = module->sample(t);
    parser.parse(Bytes(bytes), robot.clock.local(t), [&](const UwbRange& range) {
      out << to_ns(range.stamp) << ',' << range.neighbor.value << ',' << range.range_m << ','
          << range.first_path_dbm << ',' << range.received_dbm << '\n';
    });
  }
}

class CameraRecorder {
 public:
  CameraRecorder(const SimWorld& world, const DemoRobot& robot, const RecordingOptions& options)
      : robots_(world.robots()),
        self_(robot.config.robot.id),
        renderer_(
            RingRenderer::make(world, self_, robot.config.swarm, robot.config.cameras.at(0), 0)),
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

void record_camera(const fs::path& file, const SimWorld& world, const DemoRobot& robot,
                   const RecordingOptions& options) {
  auto out = create(file, "#timestamp [ns],u,v,area,peak");
  CameraRecorder camera(world, robot, options);
  for (int i = 1; i * 0.005 <= options.duration_s; ++i) {
    const double t = i * 0.005 - 0.001;
    const std::int64_t stamp = to_ns(robot.clock.local(t));
    const std::vector<Spot> spots = camera.spots(t);
    if (spots.empty()) out << stamp << ",,,,\n";
    for (const Spot& spot : spots) {
      out << stamp << ',' << spot.u_px << ',' << spot.v_px << ',' << spot.area_px2 << ','
          << spot.peak << '\n';
    }
  }
}

}  // namespace

void record_swarm(const fs::path& dir, const RecordingOptions& options) {
  SimConfig sim;
  sim.enabled = true;
  sim.scenario = options.scenario;
  sim.seed = options.seed;
  const SimWorld world(sim);
  const auto swarm = demo_swarm(sim, world.robots(), 0.0, 40000, 40100);

  auto manifest = create(dir / "swarm.yaml", "# made from the simulated world");
  manifest << "scenario: simulated\nseed: " << options.seed
           << "\nduration_s: " << options.duration_s
           << "\nnetwork: {latency_ms: 3.0, jitter_ms: 3.0, loss: 0.02, seed: " << options.seed
           << "}\nrobots:\n";
  for (const DemoRobot& robot : swarm) {
    const RobotId id = robot.config.robot.id;
    const std::string name = "r" + std::to_string(id.value);
    manifest << "- {id: " << id.value << ", name: " << name << ", dir: " << name
             << ", clock: {offset_s: " << robot.clock.offset_s
             << ", skew_ppm: " << robot.clock.skew_ppm << "}}\n";
    fs::create_directories(dir / name);
    std::ofstream(dir / name / "crepesd.yaml") << write_config(robot.config);
    record_truth(dir / "truth" / (name + ".csv"), world, id, options.duration_s);
    record_imu(dir / name / "imu0" / "data.csv", world, robot, options.duration_s);
    record_uwb(dir / name / "uwb0" / "data.csv", world, robot, options.duration_s);
    record_camera(dir / name / "cam0" / "spots.csv", world, robot, options);
  }
}

}  // namespace crepes::test
