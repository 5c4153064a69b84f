/// Whether the board is lit, tick by tick (LED_TICK_US).
#ifndef CREPES_FIRMWARE_LED_BOARD_BLINK_H
#define CREPES_FIRMWARE_LED_BOARD_BLINK_H

#include "firmware/protocol/led_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Where a board is in its code.
struct led_blink {
  uint32_t pattern;
  uint16_t slot_ticks[2];  ///< of a dark slot, of a lit slot
  uint8_t slots;
  uint8_t slot;         ///< of the next tick
  uint16_t ticks_left;  ///< in this slot
  uint32_t test_ticks;  ///< remaining steady light; the pattern continues meanwhile
};

/// The beginning of the pattern. Settings must be valid or unset.
struct led_blink led_blink_start(const struct led_settings* settings);

/// Whether the next tick is lit.
bool led_blink_step(struct led_blink* blink);

#ifdef __cplusplus
}
#endif

#endif
