/// What it takes to read a GigE Vision camera of 1280 x 1024 at 200 Hz over loopback and to find
/// its spots. The camera, which shows rendered boards, is a process of its own.
///   camera_bench [seconds [share of lost packets]]
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "config/reading/config_file.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/sim/ring_renderer.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "tests/support/gige_camera.hpp"
#include "tests/support/places.hpp"

namespace crepes {
namespace {

double cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

[[noreturn]] void be_the_camera(const Config& config, double lost_packets) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const MonotonicClock clock;
  const SimWorld world(config.sim);
  RingRenderer renderer =
      RingRenderer::make(world, RobotId{1}, config.swarm, config.cameras.at(0).calibration, 0)
          .value();
  const GigeCamera camera(
      [&](const GigeCamera::Picture& picture) {
        Frame frame = renderer.render(to_seconds(clock.now().time_since_epoch()));
        std::ranges::copy(frame.pixels, picture.pixels);
        renderer.recycle(std::move(frame));
      },
      lost_packets);
  for (;;) ::pause();
}

int measure(const CameraConfig& config, double duration_s) {
  const MonotonicClock clock;
  auto camera = open_aravis_camera(config, 0, clock);
  for (int tries = 0; !camera && tries < 5; ++tries) camera = open_aravis_camera(config, 0, clock);
  if (!camera) {
    std::fprintf(stderr, "%s\n", camera.error().message.c_str());
    return 1;
  }
  SpotDetector detector{VisionConfig{}};
  std::uint64_t frames = 0;
  std::uint64_t spots = 0;
  Timestamp first;
  Timestamp last;
  std::vector<double> late_ms;
  const double cpu_before = cpu_s();
  const Timestamp end = clock.now() + from_seconds(duration_s);
  while (clock.now() < end) {
    const auto frame = (*camera)->read_once(std::chrono::milliseconds(50));
    if (!frame) {
      std::fprintf(stderr, "%s\n", frame.error().message.c_str());
      return 1;
    }
    if (!*frame) continue;
    late_ms.push_back(1e3 * to_seconds(clock.now() - (*frame)->stamp));
    last = (*frame)->stamp;
    if (frames++ == 0) first = last;
    spots +=
        detector.detect({(*frame)->data(), (*frame)->width, (*frame)->height, (*frame)->stride()})
            .spots.size();
  }
  const double cpu = cpu_s() - cpu_before;
  if (frames < 2) return 1;
  std::ranges::sort(late_ms);
  const auto late = [&](double share) {
    return late_ms[static_cast<std::size_t>(share * static_cast<double>(late_ms.size() - 1))];
  };
  std::printf("%.1f frames a second, %.2f spots a frame, CPU %.1f %% of a core\n",
              static_cast<double>(frames - 1) / to_seconds(last - first),
              static_cast<double>(spots) / static_cast<double>(frames), 100.0 * cpu / duration_s);
  std::printf("behind the fastest arrivals: median %.2f ms, 99 %% %.2f ms, worst %.2f ms\n",
              late(0.5), late(0.99), late(1.0));
  const auto [faults, counts] = (*camera)->counters();
  for (const Totals& totals : {counts, faults})
    for (const auto& [name, count] : totals)
      std::printf("%s %llu\n", name.c_str(), static_cast<unsigned long long>(count));
  return 0;
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  const double duration_s = argc > 1 ? std::atof(argv[1]) : 20.0;
  const double lost_packets = argc > 2 ? std::atof(argv[2]) : 0.0;
  if (!crepes::enter_own_network()) {
    std::fprintf(stderr, "no right to a network of our own\n");
    return 1;
  }
  crepes::Config config =
      crepes::load_config(crepes::source_dir() + "/config/examples/four-simulated/r1.yaml").value();
  const ::pid_t camera = ::fork();
  if (camera == 0) crepes::be_the_camera(config, lost_packets);
  crepes::CameraConfig& settings = config.cameras.at(0);
  settings.device.driver = crepes::CameraDriver::kAravis;
  settings.device.id = crepes::GigeCamera::kId;
  settings.device.light.exposure_us = 500;
  settings.device.packet_size = 9000;
  settings.device.latency_ms = 0.0;
  const int code = crepes::measure(settings, duration_s);
  ::kill(camera, SIGKILL);
  ::waitpid(camera, nullptr, 0);
  return code;
}
