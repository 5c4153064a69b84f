#include "daemon/recording/recorder_stage.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "config/reading/config_file.hpp"
#include "daemon/recording/unix_socket.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/dataset/dataset_rows.hpp"

namespace crepes {
namespace {

constexpr int kRecorderPollMs = 50;
constexpr Duration kRetry = std::chrono::seconds{5};
constexpr std::size_t kMaxBatch = 1 << 20;  ///< bytes of rows at a time
constexpr std::size_t kMaxRequest = 100;

void append_block(std::string& text, std::string_view kind, std::string_view content) {
  text += fmt::format("{} {}\n", kind, content.size());
  text.append(content);
}

std::string picture_block(const Frame& frame) {
  std::string content =
      fmt::format("{} {} {} {}\n", frame.camera, to_ns(frame.stamp), frame.width, frame.height);
  content.append(frame.pixels.begin(), frame.pixels.end());
  std::string block;
  append_block(block, "picture", content);
  return block;
}

/// For a replay, which may not have the keys.
Config without_keys(Config config) {
  config.net.key_file.clear();
  config.net.robot_key_file.clear();
  for (MemberConfig& member : config.swarm.members) member.public_key.reset();
  return config;
}

/// The tool at the other end.
class Recipient {
 public:
  explicit Recipient(UniqueFd socket) : socket_(std::move(socket)) {}

  [[nodiscard]] int descriptor() const { return socket_.get(); }
  [[nodiscard]] bool wants_rows() const { return request_.starts_with(kRecordRequest); }
  [[nodiscard]] bool wants_pictures() const { return request_ == kPicturesRequest; }
  /// Everything has been sent, so there is room for more.
  [[nodiscard]] bool is_idle() const { return sent_ == waiting_.size(); }
  void put(std::string text) {
    if (is_idle()) {
      waiting_ = std::move(text);
      sent_ = 0;
    } else {
      waiting_ += text;
    }
  }

  /// Reads the request and sends what the socket accepts without blocking. Returns whether the tool
  /// is still connected.
  [[nodiscard]] bool exchange() { return read_request() && send_some(); }

 private:
  [[nodiscard]] bool read_request() {
    std::array<char, kMaxRequest> buffer{};
    const ssize_t count = ::recv(socket_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count == 0) return false;
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    line_.append(buffer.data(), static_cast<std::size_t>(count));
    const std::size_t end = line_.find('\n');
    if (end == std::string::npos) return line_.size() < kMaxRequest;
    request_ = line_.substr(0, end);
    return wants_rows() && end + 1 == line_.size();
  }

  [[nodiscard]] bool send_some() {
    while (!is_idle()) {
      const ssize_t count = ::send(socket_.get(), waiting_.data() + sent_, waiting_.size() - sent_,
                                   MSG_DONTWAIT | MSG_NOSIGNAL);
      if (count < 0) return errno == EAGAIN || errno == EINTR;
      sent_ += static_cast<std::size_t>(count);
    }
    return true;
  }

  UniqueFd socket_;
  std::string line_;
  std::string request_;
  std::string waiting_;
  std::size_t sent_ = 0;
};

/// The recorder thread's state.
class Recorder {
 public:
  Recorder(const RecorderStage& stage, const StageContext& context)
      : stage_(stage), context_(context) {}

  void run_once() {
    if (auto config = stage_.settings.receive()) {
      config_ = std::move(*config);
      is_config_sent_ = false;
    }
    listen();
    wait();
    if (recipient_ && !recipient_->exchange()) end();
    accept();
    if (recipient_ && recipient_->wants_rows()) {
      if (recipient_->is_idle()) hand_over();
    } else {
      while (stage_.events.try_pop()) continue;
      missed_before_ = stage_.events.dropped();
    }
  }

 private:
  void listen() {
    if (listener_ || context_.clock.now() < retry_at_) return;
    retry_at_ = context_.clock.now() + kRetry;
    Result<UniqueFd> listener = listen_unix(config_.recording.socket);
    if (listener) {
      listener_ = std::move(*listener);
    } else if (listener.error().message != fault_) {
      fault_ = listener.error().message;
      log_message(LogLevel::kWarning, "recording: " + fault_);
    }
  }

  void wait() {
    const auto fd_of = [](const auto& thing) { return thing ? thing->descriptor() : -1; };
    const bool sends = recipient_ && !recipient_->is_idle();
    const auto events = static_cast<short>(sends ? POLLIN | POLLOUT : POLLIN);
    std::array<pollfd, 2> watched{pollfd{listener_.get(), POLLIN, 0},
                                  pollfd{fd_of(recipient_), events, 0}};
    ::poll(watched.data(), watched.size(), kRecorderPollMs);
  }

  void accept() {
    UniqueFd socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!socket) return;
    if (recipient_) {
      Recipient surplus(std::move(socket));
      std::string block;
      append_block(block, "refused", "another recording is under way");
      surplus.put(std::move(block));
      static_cast<void>(surplus.exchange());
      return;
    }
    recipient_.emplace(std::move(socket));
    is_config_sent_ = false;
    log_message(LogLevel::kInfo, "recording: begins");
  }

  void end() {
    recipient_.reset();
    log_message(LogLevel::kInfo, "recording: ended");
  }

  /// Sends the events since the last call.
  void hand_over() {
    std::string text;
    if (!std::exchange(is_config_sent_, true))
      append_block(text, "config", write_config(without_keys(config_)));
    const std::uint64_t missed = stage_.events.dropped();
    const std::uint64_t gap = missed - std::exchange(missed_before_, missed);
    if (gap > 0) append_block(text, "gap", fmt::format("{}", gap));
    for (const auto& [kind, rows] : waiting_rows()) append_block(text, kind, rows);
    for (PictureTap& tap : stage_.pictures) {
      if (!recipient_->wants_pictures()) break;
      if (auto frame = tap.pictures.try_pop()) text += picture_block(*frame);
      tap.requests.push({});
    }
    if (!text.empty()) recipient_->put(std::move(text));
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

  const RecorderStage& stage_;
  const StageContext& context_;
  Config config_;
  UniqueFd listener_;
  Timestamp retry_at_ = Timestamp::min();
  std::string fault_;
  std::optional<Recipient> recipient_;
  bool is_config_sent_ = false;
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
