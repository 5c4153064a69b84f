#include "firmware/protocol/led_frame.h"

enum { SYNC_0 = 0xC5, SYNC_1 = 0x9A, HEADER = 4, CHECKED_FROM = 2, CRC_SIZE = 2 };

enum start { START_FALSE, START_INCOMPLETE, START_WHOLE };

uint16_t led_crc16(const uint8_t* bytes, size_t size) {
  uint32_t crc = 0xFFFF;
  for (size_t i = 0; i < size; ++i) {
    crc ^= (uint32_t)bytes[i] << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000) ? (crc << 1) ^ 0x1021 : crc << 1;
    crc &= 0xFFFF;
  }
  return (uint16_t)crc;
}

size_t led_frame_write(const struct led_frame* frame, uint8_t* out) {
  const uint8_t size = frame->size <= LED_MAX_PAYLOAD ? frame->size : LED_MAX_PAYLOAD;
  const uint8_t header[HEADER] = {SYNC_0, SYNC_1, size, frame->type};
  for (size_t i = 0; i < HEADER; ++i) out[i] = header[i];
  for (size_t i = 0; i < size; ++i) out[HEADER + i] = frame->payload[i];
  const size_t end = HEADER + (size_t)size;
  const uint16_t crc = led_crc16(out + CHECKED_FROM, end - CHECKED_FROM);
  out[end] = (uint8_t)(crc & 0xFF);
  out[end + 1] = (uint8_t)(crc >> 8);
  return end + CRC_SIZE;
}

void led_receiver_push(struct led_receiver* receiver, uint8_t byte) {
  // Never full after led_receiver_next, because a full buffer holds a frame or a false start.
  if (receiver->size < LED_MAX_FRAME) receiver->bytes[receiver->size++] = byte;
}

static void drop(struct led_receiver* receiver, size_t count) {
  receiver->size = (uint8_t)(receiver->size - count);
  for (size_t i = 0; i < receiver->size; ++i) receiver->bytes[i] = receiver->bytes[count + i];
}

static enum start examine(const struct led_receiver* receiver) {
  const uint8_t* bytes = receiver->bytes;
  const size_t size = receiver->size;
  if (bytes[0] != SYNC_0 || (size > 1 && bytes[1] != SYNC_1)) return START_FALSE;
  if (size > 2 && bytes[2] > LED_MAX_PAYLOAD) return START_FALSE;
  if (size <= 2 || size < (size_t)bytes[2] + LED_FRAME_OVERHEAD) return START_INCOMPLETE;
  const size_t end = HEADER + (size_t)bytes[2];
  const uint16_t crc = led_crc16(bytes + CHECKED_FROM, end - CHECKED_FROM);
  return crc == (bytes[end] | bytes[end + 1] << 8) ? START_WHOLE : START_FALSE;
}

bool led_receiver_next(struct led_receiver* receiver, bool line_is_silent,
                       struct led_frame* frame) {
  while (receiver->size > 0) {
    const enum start start = examine(receiver);
    if (start == START_WHOLE) {
      frame->size = receiver->bytes[2];
      frame->type = receiver->bytes[3];
      for (size_t i = 0; i < frame->size; ++i) frame->payload[i] = receiver->bytes[HEADER + i];
      drop(receiver, (size_t)frame->size + LED_FRAME_OVERHEAD);
      return true;
    }
    if (start == START_INCOMPLETE && !line_is_silent) return false;
    drop(receiver, 1);
    if (receiver->skipped < UINT16_MAX) ++receiver->skipped;
  }
  return false;
}
