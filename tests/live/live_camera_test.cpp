/// A daemon whose camera is a GigE Vision camera on loopback that shows the simulated world.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "daemon/runtime.hpp"
#include "daemon/stages/sim_stage.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::live_camera_test {
namespace {

using namespace nlohmann::literals;

using std::chrono::seconds;

#if defined(CREPES_ASAN)
constexpr bool kIsSlow = true;  // a tenth of the pace: a picture of a quarter of the pixels then
#else
constexpr bool kIsSlow = false;
#endif

class LiveCamera : public LiveDaemon {
 protected:
  void SetUp() override {
#if defined(CREPES_TSAN)
    GTEST_SKIP() << "Aravis is not instrumented: how it hands buffers over looks like a race";
#endif
    if (!enter_own_network()) GTEST_SKIP() << "no right to a network of our own";
    simulated_ = pair_config(1, mesh_port_);
    if (!kIsSlow) {
      CameraConfig& camera = simulated_.cameras.front();
      for (int& side : camera.calibration.resolution) side *= 2;
      for (std::size_t i = 2; i < camera.calibration.intrinsics.size(); ++i)
        camera.calibration.intrinsics[i] *= 2.0;
    }
    world_.emplace(simulated_.sim);
    imu_.emplace(open_sim_imu(*world_, simulated_).value());
    uwb_.emplace(open_sim_uwb(*world_, simulated_).value());
    for (SimSerial* device : {&*imu_, &*uwb_}) {
      lines_.emplace_back([this, device](const std::stop_token& stop) {
        run_sim_serial(*device, clock_, turns_, stop);
      });
    }
    real_ = simulated_;
    real_.sim.enabled = false;
    real_.imu.device.port = imu_->path();
    real_.uwb.device.port = uwb_->path();
    CameraConfig& camera = real_.cameras.front();
    camera.device.driver = CameraDriver::kAravis;
    camera.device.id = GigeCamera::kAddress;
    camera.device.light.exposure_us = kExposure_us;
    camera.device.packet_size = 9000;
    camera.device.latency_ms = 1.0;
  }

  /// Shows what robot 1 sees at the time of each picture, in the light of its exposure.
  std::unique_ptr<GigeCamera> plug_camera_in() {
    auto renderer = RingRenderer::make(*world_, RobotId{1}, simulated_.swarm,
                                       simulated_.cameras.front().calibration, 0);
    EXPECT_TRUE(renderer) << renderer.error().message;
    auto drawn = std::make_shared<RingRenderer>(std::move(*renderer));
    return std::make_unique<GigeCamera>([this, drawn](const GigeCamera::Picture& picture) {
      drawn->set_brightness(picture.exposure_us / kExposure_us);
      Frame frame = drawn->render(clock_.world_s());
      ASSERT_EQ(frame.pixels.size(), picture.size());
      std::ranges::copy(frame.pixels, picture.pixels);
      drawn->recycle(std::move(frame));
    });
  }

  static constexpr double kExposure_us = 500.0;

  static bool is_well(const Json& status) {
    const Json camera = sensor_of(status, "cam0");
    return camera.value("ok", false) && camera.value("rate_hz", 0.0) > 10.0;
  }

  Config simulated_;
  Config real_;
  std::optional<SimWorld> world_;
  SimClock clock_{machine_, SimConfig{}};  // of epoch 0, as the machine's
  std::optional<SimSerial> imu_;
  std::optional<SimSerial> uwb_;
  Counter turns_;
  std::vector<std::jthread> lines_;
};

TEST_F(LiveCamera, LocatesANeighborThroughAGigEVisionCamera) {
  const auto camera = plug_camera_in();
  ASSERT_TRUE(camera->is_running());
  const Config peer = pair_config(2, mesh_port_);
  const Runtime neighbor(peer, machine_);
  const Runtime runtime(real_, machine_);
  Client client(real_);

  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status.value("/neighbors/0/id_decodes"_json_pointer, 0) > 0;
  }));
  EXPECT_TRUE(client.await(R"({"class":"WATCH"})", "POSE", [&](const Json& pose) {
    const PoseError error = error_of(pose, simulated_);
    return pose["mode"] == "direct" && error.position_m < 0.5 && error.angle_rad < 0.17;
  }));
}

TEST_F(LiveCamera, ShortensAnAutomaticExposureAndGoesOnReadingIds) {
  const auto camera = plug_camera_in();
  real_.cameras.front().device.exposure = ExposureControl::kAuto;
  const Runtime runtime(real_, machine_);
  Client client(real_);

  const auto bearings = [](const Json& status) {
    return status.value("/neighbors/0/measurements/bearing/no_state"_json_pointer, 0U);
  };
  unsigned before = 0;
  EXPECT_TRUE(client.await_status([&](const Json& status) {
    const Json counts = sensor_of(status, "cam0 spots").value("counts", Json::object());
    before = bearings(status);
    return counts.value("longest_exposure_us", 0.0) == kExposure_us &&
           counts.value("auto_exposure_us", kExposure_us) < 0.8 * kExposure_us &&
           counts.value("brightest", 255) < 250;
  }));
  EXPECT_TRUE(client.await_status(
      [&](const Json& status) { return bearings(status) > before + (kIsSlow ? 20 : 200); }));
}

TEST_F(LiveCamera, ReportsWhatIsWrongWithTheCameraAndRecovers) {
  auto camera = plug_camera_in();
  const Runtime runtime(real_, machine_);
  Client client(real_);
  ASSERT_TRUE(client.await_status(is_well));

  camera->lose_packets(0.01);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    const Json reported = sensor_of(status, "cam0");
    return mentions(reported, "incomplete") &&
           reported.value("/faults/missing_packets"_json_pointer, 0) > 0;
  }));
  camera->lose_packets(0.0);
  EXPECT_TRUE(client.await_status(is_well));

  camera.reset();
  const Timestamp unplugged = machine_.now();
  EXPECT_TRUE(client.await_status(
      [](const Json& status) { return !sensor_of(status, "cam0").value("ok", true); }));
  // Within two seconds, plus what a laden machine and this client take.
  EXPECT_LT(machine_.now() - unplugged, seconds{kIsSlow ? 10 : 4});
  camera = plug_camera_in();
  EXPECT_TRUE(client.await_status(is_well));
}

}  // namespace
}  // namespace crepes::live_camera_test
