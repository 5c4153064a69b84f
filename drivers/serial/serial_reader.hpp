/// Reads measurements from a serial device.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/detect_protocol.hpp"
#include "drivers/serial/device_request.hpp"
#include "drivers/serial/frame_decoder.hpp"
#include "drivers/serial/serial_port.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The newest bytes of a stream, for `detect_protocol`.
class RecentBytes {
 public:
  void add(Bytes chunk) {
    constexpr std::size_t kMost = 2048;
    bytes_.insert(bytes_.end(), chunk.begin(), chunk.end());
    if (bytes_.size() <= kMost) return;
    bytes_.erase(bytes_.begin(), bytes_.end() - static_cast<std::ptrdiff_t>(kMost));
  }
  void clear() { bytes_.clear(); }
  [[nodiscard]] Bytes get() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Whether the bytes are of this device in another mode of operation: some of its frames, and of no
/// other kind of device.
template <FrameProtocol Protocol>
[[nodiscard]] bool is_in_another_mode(Bytes recent) {
  constexpr int kEnoughFrames = 3;
  int frames = 0;
  for (std::size_t at = 0; at < recent.size(); ++at)
    frames += Protocol::examine(recent.subspan(at)).kind == FrameKind::kForeign ? 1 : 0;
  return frames >= kEnoughFrames && !detect_protocol(recent);
}

/// A protocol whose device must be asked: the requests in order, from number 0 on.
template <class Parser>
concept AsksItsDevice = requires(std::size_t number) {
  { Parser::request(number) } -> std::same_as<DeviceRequest>;
};

/// Reads one device. A `Parser` is a FrameProtocol that turns whole frames into measurements:
///   using Measurement = ...;
///   void parse(Bytes frame, Timestamp arrival, const std::function<void(const Measurement&)>&);
///   std::string no_measurement_reason() const;     when frames hold no measurement
///   static constexpr std::string_view kForeignMeaning;   the meaning of FrameKind::kForeign
template <class Parser>
class SerialReader {
 public:
  using Measurement = typename Parser::Measurement;
  using Sink = std::function<void(const Measurement&)>;

  /// `clock` must outlive this.
  SerialReader(SerialPort port, Parser parser, const Clock& clock, Sink on_measurement)
      : port_(std::move(port)),
        parser_(std::move(parser)),
        clock_(clock),
        on_measurement_(std::move(on_measurement)),
        last_frame_(clock.now()),
        last_measurement_(last_frame_) {}

  /// Waits for bytes and forwards the measurements that they complete, stamped with their arrival.
  /// An error means that the device is gone.
  [[nodiscard]] Result<void> read_once(std::chrono::milliseconds timeout) {
    if constexpr (AsksItsDevice<Parser>) {
      if (Result<void> asked = ask(); !asked) return asked;
    }
    const Result<Bytes> chunk = port_.read_some(timeout);
    if (!chunk) return tl::unexpected(chunk.error());
    const Timestamp arrival = clock_.now();
    recent_.add(*chunk);
    decoder_.feed(*chunk, [&](Bytes frame) {
      last_frame_ = arrival;
      recent_.clear();
      parser_.parse(frame, arrival, [&](const Measurement& measurement) {
        last_measurement_ = arrival;
        on_measurement_(measurement);
      });
    });
    return {};
  }

  /// One sentence on what is wrong with the received bytes, if anything. Silence is not judged
  /// here.
  [[nodiscard]] std::optional<std::string> diagnosis() const {
    constexpr std::uint64_t kEnoughFrames = 3;
    constexpr std::uint64_t kEnoughBytes = 64;
    constexpr Duration kPatience = std::chrono::seconds(1);
    const Timestamp now = clock_.now();
    const DecoderCounts& counts = decoder_.counts();
    if (is_in_another_mode<Parser>(recent_.get()))
      return fmt::format("{}: {}", port_.path(), Parser::kForeignMeaning);
    if (now - last_frame_ >= kPatience) {
      if (counts.unchecked_in_a_row >= kEnoughFrames)
        return fmt::format("{}: {}", port_.path(), parser_.no_measurement_reason());
      if (counts.skipped_in_a_row < kEnoughBytes) return std::nullopt;
      return fmt::format("{}: {}", port_.path(), describe_unknown_bytes());
    }
    if (counts.frames == 0 || now - last_measurement_ < kPatience) return std::nullopt;
    return fmt::format("{}: {}", port_.path(), parser_.no_measurement_reason());
  }

  [[nodiscard]] const DecoderCounts& counts() const { return decoder_.counts(); }
  [[nodiscard]] const Parser& parser() const { return parser_; }

 private:
  /// Sends the next request when it is time.
  [[nodiscard]] Result<void> ask() {
    constexpr Duration kSilence = std::chrono::seconds(1);
    constexpr std::chrono::milliseconds kWriteTimeout{100};
    const Timestamp now = clock_.now();
    const DeviceRequest request = Parser::request(requests_);
    if (now < next_request_ || (request.only_if_silent && now - last_frame_ < kSilence)) return {};
    next_request_ = now + request.pause;
    ++requests_;
    return port_.write_all(bytes_of_text(request.bytes), kWriteTimeout);
  }

  [[nodiscard]] std::string describe_unknown_bytes() const {
    const std::optional<SerialProtocol> spoken = detect_protocol(recent_.get());
    return spoken ? fmt::format("another kind of device: it speaks {}", name_of(*spoken))
                  : "bytes without a valid frame; wrong baud rate or another kind of device?";
  }

  SerialPort port_;
  Parser parser_;
  FrameDecoder<Parser> decoder_;
  const Clock& clock_;
  Sink on_measurement_;
  RecentBytes recent_;
  Timestamp last_frame_;
  Timestamp last_measurement_;
  Timestamp next_request_{Duration::min()};
  std::size_t requests_ = 0;
};

}  // namespace crepes
