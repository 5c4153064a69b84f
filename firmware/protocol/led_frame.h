/// Frames on the serial line of an LED board, 115200 8N1:
///   C5 9A, length of the payload, type, payload, CRC-16 (low byte first)
/// The CRC (polynomial 0x1021, initially 0xFFFF) covers length, type and payload.
#ifndef CREPES_FIRMWARE_PROTOCOL_LED_FRAME_H
#define CREPES_FIRMWARE_PROTOCOL_LED_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  LED_BAUD = 115200,
  LED_MAX_PAYLOAD = 32,
  LED_FRAME_OVERHEAD = 6,
  LED_MAX_FRAME = LED_MAX_PAYLOAD + LED_FRAME_OVERHEAD,
  /// The gap between bytes of a frame is shorter than this.
  LED_LINE_SILENCE_MS = 20,
};

/// A message and its type.
struct led_frame {
  uint8_t type;
  uint8_t size;  ///< of the payload
  uint8_t payload[LED_MAX_PAYLOAD];
};

/// Received bytes that are not yet a frame. Initialized with zeros.
struct led_receiver {
  uint8_t bytes[LED_MAX_FRAME];
  uint8_t size;
  uint16_t skipped;  ///< bytes outside frames; saturates
};

uint16_t led_crc16(const uint8_t* bytes, size_t size);

/// Writes at most LED_MAX_FRAME bytes to `out` and returns their number.
size_t led_frame_write(const struct led_frame* frame, uint8_t* out);

/// Call led_receiver_next afterwards until it returns false.
void led_receiver_push(struct led_receiver* receiver, uint8_t byte);

/// The next complete frame, if there is one. After a false start the search continues one byte
/// later. On a silent line an incomplete frame counts as a false start.
bool led_receiver_next(struct led_receiver* receiver, bool line_is_silent, struct led_frame* frame);

#ifdef __cplusplus
}
#endif

#endif
