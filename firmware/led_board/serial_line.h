/// USART1 on PA9 (out) and PA10 (in), LED_BAUD 8N1.
#ifndef CREPES_FIRMWARE_LED_BOARD_SERIAL_LINE_H
#define CREPES_FIRMWARE_LED_BOARD_SERIAL_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

void serial_line_start(uint32_t cpu_hz);

/// The oldest received byte; false if there is none. The buffer holds 63 bytes.
bool serial_line_read(uint8_t* byte);

/// Returns when all bytes have been sent, or after a timeout.
void serial_line_write(const uint8_t* bytes, size_t size);

#endif
