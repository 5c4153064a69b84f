#include "drivers/led_board/led_line.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <span>

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr int kLedAttempts = 4;
constexpr Duration kAnswerWithin = 250ms;  // a board that writes flash needs 60 ms

led_frame request_of(led_message type) {
  led_frame request{};
  request.type = static_cast<std::uint8_t>(type);
  return request;
}

std::array<std::uint8_t, LED_SETTINGS_SIZE> bytes_of(const led_settings& settings) {
  std::array<std::uint8_t, LED_SETTINGS_SIZE> bytes{};
  led_settings_write(&settings, bytes.data());
  return bytes;
}

bool is_refusal_of(const led_frame& request, const led_frame& answer) {
  return answer.type == LED_REFUSED && answer.size == 2 && answer.payload[0] == request.type;
}

}  // namespace

std::string describe(led_fault fault) {
  switch (fault) {
    case LED_FINE:
      return "nothing is wrong";
    case LED_BAD_REQUEST:
      return "the board does not know this request: is its firmware older?";
    case LED_BAD_ID:
      return "the id must lie between 1 and 65534";
    case LED_BAD_PATTERN:
      return "a pattern must have 8 to 32 slots and change";
    case LED_BAD_TIME:
      return "slots must last 2 to 70 ms, duty periods 10 to 200 ms, a test 60 s at most";
    case LED_BAD_BRIGHTNESS:
      return "brightness must lie between 0 and 100 %";
    case LED_BAD_FLASH:
      return "the board's flash does not take the settings; it keeps the old ones";
    case LED_FAULT_COUNT:
      break;
  }
  return fmt::format("fault {}", static_cast<int>(fault));
}

Result<LedLine> LedLine::open(const std::string& path, const Clock& clock) {
  return SerialPort::open(path, LED_BAUD).map([&](SerialPort&& port) {
    return LedLine(std::move(port), clock);
  });
}

/// Empty without an answer in time.
Result<std::optional<led_frame>> LedLine::listen(const Question& question, led_receiver& receiver) {
  const Timestamp until = clock_.now() + kAnswerWithin;
  for (Duration left = kAnswerWithin; left > Duration::zero(); left = until - clock_.now()) {
    const auto chunk = port_.read_some(std::chrono::ceil<std::chrono::milliseconds>(left));
    if (!chunk) return tl::unexpected(chunk.error());
    for (const std::uint8_t byte : *chunk) {
      led_receiver_push(&receiver, byte);
      led_frame frame{};
      while (led_receiver_next(&receiver, false, &frame)) {
        if (frame.type == question.answer && frame.size == question.answer_size) return frame;
        if (!is_refusal_of(question.request, frame)) continue;
        return fail(ErrorCode::kConfig, fmt::format("{}: refused: {}", port_.path(),
                                                    describe(led_fault(frame.payload[1]))));
      }
    }
  }
  return std::nullopt;
}

Result<led_frame> LedLine::ask(const Question& question) {
  std::array<std::uint8_t, LED_MAX_FRAME> bytes{};
  const Bytes wire = std::span(bytes).first(led_frame_write(&question.request, bytes.data()));
  led_receiver receiver{};
  for (int attempt = 0; attempt < kLedAttempts; ++attempt) {
    if (const Result<void> sent = port_.write_all(wire, 500ms); !sent)
      return tl::unexpected(sent.error());
    const Result<std::optional<led_frame>> answer = listen(question, receiver);
    if (!answer) return tl::unexpected(answer.error());
    if (*answer) return **answer;
  }
  return fail(ErrorCode::kIo, port_.path() + (receiver.skipped + receiver.size > 0
                                                  ? ": speaks, but not as an LED board does"
                                                  : ": no answer; is this the LED board?"));
}

Result<led_settings> LedLine::settings() {
  return ask({request_of(LED_GET), LED_SETTINGS, LED_SETTINGS_SIZE})
      .map([](const led_frame& frame) { return led_settings_read(frame.payload); });
}

Result<led_status> LedLine::status() {
  return ask({request_of(LED_ASK), LED_STATUS, LED_STATUS_SIZE}).map([](const led_frame& frame) {
    return led_status_read(frame.payload);
  });
}

Result<void> LedLine::set(const led_settings& settings) {
  led_frame request = request_of(LED_SET);
  request.size = LED_SETTINGS_SIZE;
  led_settings_write(&settings, request.payload);
  return ask({request, LED_SETTINGS, LED_SETTINGS_SIZE})
      .and_then([&](const led_frame&) { return this->settings(); })
      .and_then([&](const led_settings& kept) -> Result<void> {
        if (bytes_of(kept) == bytes_of(settings)) return {};
        return fail(ErrorCode::kIo, port_.path() + ": holds other settings than it was given");
      });
}

Result<void> LedLine::test(std::chrono::milliseconds duration) {
  const auto ms = std::clamp<std::int64_t>(duration.count(), 0, LED_TEST_MAX_MS);
  led_frame request = request_of(LED_TEST);
  request.size = 2;
  request.payload[0] = static_cast<std::uint8_t>(ms & 0xFF);
  request.payload[1] = static_cast<std::uint8_t>(ms >> 8);
  return ask({request, LED_DONE, 0}).map([](const led_frame&) {});
}

}  // namespace crepes
