/// Six LEDs on PA0 to PA3 (TIM2), PA6 and PA7 (TIM3), lit by high level.
///
/// The PWM of the timers always runs and sets the brightness of each LED. One write selects whether
/// the six pins follow their timers or are low, so all change at the same time.
#ifndef CREPES_FIRMWARE_LED_BOARD_LIGHT_H
#define CREPES_FIRMWARE_LED_BOARD_LIGHT_H

#include "firmware/led_board/stm32f1.h"
#include "firmware/protocol/led_messages.h"

// GPIOA->CRL, four bits for each pin: 2 output, A timer output (both push-pull, 2 MHz);
// PA4 and PA5 are inputs, pulled down.
#define LIGHT_DARK 0x22882222U
#define LIGHT_LIT 0xAA88AAAAU

void light_start(uint32_t cpu_hz);
void light_dim(const uint8_t percent[LED_COUNT]);
static inline void light_set(uint32_t light) { GPIOA->CRL = light; }

#endif
