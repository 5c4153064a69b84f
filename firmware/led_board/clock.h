/// The chip's clock.
#ifndef CREPES_FIRMWARE_LED_BOARD_CLOCK_H
#define CREPES_FIRMWARE_LED_BOARD_CLOCK_H

#include "firmware/protocol/led_messages.h"

/// 24 MHz: the F100's most, and on both chips flash then has no wait states, so that interrupts
/// take the same time each time. The best source that gets going within a few milliseconds.
enum led_clock clock_start(void);

uint32_t clock_hz(enum led_clock clock);

#endif
