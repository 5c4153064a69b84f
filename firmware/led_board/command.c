#include "firmware/led_board/command.h"

#include "firmware/led_board/settings_store.h"

static enum led_effect refuse(const struct led_frame* request, enum led_fault fault,
                              struct led_frame* answer) {
  answer->type = LED_REFUSED;
  answer->size = 2;
  answer->payload[0] = request->type;
  answer->payload[1] = (uint8_t)fault;
  return LED_EFFECT_NONE;
}

static void tell_settings(const struct led_board* board, struct led_frame* answer) {
  answer->type = LED_SETTINGS;
  answer->size = LED_SETTINGS_SIZE;
  led_settings_write(&board->settings, answer->payload);
}

static enum led_effect set(struct led_board* board, const struct led_frame* request,
                           struct led_frame* answer) {
  const struct led_settings settings = led_settings_read(request->payload);
  const enum led_fault fault = led_settings_fault(&settings);
  if (fault != LED_FINE) return refuse(request, fault, answer);
  if (!led_settings_save(&board->flash, &settings)) return refuse(request, LED_BAD_FLASH, answer);
  board->settings = led_settings_load(&board->flash);
  tell_settings(board, answer);
  return LED_EFFECT_BLINK;
}

static enum led_effect test(struct led_board* board, const struct led_frame* request,
                            struct led_frame* answer) {
  const uint32_t ms = request->payload[0] | (uint32_t)request->payload[1] << 8;
  if (ms > LED_TEST_MAX_MS) return refuse(request, LED_BAD_TIME, answer);
  board->test_ticks = ms * (1000 / LED_TICK_US);
  answer->type = LED_DONE;
  answer->size = 0;
  return LED_EFFECT_TEST;
}

static void tell_status(const struct led_board* board, struct led_frame* answer) {
  answer->type = LED_STATUS;
  answer->size = LED_STATUS_SIZE;
  led_status_write(&board->status, answer->payload);
}

enum led_effect led_command(struct led_board* board, const struct led_frame* request,
                            struct led_frame* answer) {
  if (request->type == LED_SET && request->size == LED_SETTINGS_SIZE)
    return set(board, request, answer);
  if (request->type == LED_TEST && request->size == 2) return test(board, request, answer);
  if (request->type == LED_GET && request->size == 0)
    tell_settings(board, answer);
  else if (request->type == LED_ASK && request->size == 0)
    tell_status(board, answer);
  else
    return refuse(request, LED_BAD_REQUEST, answer);
  return LED_EFFECT_NONE;
}
