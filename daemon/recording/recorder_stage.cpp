#include "daemon/recording/recorder_stage.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/recording/block.hpp"
#include "daemon/recording/picture_block.hpp"
#include "daemon/recording/recipient.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/dataset/dataset_rows.hpp"

namespace crepes {
namespace {

constexpr int kRecorderPollMs = 50;
constexpr Duration kRetry = std::chrono::seconds{5};
constexpr std::size_t kMaxBatch = 1 << 20;  ///< bytes of rows at a time
constexpr std::size_t kMaxRecipients = 4;
constexpr std::size_t kMaxSightings = 64;
// Robots of a picture that are not known by then are not identified in it.
constexpr Duration kRobotsPatience = std::chrono::milliseconds{60};

/// For a replay, which may not have the keys.
Config without_keys(Config config) {
  config.net.key_file.clear();
  config.net.robot_key_file.clear();
  for (MemberConfig& member : config.swarm.members) member.public_key.reset();
  return config;
}

/// The recorder thread's state.
class Recorder {
 public:
  Recorder(const RecorderStage& stage, const StageContext& context)
      : stage_(stage), context_(context), pictures_(stage.pictures.size()) {}

  void run_once() {
    if (auto config = stage_.settings.receive()) {
      config_ = std::move(*config);
      for (Recipient& recipient : recipients_) recipient.forget_config();
    }
    listen();
    wait();
    std::erase_if(recipients_, [](Recipient& recipient) { return !recipient.exchange(); });
    accept();
    choose_recording();
    receive_pictures();
    if (Recipient* const recording = recipient_that_records()) {
      if (recording->is_idle()) hand_over(*recording);
    } else {
      while (stage_.events.try_pop()) continue;
      missed_before_ = stage_.events.dropped();
    }
    answer_pictures();
  }

 private:
  void listen() {
    if (context_.clock.now() < retry_at_) return;
    retry_at_ = context_.clock.now() + kRetry;
    std::error_code status;
    if (listener_ && std::filesystem::is_socket(config_.recording.socket, status)) return;
    Result<UniqueFd> listener = listen_unix(config_.recording.socket);
    if (listener) {
      if (listener_)
        log_message(LogLevel::kWarning, "recording: its socket was removed; there is another now");
      listener_ = std::move(*listener);
      fault_.clear();
    } else if (listener.error().message != fault_) {
      fault_ = listener.error().message;
      log_message(LogLevel::kWarning, "recording: " + fault_);
    }
  }

  void wait() {
    std::vector<pollfd> watched{{listener_.get(), POLLIN, 0}};
    for (const Recipient& recipient : recipients_) {
      const auto events = static_cast<short>(recipient.is_idle() ? POLLIN : POLLIN | POLLOUT);
      watched.push_back({recipient.descriptor(), events, 0});
    }
    ::poll(watched.data(), watched.size(), kRecorderPollMs);
  }

  void accept() {
    UniqueFd socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!socket) {
      // A tool that cannot be accepted keeps waiting, and poll returns at once.
      if (errno == EMFILE || errno == ENFILE) {
        log_message(LogLevel::kWarning, "recording: too many open files; a tool was sent away");
        listener_ = UniqueFd{};
      }
      return;
    }
    Recipient recipient(std::move(socket));
    if (recipients_.size() == kMaxRecipients) {
      recipient.refuse("too many tools are connected");
      return;
    }
    recipients_.push_back(std::move(recipient));
  }

  Recipient* recipient_that_records() {
    const auto found =
        std::ranges::find_if(recipients_, [](const Recipient& each) { return each.records(); });
    return found == recipients_.end() ? nullptr : &*found;
  }

  /// The first that asked; others are refused.
  void choose_recording() {
    Recipient* const first = recipient_that_records();
    for (Recipient& recipient : recipients_) {
      if (recipient.records() && &recipient != first)
        recipient.refuse("another recording is under way");
    }
    std::erase_if(recipients_, [&](Recipient& each) { return each.records() && &each != first; });
    if (const bool records = first != nullptr; records != std::exchange(is_recording_, records))
      log_message(LogLevel::kInfo, records ? "recording: begins" : "recording: ended");
  }

  [[nodiscard]] bool is_looked_at(std::size_t camera) const {
    return std::ranges::any_of(
        recipients_, [camera](const Recipient& each) { return each.looks_at() == camera; });
  }

  /// Takes the pictures that were asked for, and asks for those that somebody waits for now.
  void receive_pictures() {
    const Recipient* const recording = recipient_that_records();
    // A recording that does not keep up misses them; it must not hold up who looks.
    const bool are_recorded =
        recording != nullptr && recording->records_pictures() && recording->is_idle();
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      PictureTap& tap = stage_.pictures[i];
      if (auto picture = tap.pictures.try_pop(); picture && !pictures_[i])
        pictures_[i] = HeldPicture{std::move(*picture), context_.clock.now(), are_recorded};
      if (!pictures_[i] && (are_recorded || is_looked_at(i))) tap.requests.push({});
    }
  }

  /// Sends the events since the last call.
  void hand_over(Recipient& recipient) {
    std::string text;
    put_config(recipient, text);
    const std::uint64_t missed = stage_.events.dropped();
    const std::uint64_t gap = missed - std::exchange(missed_before_, missed);
    if (gap > 0) append_block(text, "gap", fmt::format("{}", gap));
    for (const auto& [kind, rows] : waiting_rows()) append_block(text, kind, rows);
    if (recipient.records_pictures()) {
      for (auto& held : pictures_) {
        if (held && std::exchange(held->is_to_record, false))
          append_picture(text, held->picture.frame);
      }
    }
    if (!text.empty()) recipient.put(std::move(text));
  }

  /// Sends the pictures to those who look, once the robots in them are known or should be.
  void answer_pictures() {
    while (auto sighting = stage_.sightings.try_pop()) {
      if (sightings_.size() == kMaxSightings) sightings_.pop_front();
      sightings_.push_back(std::move(*sighting));
    }
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      const auto& held = pictures_[i];
      if (!held) continue;
      const PictureRobots* const robots = sighting_in(held->picture.frame);
      const bool is_ready =
          robots != nullptr || context_.clock.now() - held->since > kRobotsPatience;
      if (is_looked_at(i) && !is_ready) continue;
      if (is_looked_at(i)) show(held->picture, robots);
      pictures_[i].reset();
    }
  }

  [[nodiscard]] const PictureRobots* sighting_in(const Frame& frame) const {
    const auto found = std::ranges::find_if(sightings_, [&](const PictureRobots& sighting) {
      return sighting.stamp == frame.stamp && sighting.camera == frame.camera;
    });
    return found == sightings_.end() ? nullptr : &*found;
  }

  void show(const Picture& picture, const PictureRobots* robots) {
    std::string look;
    append_look(look, picture, robots);
    for (Recipient& recipient : recipients_) {
      if (recipient.looks_at() != picture.frame.camera) continue;
      std::string text;
      put_config(recipient, text);
      recipient.put_look(text + look);
    }
  }

  void put_config(Recipient& recipient, std::string& text) const {
    if (recipient.needs_config()) append_block(text, "config", write_config(without_keys(config_)));
  }

  [[nodiscard]] std::map<std::string, std::string> waiting_rows() {
    std::map<std::string, std::string> rows;
    std::size_t bytes = 0;
    const auto append = [&](const std::string& kind, const auto& measurement) {
      std::string& text = rows[kind];
      const std::size_t before = text.size();
      append_rows(text, measurement);
      bytes += text.size() - before;
    };
    while (bytes < kMaxBatch) {
      const auto event = stage_.events.try_pop();
      if (!event) break;
      if (const auto* imu = std::get_if<ImuSample>(&*event)) append("imu0", *imu);
      if (const auto* range = std::get_if<UwbRange>(&*event)) append("uwb0", *range);
      if (const auto* spots = std::get_if<SpotFrame>(&*event))
        append(fmt::format("cam{}", spots->camera), *spots);
    }
    return rows;
  }

  struct HeldPicture {
    Picture picture;
    Timestamp since{};
    bool is_to_record = false;
  };

  const RecorderStage& stage_;
  const StageContext& context_;
  Config config_;
  UniqueFd listener_;
  Timestamp retry_at_ = Timestamp::min();
  std::string fault_;
  std::vector<Recipient> recipients_;
  bool is_recording_ = false;
  std::vector<std::optional<HeldPicture>> pictures_;  ///< of each camera
  std::deque<PictureRobots> sightings_;
  std::uint64_t missed_before_ = 0;
};

}  // namespace

void run_recorder(const RecorderStage& stage, const StageContext& context,
                  const std::stop_token& stop) {
  Recorder recorder(stage, context);
  while (!stop.stop_requested()) {
    context.iterations.add();
    recorder.run_once();
  }
}

}  // namespace crepes
