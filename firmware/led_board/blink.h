/// When the board is lit, one tick (LED_TICK_US) after the other.
#ifndef CREPES_FIRMWARE_LED_BOARD_BLINK_H
#define CREPES_FIRMWARE_LED_BOARD_BLINK_H

#include "firmware/protocol/led_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

struct led_blink {
  uint32_t pattern;
  uint16_t slot_ticks[2];  ///< of a dark slot, of a lit one
  uint8_t slots;
  uint8_t slot;         ///< where the next tick is
  uint16_t ticks_left;  ///< in that slot
  uint32_t test_ticks;  ///< steady light for so long, while the pattern goes on beneath
};

/// At the beginning of the pattern of valid or unset settings.
struct led_blink led_blink_start(const struct led_settings* settings);

/// Whether the next tick is lit.
bool led_blink_step(struct led_blink* blink);

#ifdef __cplusplus
}
#endif

#endif
