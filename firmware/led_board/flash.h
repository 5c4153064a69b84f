/// The interface of the two flash pages that store the settings.
#ifndef CREPES_FIRMWARE_LED_BOARD_FLASH_H
#define CREPES_FIRMWARE_LED_BOARD_FLASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LED_FLASH_PAGES = 2 };

/// Erasing sets all bits of a page; a half-word can then be programmed once. The half-word at
/// `index` of a page is at byte 2 * index. Failures are detected by reading back.
struct led_flash {
  void* context;
  void (*erase)(void* context, int page);
  void (*program)(void* context, int page, size_t index, uint16_t value);
  uint16_t (*read)(const void* context, int page, size_t index);
};

#endif
