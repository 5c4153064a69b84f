/// The board's side of the protocol: a request in, a reply out.
#ifndef CREPES_FIRMWARE_LED_BOARD_COMMAND_H
#define CREPES_FIRMWARE_LED_BOARD_COMMAND_H

#include "firmware/led_board/flash.h"
#include "firmware/protocol/led_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The action that the rest of the board must take.
enum led_effect {
  LED_EFFECT_NONE,
  LED_EFFECT_BLINK,  ///< start blinking with the board's new settings
  LED_EFFECT_TEST,   ///< steady light for test_ticks
};

/// The state that commands change.
struct led_board {
  struct led_flash flash;
  struct led_settings settings;  ///< as in flash
  struct led_status status;
  uint32_t test_ticks;
};

/// Replies to `request`. Writes flash and settings before it confirms them.
enum led_effect led_command(struct led_board* board, const struct led_frame* request,
                            struct led_frame* answer);

#ifdef __cplusplus
}
#endif

#endif
