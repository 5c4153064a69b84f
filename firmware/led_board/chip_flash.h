/// The chip's flash, directly after the program.
#ifndef CREPES_FIRMWARE_LED_BOARD_CHIP_FLASH_H
#define CREPES_FIRMWARE_LED_BOARD_CHIP_FLASH_H

#include "firmware/led_board/flash.h"

/// The processor stops while a page is erased (40 ms at most) and a half-word is programmed.
struct led_flash chip_flash(void);

#endif
