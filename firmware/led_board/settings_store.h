/// Settings that outlive a power cut: at any moment flash holds the old or the new ones, whole.
#ifndef CREPES_FIRMWARE_LED_BOARD_SETTINGS_STORE_H
#define CREPES_FIRMWARE_LED_BOARD_SETTINGS_STORE_H

#include "firmware/led_board/flash.h"
#include "firmware/protocol/led_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The newest settings that are whole and valid; unset where there are none.
struct led_settings led_settings_load(const struct led_flash* flash);

/// Writes valid settings over the older copy and reads them back. False when flash does not hold
/// them: the old ones still do.
bool led_settings_save(const struct led_flash* flash, const struct led_settings* settings);

#ifdef __cplusplus
}
#endif

#endif
