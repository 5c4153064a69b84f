#include "firmware/led_board/settings_store.h"

// A record: format, serial number (u32), settings, padding, CRC-16 of all preceding bytes. The CRC
// is written last.
enum {
  FORMAT = 0x4C45,
  SERIAL_AT = 2,
  SETTINGS_AT = 6,
  CRC_AT = SETTINGS_AT + LED_SETTINGS_SIZE + 1,
  RECORD_SIZE = CRC_AT + 2,
};

struct record {
  uint8_t bytes[RECORD_SIZE];
};

static uint16_t half_word(const struct record* record, size_t index) {
  return (uint16_t)(record->bytes[2 * index] | record->bytes[2 * index + 1] << 8);
}

static void set_half_word(struct record* record, size_t index, uint32_t value) {
  record->bytes[2 * index] = (uint8_t)(value & 0xFF);
  record->bytes[2 * index + 1] = (uint8_t)((value >> 8) & 0xFF);
}

static uint32_t serial_of(const struct record* record) {
  return half_word(record, SERIAL_AT / 2) | (uint32_t)half_word(record, SERIAL_AT / 2 + 1) << 16;
}

static struct record read_page(const struct led_flash* flash, int page) {
  struct record record;
  for (size_t i = 0; i < RECORD_SIZE / 2; ++i)
    set_half_word(&record, i, flash->read(flash->context, page, i));
  return record;
}

static bool is_good(const struct record* record) {
  if (half_word(record, 0) != FORMAT) return false;
  if (half_word(record, CRC_AT / 2) != led_crc16(record->bytes, CRC_AT)) return false;
  const struct led_settings settings = led_settings_read(record->bytes + SETTINGS_AT);
  return led_settings_fault(&settings) == LED_FINE;
}

/// The page with the newest valid record, or -1. Copies the record to `record`.
static int newest(const struct led_flash* flash, struct record* record) {
  int found = -1;
  for (int page = 0; page < LED_FLASH_PAGES; ++page) {
    const struct record candidate = read_page(flash, page);
    if (!is_good(&candidate) || (found >= 0 && serial_of(&candidate) < serial_of(record))) continue;
    *record = candidate;
    found = page;
  }
  return found;
}

struct led_settings led_settings_load(const struct led_flash* flash) {
  struct record record;
  if (newest(flash, &record) < 0) return led_settings_unset();
  return led_settings_read(record.bytes + SETTINGS_AT);
}

bool led_settings_save(const struct led_flash* flash, const struct led_settings* settings) {
  struct record old;
  const int old_page = newest(flash, &old);
  const int page = old_page == 0 ? 1 : 0;
  const uint32_t serial = old_page < 0 ? 1 : serial_of(&old) + 1;

  struct record record;
  record.bytes[CRC_AT - 1] = 0;
  set_half_word(&record, 0, FORMAT);
  set_half_word(&record, SERIAL_AT / 2, serial);
  set_half_word(&record, SERIAL_AT / 2 + 1, serial >> 16);
  led_settings_write(settings, record.bytes + SETTINGS_AT);
  set_half_word(&record, CRC_AT / 2, led_crc16(record.bytes, CRC_AT));

  flash->erase(flash->context, page);
  for (size_t i = 0; i < RECORD_SIZE / 2; ++i)
    flash->program(flash->context, page, i, half_word(&record, i));
  for (size_t i = 0; i < RECORD_SIZE / 2; ++i)
    if (flash->read(flash->context, page, i) != half_word(&record, i)) return false;
  return true;
}
