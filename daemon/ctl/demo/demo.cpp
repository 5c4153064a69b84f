#include "daemon/ctl/demo/demo.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/demo/demo_page.hpp"
#include "daemon/ctl/demo/demo_pairs.hpp"
#include "daemon/ctl/demo/demo_screen.hpp"
#include "daemon/ctl/demo/demo_swarm.hpp"
#include "daemon/ctl/demo/steered_swarm.hpp"
#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/sim/world.hpp"
#include "net/udp_socket.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kCommandPortOffset = 3;  ///< of the port for velocity commands: after three daemons
constexpr Duration kScored = 60s;      ///< the newest, of a demo without an end
constexpr double kInFlight = 0.1;      // s; the last poses have not arrived when the time is over

/// One robot, and the connection to its daemon.
struct RunningRobot {
  DemoRobot robot;
  fs::path log;
  client::Connection daemon;
};

/// The last lines of a log.
std::string tail_of(const fs::path& log) {
  constexpr std::size_t kMaxBytes = 2000;
  std::string text = read_text_file(log).value_or("");
  if (text.size() <= kMaxBytes) return text;
  text.erase(0, text.size() - kMaxBytes);
  return text.substr(std::min(text.find('\n') + 1, text.size()));
}

std::string truth_row(const BodyState& state, double t_s) {
  const auto& [p, q] = state.T_W_B;
  const Eigen::Vector3d& v = state.v_W_B;
  return fmt::format("{:.3f},{},{},{},{},{},{},{},{},{},{}\n", t_s, p.x(), p.y(), p.z(), q.w(),
                     q.x(), q.y(), q.z(), v.x(), v.y(), v.z());
}

/// Checks that the subscription ports are free, and finds a free port for the mesh.
Result<std::uint16_t> free_mesh_port(std::uint16_t first, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto port = static_cast<std::uint16_t>(first + i);
    if (const auto socket = UdpSocket::bind("127.0.0.1", port); !socket)
      return tl::unexpected(Error(socket.error()).with_context("choose another --port"));
  }
  return UdpSocket::bind("127.0.0.1", 0).map([](const UdpSocket& socket) {
    return socket.local().port;
  });
}

SimConfig sim_config(const DemoOptions& options, const fs::path& dir) {
  SimConfig sim;
  sim.enabled = true;
  sim.scenario = options.scenario;
  sim.seed = options.seed;
  if (options.scenario == SimScenario::kFormation) sim.track = (dir / "motions").string();
  return sim;
}

class Demo {
 public:
  /// With robots that are steered if the world has a track, which must exist.
  Demo(DemoOptions options, SimConfig sim, std::optional<SteeredSwarm> steered)
      : options_(std::move(options)),
        sim_(std::move(sim)),
        steered_(std::move(steered)),
        world_(sim_),
        start_(clock_.now()) {}

  Result<void> start(const fs::path& dir) {
    const std::vector<RobotId> ids = world_.robots();
    const Result<std::uint16_t> mesh_port = free_mesh_port(options_.port, ids.size());
    if (!mesh_port) return tl::unexpected(mesh_port.error());
    std::error_code status;
    const fs::path tool = fs::read_symlink("/proc/self/exe", status);
    const fs::path daemon = tool.parent_path() / "crepesd";
    start_ = clock_.now();
    pairs_.emplace(world_, start_, is_endless() ? std::optional(kScored) : std::nullopt);
    for (DemoRobot& robot : demo_swarm(sim_, ids, epoch_s(), options_.port, *mesh_port)) {
      if (auto done = start_robot(dir, daemon, std::move(robot)); !done) return done;
    }
    if (auto done = start_program(dir); !done) return done;
    return options_.view.empty() ? Result<void>() : start_page(tool, dir);
  }

  /// Runs until the time is over, a daemon ends, or a signal arrives.
  Result<void> run(StopSignals& stop) {
    std::optional<LiveScreen> screen;
    std::optional<KeyReader> keys;
    if (options_.show_table) screen.emplace();
    if (screen && screen->is_terminal()) keys.emplace();
    const Duration redraw_period =
        screen && !screen->is_terminal() ? Duration{5s} : Duration{200ms};
    Timestamp redraw = start_;
    while (world_s() < options_.for_s && !stop.requested() && !table_.should_quit()) {
      if (auto alive = check_daemons(); !alive) return alive;
      if (steered_) {
        if (auto done = steered_->run_until(world_s()); !done) return done;
      }
      listen();
      for (auto key = next_key(keys); key; key = next_key(keys)) {
        table_.handle_key(*key);
        redraw = clock_.now();
      }
      if (clock_.now() < redraw) continue;
      redraw = clock_.now() + redraw_period;
      if (screen) screen->show(table(keys && keys->is_terminal()));
      if (options_.on_progress) options_.on_progress(world_s() / options_.for_s);
    }
    return {};
  }

  void stop() {
    end_s_ = world_s();
    program_.reset();
    for (const ChildProcess& daemon : daemons_) daemon.terminate();
    daemons_.clear();
    page_.reset();
  }

  /// DIR/truth/<robot>.csv, as in data sets.
  [[nodiscard]] Result<void> write_truth(const fs::path& dir) const {
    std::error_code status;
    fs::create_directories(dir / "truth", status);
    for (const RobotId id : world_.robots()) {
      const fs::path file = dir / "truth" / (name_of_robot(id) + ".csv");
      std::ofstream out(file);
      out << "# t, p_W (3), q_WB (4), v_W (3)\n";
      const int rows = static_cast<int>(std::ceil(end_s_ / kTrackPeriod));
      for (int i = 0; i < rows; ++i) {
        const double t_s = i * kTrackPeriod;
        out << truth_row(world_.state(id, t_s), t_s);
      }
      out.close();
      if (!out) return fail(ErrorCode::kIo, file.string() + ": cannot be written");
    }
    return {};
  }

  /// Scores the whole run of each pair.
  [[nodiscard]] DemoSummary summarize() const {
    const double to_s = end_s_ - kInFlight;
    DemoSummary summary{.scenario = options_.scenario,
                        .seed = options_.seed,
                        .from_s = scored_from_s(),
                        .to_s = end_s_,
                        .pairs = pairs_->score(scored_from_s(), to_s)};
    if (steered_) summary.formation = score_formation(world_, scored_from_s(), to_s);
    return summary;
  }

 private:
  [[nodiscard]] bool is_endless() const { return std::isinf(options_.for_s); }
  [[nodiscard]] double epoch_s() const { return to_seconds(start_.time_since_epoch()); }
  [[nodiscard]] double world_s() const { return to_seconds(clock_.now() - start_); }

  /// The start is reported separately, as the time to the first pose.
  [[nodiscard]] double scored_from_s() const {
    const double settled_s = std::min(steered_ ? 15.0 : 5.0, end_s_ / 2.0);
    return is_endless() ? std::max(settled_s, end_s_ - to_seconds(kScored)) : settled_s;
  }

  Result<void> start_robot(const fs::path& dir, const fs::path& daemon, DemoRobot robot) {
    const RobotId id = robot.config.robot.id;
    const fs::path file = dir / (name_of_robot(id) + ".yaml");
    const fs::path log = dir / (name_of_robot(id) + ".log");
    if (!options_.view.empty()) {
      robot.config.recording.socket = DemoPage::socket_of(dir, name_of_robot(id));
      robot.config.view.control = true;
    }
    std::ofstream out(file);
    out << write_config(robot.config);
    out.close();
    if (!out) return fail(ErrorCode::kIo, file.string() + ": cannot be written");
    // Often at first, while the daemon opens its sockets.
    auto connection = connect({.port = static_cast<std::uint16_t>(robot.config.subscription.port)},
                              {.polls = {{}}, .retry_s = 0.05});
    if (!connection) return tl::unexpected(connection.error());
    auto process = ChildProcess::start(daemon, {"--config", file.string()}, log);
    if (!process) return tl::unexpected(process.error());
    pairs_->add_observer(id, robot.clock);
    robots_.push_back({std::move(robot), log, std::move(*connection)});
    daemons_.push_back(std::move(*process));
    return {};
  }

  Result<void> start_program(const fs::path& dir) {
    if (options_.run.empty()) return {};
    std::vector<std::string> arguments{"--port", std::to_string(options_.port)};
    if (steered_)
      arguments.insert(arguments.end(), {"--commands", std::to_string(steered_->port())});
    program_log_ = dir / "program.log";
    auto program = ChildProcess::start(fs::absolute(options_.run), arguments, program_log_);
    if (!program) return tl::unexpected(program.error());
    program_.emplace(std::move(*program));
    return {};
  }

  Result<void> start_page(const fs::path& tool, const fs::path& dir) {
    std::vector<std::string> names;
    for (const RobotId id : world_.robots()) names.push_back(name_of_robot(id));
    return DemoPage::start(tool, dir, options_.view, options_.port, names)
        .map([this](DemoPage&& page) { page_.emplace(std::move(page)); });
  }

  Result<void> check_daemons() {
    for (std::size_t i = 0; i < daemons_.size(); ++i) {
      const std::optional<std::string>& exit_reason = daemons_[i].exit_reason();
      if (!exit_reason) continue;
      const RunningRobot& robot = robots_[i];
      return fail(ErrorCode::kIo, fmt::format("crepesd of {} ended: {}\n{}",
                                              name_of_robot(robot.robot.config.robot.id),
                                              *exit_reason, tail_of(robot.log)));
    }
    if (program_ && program_->exit_reason()) {
      return fail(ErrorCode::kIo, fmt::format("{} ended: {}\n{}", options_.run.string(),
                                              *program_->exit_reason(), tail_of(program_log_)));
    }
    return page_ ? page_->check() : Result<void>();
  }

  /// Waits briefly, then processes everything that has arrived.
  void listen() {
    std::chrono::milliseconds patience = 5ms;
    for (RunningRobot& robot : robots_) {
      while (const auto answer = robot.daemon.receive(std::exchange(patience, 0ms)))
        pairs_->handle(robot.robot.config.robot.id, answer->message, clock_.now());
    }
  }

  static std::optional<char> next_key(const std::optional<KeyReader>& keys) {
    return keys ? keys->next() : std::nullopt;
  }

  /// What the steered robots hear; empty without any.
  [[nodiscard]] std::string steering() const {
    if (!steered_) return "";
    const double now_s = world_s();
    const FormationScore score = score_formation(world_, std::max(0.0, now_s - 5.0), now_s);
    return fmt::format(
        "formation: {} m RMS over the last seconds\n"
        "commands to UDP port {}: {} received, {} refused, {} motions late\n",
        fixed(score.rms_m, 3), steered_->port(), steered_->received(), steered_->refused(),
        steered_->late());
  }

  [[nodiscard]] std::string table(bool is_interactive) const {
    ScreenFormat format = format_of_output();
    format.is_interactive = is_interactive;
    const std::string url = page_ ? page_->url() : "";
    const std::string page = url.empty() ? "" : fmt::format("page: {}\n", url);
    const std::string end = is_endless() ? "" : fmt::format(" of {}", fixed(options_.for_s, 0));
    const std::string head =
        fmt::format("{}world time {} s{}\n{}", page, fixed(world_s(), 1), end, steering());
    return table_.text(head, pairs_->live_rows(clock_.now()), format);
  }

  DemoOptions options_;
  SimConfig sim_;
  MonotonicClock clock_;
  std::optional<SteeredSwarm> steered_;
  SimWorld world_;
  Timestamp start_;
  std::vector<RunningRobot> robots_;
  std::vector<ChildProcess> daemons_;  ///< one for each of robots_, while they run
  std::optional<DemoPage> page_;
  DemoScreen table_;
  std::optional<ChildProcess> program_;
  fs::path program_log_;
  std::optional<DemoPairs> pairs_;  ///< since the start
  double end_s_ = 0.0;              ///< world time at the end
};

}  // namespace

Result<DemoSummary> demo(const DemoOptions& options) {
  const Result<ScratchDirectory> directory = ScratchDirectory::create(options.keep);
  if (!directory) return tl::unexpected(directory.error());
  const SimConfig sim = sim_config(options, directory->path());
  std::optional<SteeredSwarm> steered;
  if (!sim.track.empty()) {
    Result<SteeredSwarm> opened =
        SteeredSwarm::open(sim, static_cast<std::uint16_t>(options.port + kCommandPortOffset));
    if (!opened) return tl::unexpected(opened.error());
    steered.emplace(std::move(*opened));
  }
  StopSignals stop;
  Demo demo(options, sim, std::move(steered));
  const Result<void> ran = demo.start(directory->path()).and_then([&] { return demo.run(stop); });
  demo.stop();
  if (!ran) return tl::unexpected(ran.error());
  if (!options.keep.empty()) {
    if (auto done = demo.write_truth(directory->path()); !done) return tl::unexpected(done.error());
  }
  return demo.summarize();
}

}  // namespace crepes
