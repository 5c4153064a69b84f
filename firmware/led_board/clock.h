/// The chip's clock.
#ifndef CREPES_FIRMWARE_LED_BOARD_CLOCK_H
#define CREPES_FIRMWARE_LED_BOARD_CLOCK_H

#include "firmware/protocol/led_messages.h"

/// 24 MHz: the maximum of the F100. Flash then needs no wait states on either chip, so interrupts
/// have a constant duration. Selects the best source that starts within a few milliseconds.
enum led_clock clock_start(void);

uint32_t clock_hz(enum led_clock clock);

#endif
