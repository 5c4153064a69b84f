#include "daemon/ctl/dataset/record.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <limits>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/dataset/recorded_manifest.hpp"
#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/text_table.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/recipient.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/number_text.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "net/endpoint.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kSavePeriod = 1s;  // what a loss of power costs at most
constexpr int kPatienceMs = 100;

/// The stamp of a row.
std::optional<Timestamp> stamp_at(std::string_view text) {
  std::int64_t t_ns = 0;
  if (!parse_number(text.substr(0, text.find(',')), t_ns).empty()) return std::nullopt;
  return Timestamp{Duration{t_ns}};
}

/// Waits until all that was written is on the disk.
Result<void> sync_disk(const std::filesystem::path& dir) {
  const UniqueFd folder(::open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder && ::syncfs(folder.get()) == 0) return {};
  return fail(ErrorCode::kIo, dir.string() + ": " + std::generic_category().message(errno));
}

/// Writes the blocks to the data set.
class Recording {
 public:
  explicit Recording(const RecordOptions& options)
      : dir_(options.dir), on_config_(options.on_config), on_rows_(options.on_rows) {}

  [[nodiscard]] Result<void> append(const Block& block) {
    if (block.kind == "refused") return fail(ErrorCode::kIo, "record: " + block.content);
    if (block.kind == "config") return apply_config(block.content);
    if (!folder_) return fail(ErrorCode::kFormat, "record: measurements without a configuration");
    if (block.kind == "picture") return append_picture(block.content);
    if (block.kind == "gap") {
      std::uint64_t missing = 0;
      if (parse_number(block.content, missing).empty()) progress_.missing += missing;
      return {};
    }
    return append_rows(block);
  }

  /// Writes swarm.yaml for the measurements so far: from now on they outlast whatever happens.
  [[nodiscard]] Result<void> save(const std::vector<client::Status::Clock>& clocks) {
    std::error_code status;
    if (!folder_ || first_ > last_ || !std::filesystem::exists(folder_->path(), status)) return {};
    const std::string folder = folder_->path().filename().string();  // its name at the beginning
    return write_text_file(dir_ / "swarm.yaml",
                           recorded_manifest(config_, folder, first_, last_, clocks))
        .and_then([&] { return sync_disk(dir_); });
  }

  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] bool has_begun() const { return first_ <= last_; }
  [[nodiscard]] RecordSummary summary(std::string why) const {
    return {.progress = progress(),
            .folder = folder_ ? folder_->path() : dir_,
            .end_reason = std::move(why)};
  }
  /// Why it ended early, and what there is nevertheless.
  [[nodiscard]] Error with_remainder(Error failure) const {
    if (has_begun()) {
      failure.message += fmt::format("; {} s until then are in {}", fixed(progress().seconds, 1),
                                     folder_->path().string());
    }
    return failure;
  }
  [[nodiscard]] RecordProgress progress() const {
    RecordProgress progress = progress_;
    progress.bytes = folder_ ? folder_->bytes() : 0;
    progress.seconds = has_begun() ? to_seconds(last_ - first_) : 0.0;
    return progress;
  }

 private:
  [[nodiscard]] Result<void> apply_config(const std::string& text) {
    const CheckedConfig checked = check_config_text(text, "the daemon's configuration");
    if (!checked.faults.empty()) return fail(ErrorCode::kConfig, to_string(checked.faults.front()));
    config_ = checked.config;
    ++progress_.configurations;
    if (!folder_) folder_.emplace(dir_ / own_robot_name(config_));
    if (on_config_) on_config_(config_);
    return begin_files().and_then([&] { return folder_->write_config(text); });
  }

  /// A sensor that is silent throughout has a file, too, so that the data set can be read.
  [[nodiscard]] Result<void> begin_files() {
    std::vector<std::string> sensors{"imu0", "uwb0"};
    for (std::size_t k = 0; k < config_.cameras.size(); ++k)
      sensors.push_back(fmt::format("cam{}", k));
    for (const std::string& sensor : sensors)
      if (auto begun = folder_->append(sensor, ""); !begun) return begun;
    return {};
  }

  [[nodiscard]] Result<void> append_rows(const Block& block) {
    const bool is_camera = block.kind.starts_with("cam") && block.kind.size() <= 5;
    std::size_t index = 0;
    const bool is_known =
        block.kind == "imu0" || block.kind == "uwb0" ||
        (is_camera && parse_number(std::string_view(block.kind).substr(3), index).empty());
    if (!is_known) return {};  // from a newer daemon
    const std::string_view rows = block.content;
    const std::size_t last_row = rows.substr(0, rows.size() - 1).rfind('\n') + 1;
    for (const auto stamp : {stamp_at(rows), stamp_at(rows.substr(last_row))}) {
      if (!stamp) return fail(ErrorCode::kFormat, "record: a row without a stamp");
      first_ = std::min(first_, *stamp);
      last_ = std::max(last_, *stamp);
    }
    progress_.rows += static_cast<std::uint64_t>(std::ranges::count(rows, '\n'));
    if (on_rows_) on_rows_(block.kind, rows);
    return folder_->append(block.kind, rows);
  }

  [[nodiscard]] Result<void> append_picture(const std::string& content) {
    const std::size_t end = content.find('\n');
    std::istringstream head(content.substr(0, end));
    int camera = -1;
    std::int64_t t_ns = 0;
    int width = 0;
    int height = 0;
    head >> camera >> t_ns >> width >> height;
    const std::size_t pixels = end == std::string::npos ? 0 : content.size() - end - 1;
    const bool is_whole =
        width > 0 && height > 0 && camera >= 0 &&
        pixels == static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (!is_whole) return fail(ErrorCode::kFormat, "record: a picture that is none");
    std::vector<std::uint8_t> grey(content.begin() + static_cast<std::ptrdiff_t>(end) + 1,
                                   content.end());
    std::vector<std::uint8_t> png;
    try {
      cv::imencode(".png", cv::Mat(height, width, CV_8UC1, grey.data()), png,
                   {cv::IMWRITE_PNG_COMPRESSION, 1});
    } catch (const cv::Exception& e) {
      return fail(ErrorCode::kIo, std::string("record: ") + e.what());
    }
    ++progress_.pictures;
    return folder_->add_picture(fmt::format("cam{}", camera), Timestamp{Duration{t_ns}}, png);
  }

  std::filesystem::path dir_;
  std::function<void(const Config&)> on_config_;
  std::function<void(const std::string&, std::string_view)> on_rows_;
  std::optional<RobotFolder> folder_;
  Config config_;
  Timestamp first_ = Timestamp::max();
  Timestamp last_ = Timestamp::min();
  RecordProgress progress_;
};

/// Where a program on this machine reaches a daemon that listens at `address`.
std::string address_to_ask(const std::string& address) {
  const auto endpoint = Endpoint::parse(address, 0);
  if (!endpoint || !endpoint->is_any()) return address;
  return endpoint->is_ipv4() ? "127.0.0.1" : "::1";
}

/// All other members of the robot's swarm.
std::vector<std::uint16_t> peers_of(const Config& config) {
  std::vector<std::uint16_t> peers;
  for (const MemberConfig& member : config.swarm.members)
    if (member.id != config.robot.id) peers.push_back(member.id.value);
  return peers;
}

/// The peers' clocks, as the daemon reported them last. Asks for each peer, because a STATUS of all
/// may have no room for the rates of the clocks. Where the daemon serves several addresses, a
/// silent one is left for the next.
class KnownClocks {
 public:
  /// Never waits, because the measurements do not, either.
  void update(const Config& config) {
    constexpr std::chrono::seconds kSilence{4};
    if (!daemon_ || daemon_->silent_for() > kSilence) connect_to_next(config);
    if (!daemon_) return;
    if (peers_ != peers_of(config)) ask(config);
    while (const auto answer = daemon_->receive(0ms)) take(*answer);
  }

  /// Asks again, and waits for the answers: half a second for each address.
  void refresh(const Config& config) {
    for (std::size_t i = 0; i < config.subscription.listen.size(); ++i) {
      if (i > 0 || !daemon_) {
        connect_to_next(config);
      } else {
        ask(config);
      }
      if (daemon_ && takes_answers_of_all()) return;
    }
  }

  [[nodiscard]] std::vector<client::Status::Clock> clocks() const {
    std::vector<client::Status::Clock> clocks;
    for (const auto& [peer, clock] : clocks_) clocks.push_back(clock);
    return clocks;
  }
  /// Why there are no clocks; empty if the daemon has answered or has no peers.
  [[nodiscard]] std::string fault(const Config& config) const {
    if (is_answered_ || peers_of(config).empty()) return "";
    std::string asked;
    for (const std::string& address : config.subscription.listen)
      asked += (asked.empty() ? "" : ", ") + address_to_ask(address);
    return fmt::format("no STATUS from {} port {}, so swarm.yaml has no clocks of other robots",
                       asked.empty() ? "subscription.listen, which is empty," : asked,
                       config.subscription.port);
  }

 private:
  [[nodiscard]] client::Requests requests() const {
    constexpr double kPollPeriod = 2.0;  // a daemon answers 50 requests a second
    client::Requests requests{.watch = false};
    for (const std::uint16_t peer : peers_)
      requests.polls.push_back({.peer = peer, .period_s = kPollPeriod});
    return requests;
  }
  void ask(const Config& config) {
    peers_ = peers_of(config);
    daemon_->ask(requests());
  }
  void connect_to_next(const Config& config) {
    daemon_.reset();
    const SubscriptionConfig& served = config.subscription;
    if (served.listen.empty()) return;
    peers_ = peers_of(config);
    auto daemon = connect({address_to_ask(served.listen[next_++ % served.listen.size()]),
                           static_cast<std::uint16_t>(served.port)},
                          requests());
    if (daemon) daemon_ = std::move(*daemon);
  }
  void take(const client::Answer& answer) {
    const auto* status = std::get_if<client::Status>(&answer.message);
    if (status == nullptr) return;
    is_answered_ = true;
    for (const client::Status::Clock& clock : status->clocks) clocks_[clock.peer] = clock;
  }
  /// Whether any has come.
  [[nodiscard]] bool takes_answers_of_all() {
    constexpr Duration kAnswerTime = 500ms;
    const MonotonicClock clock;
    const Timestamp end = clock.now() + kAnswerTime;
    std::size_t answers = 0;
    while (clock.now() < end && answers < peers_.size()) {
      const auto answer = daemon_->receive(50ms);
      if (!answer) continue;
      take(*answer);
      ++answers;
    }
    return answers > 0;
  }

  std::optional<client::Connection> daemon_;
  std::size_t next_ = 0;  ///< of the addresses, the one to ask next
  std::vector<std::uint16_t> peers_;
  std::map<std::uint16_t, client::Status::Clock> clocks_;
  bool is_answered_ = false;
};

/// Why the recording ends now; empty while it continues.
std::string end_reason(const RecordOptions& options, const RecordProgress& progress,
                       Duration elapsed, StopSignals& signals) {
  constexpr double kLateSeconds =
      1.0;  // measurements come a little after they were made, or not at all
  if (signals.requested()) return "stopped";
  if (options.is_enough && options.is_enough()) return "ended";
  if (options.duration_s &&
      std::max(progress.seconds, to_seconds(elapsed) - kLateSeconds) >= *options.duration_s)
    return "--duration is over";
  if (progress.bytes >= options.max_bytes) return "--max-size is reached";
  return "";
}

/// Records until something ends the recording. Returns the reason.
Result<std::string> run(const RecordOptions& options, BlockStream& daemon, Recording& recording,
                        KnownClocks& known, StopSignals& signals) {
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  Timestamp next_save = start;
  for (;;) {
    const Result<bool> goes_on = daemon.receive(kPatienceMs);
    if (!goes_on) return tl::unexpected(goes_on.error());
    for (;;) {
      const auto block = daemon.next();
      if (!block) return tl::unexpected(block.error());
      if (!*block) break;
      if (auto taken = recording.append(**block); !taken) return tl::unexpected(taken.error());
    }
    if (options.on_progress) options.on_progress(recording.progress());
    const Duration elapsed = clock.now() - start;
    if (std::string why = end_reason(options, recording.progress(), elapsed, signals); !why.empty())
      return why;
    if (!*goes_on) return "the daemon hung up";
    if (!recording.has_begun()) continue;
    known.update(recording.config());
    if (clock.now() < next_save) continue;
    if (auto saved = recording.save(known.clocks()); !saved) return tl::unexpected(saved.error());
    next_save = clock.now() + kSavePeriod;
  }
}

}  // namespace

Result<RecordSummary> record(const RecordOptions& options) {
  std::error_code status;
  if (std::filesystem::exists(options.dir / "swarm.yaml", status) ||
      std::filesystem::exists(options.dir / "crepesd.yaml", status))
    return fail(ErrorCode::kIo, options.dir.string() + ": has a data set already");
  Result<UniqueFd> socket = connect_unix(options.socket);
  if (!socket) {
    return fail(ErrorCode::kNotFound, socket.error().message +
                                          ": is crepesd running, with recording.socket set, and "
                                          "are you root or of its group?");
  }
  StopSignals signals;
  BlockStream daemon(std::move(*socket));
  if (auto asked = daemon.request(options.pictures ? kPicturesRequest : kRecordRequest); !asked)
    return tl::unexpected(asked.error());
  Recording recording(options);
  KnownClocks known;
  Result<std::string> why = run(options, daemon, recording, known, signals);
  if (recording.has_begun()) known.refresh(recording.config());
  const Result<void> saved = recording.save(known.clocks());
  if (why && !saved) why = tl::unexpected(saved.error());
  if (!why) return tl::unexpected(recording.with_remainder(why.error()));
  if (!recording.has_begun()) return fail(ErrorCode::kIo, "record: nothing came; " + *why);
  RecordSummary summary = recording.summary(*why);
  summary.warning = known.fault(recording.config());
  return summary;
}

}  // namespace crepes
