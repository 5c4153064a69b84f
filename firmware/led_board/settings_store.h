/// Settings that survive a power failure: flash always holds the complete old or new settings.
#ifndef CREPES_FIRMWARE_LED_BOARD_SETTINGS_STORE_H
#define CREPES_FIRMWARE_LED_BOARD_SETTINGS_STORE_H

#include "firmware/led_board/flash.h"
#include "firmware/protocol/led_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The newest complete and valid settings; unset if there are none.
struct led_settings led_settings_load(const struct led_flash* flash);

/// Writes valid settings over the older copy and reads them back. False if that failed; the old
/// settings are then still valid.
bool led_settings_save(const struct led_flash* flash, const struct led_settings* settings);

#ifdef __cplusplus
}
#endif

#endif
