/// From a serial device to measurements.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "drivers/serial/frame_decoder.hpp"
#include "drivers/serial/serial_port.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Reads one device. A `Parser` is a FrameProtocol that turns whole frames into measurements:
///   using Measurement = ...;
///   void parse(Bytes frame, Timestamp arrival, const std::function<void(const Measurement&)>&);
///   static constexpr std::string_view kForeignMeaning;   what FrameKind::kForeign tells
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
        on_measurement_(std::move(on_measurement)) {}

  /// Waits for bytes and hands on what they complete, stamped with their arrival. An error means
  /// that the device is gone.
  [[nodiscard]] Result<void> read_once(std::chrono::milliseconds timeout) {
    const Result<Bytes> chunk = port_.read_some(timeout);
    if (!chunk) return tl::unexpected(chunk.error());
    const Timestamp arrival = clock_.now();
    decoder_.feed(*chunk, [&](Bytes frame) { parser_.parse(frame, arrival, on_measurement_); });
    return {};
  }

  /// One sentence on what is wrong with what comes in, if anything; silence is not judged here.
  [[nodiscard]] std::optional<std::string> diagnosis() const {
    constexpr std::uint64_t kEnoughForeign = 3;
    constexpr std::uint64_t kEnoughBytes = 4 * Parser::kMaxFrame;
    const DecoderCounts& counts = decoder_.counts();
    if (counts.foreign_in_a_row >= kEnoughForeign) {
      return port_.path() + ": " + std::string(Parser::kForeignMeaning);
    }
    if (counts.skipped_in_a_row < kEnoughBytes) return std::nullopt;
    return port_.path() + ": " + std::to_string(counts.skipped_in_a_row) +
           " bytes without a valid frame; wrong baud rate or another kind of device?";
  }

  [[nodiscard]] const DecoderCounts& counts() const { return decoder_.counts(); }
  [[nodiscard]] const Parser& parser() const { return parser_; }

 private:
  SerialPort port_;
  Parser parser_;
  FrameDecoder<Parser> decoder_;
  const Clock& clock_;
  Sink on_measurement_;
};

}  // namespace crepes
