#include "firmware/led_board/blink.h"

static bool is_slot_lit(const struct led_blink* blink) {
  return (blink->pattern >> blink->slot & 1) != 0;
}

struct led_blink led_blink_start(const struct led_settings* settings) {
  struct led_blink blink = {
      .pattern = settings->pattern,
      .slot_ticks = {settings->dark_ticks, settings->lit_ticks},
      .slots = settings->slots,
  };
  blink.ticks_left = blink.slot_ticks[is_slot_lit(&blink)];
  return blink;
}

bool led_blink_step(struct led_blink* blink) {
  const bool is_lit = is_slot_lit(blink) || blink->test_ticks > 0;
  if (blink->test_ticks > 0) --blink->test_ticks;
  if (--blink->ticks_left == 0) {
    blink->slot = (uint8_t)(blink->slot + 1 < blink->slots ? blink->slot + 1 : 0);
    blink->ticks_left = blink->slot_ticks[is_slot_lit(blink)];
  }
  return is_lit;
}
