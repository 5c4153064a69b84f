#include "firmware/protocol/led_messages.h"

enum {
  MIN_SLOTS = 8,
  MAX_SLOTS = 32,
  DUTY_SLOTS = 2,
  DUTY_PATTERN = 1,
  MIN_SLOT_TICKS = 2000 / LED_TICK_US,
  MAX_SLOT_TICKS = 70000 / LED_TICK_US,
  MIN_PART_TICKS = 500 / LED_TICK_US,
  MIN_PERIOD_TICKS = 10000 / LED_TICK_US,
  MAX_PERIOD_TICKS = 200000 / LED_TICK_US,
  MAX_ID = 65534,
  FULL = 100,
};

static bool is_pattern_good(const struct led_settings* s) {
  if (s->slots == DUTY_SLOTS) return s->pattern == DUTY_PATTERN;
  if (s->slots < MIN_SLOTS || s->slots > MAX_SLOTS) return false;
  const uint32_t all = UINT32_MAX >> (MAX_SLOTS - s->slots);
  return s->pattern != 0 && s->pattern != all && (s->pattern & ~all) == 0;
}

static bool is_time_good(const struct led_settings* s) {
  if (s->slots != DUTY_SLOTS)
    return s->lit_ticks == s->dark_ticks && s->lit_ticks >= MIN_SLOT_TICKS &&
           s->lit_ticks <= MAX_SLOT_TICKS;
  const uint32_t period = (uint32_t)s->lit_ticks + s->dark_ticks;
  return s->lit_ticks >= MIN_PART_TICKS && s->dark_ticks >= MIN_PART_TICKS &&
         period >= MIN_PERIOD_TICKS && period <= MAX_PERIOD_TICKS;
}

enum led_fault led_settings_fault(const struct led_settings* settings) {
  if (settings->robot_id == 0 || settings->robot_id > MAX_ID) return LED_BAD_ID;
  if (!is_pattern_good(settings)) return LED_BAD_PATTERN;
  if (!is_time_good(settings)) return LED_BAD_TIME;
  for (int i = 0; i < LED_COUNT; ++i)
    if (settings->brightness[i] > FULL) return LED_BAD_BRIGHTNESS;
  return LED_FINE;
}

struct led_settings led_settings_unset(void) {
  const struct led_settings unset = {
      .slots = 1, .lit_ticks = 1, .dark_ticks = 1, .brightness = {100, 100, 100, 100, 100, 100}};
  return unset;
}

static uint8_t* put_u16(uint8_t* out, uint32_t value) {
  out[0] = (uint8_t)(value & 0xFF);
  out[1] = (uint8_t)((value >> 8) & 0xFF);
  return out + 2;
}

static uint16_t get_u16(const uint8_t* bytes) { return (uint16_t)(bytes[0] | bytes[1] << 8); }

void led_settings_write(const struct led_settings* settings, uint8_t out[LED_SETTINGS_SIZE]) {
  out = put_u16(out, settings->robot_id);
  *out++ = settings->slots;
  out = put_u16(out, settings->pattern);
  out = put_u16(out, settings->pattern >> 16);
  out = put_u16(out, settings->lit_ticks);
  out = put_u16(out, settings->dark_ticks);
  for (int i = 0; i < LED_COUNT; ++i) *out++ = settings->brightness[i];
}

struct led_settings led_settings_read(const uint8_t bytes[LED_SETTINGS_SIZE]) {
  struct led_settings settings = {
      .robot_id = get_u16(bytes),
      .slots = bytes[2],
      .pattern = get_u16(bytes + 3) | (uint32_t)get_u16(bytes + 5) << 16,
      .lit_ticks = get_u16(bytes + 7),
      .dark_ticks = get_u16(bytes + 9),
  };
  for (int i = 0; i < LED_COUNT; ++i) settings.brightness[i] = bytes[11 + i];
  return settings;
}

void led_status_write(const struct led_status* status, uint8_t out[LED_STATUS_SIZE]) {
  *out++ = status->protocol;
  for (int i = 0; i < 3; ++i) *out++ = status->version[i];
  *out++ = status->clock;
  *out++ = status->was_watchdog;
  (void)put_u16(out, status->skipped);
}

struct led_status led_status_read(const uint8_t bytes[LED_STATUS_SIZE]) {
  const struct led_status status = {
      .protocol = bytes[0],
      .version = {bytes[1], bytes[2], bytes[3]},
      .clock = bytes[4],
      .was_watchdog = bytes[5],
      .skipped = get_u16(bytes + 6),
  };
  return status;
}
