/// The LED board. At every tick SysTick sets the light and computes the next one. Meanwhile the
/// main loop replies to requests and feeds the watchdog.
#include "firmware/led_board/blink.h"
#include "firmware/led_board/chip_flash.h"
#include "firmware/led_board/clock.h"
#include "firmware/led_board/command.h"
#include "firmware/led_board/light.h"
#include "firmware/led_board/serial_line.h"
#include "firmware/led_board/settings_store.h"
#include "firmware/led_board/stm32f1.h"
#include "firmware/led_board/version.h"

enum {
  SILENCE_TICKS = LED_LINE_SILENCE_MS * 1000 / LED_TICK_US,
  WATCHDOG_UNLOCK = 0x5555,
  WATCHDOG_FEED = 0xAAAA,
  WATCHDOG_START = 0xCCCC,
  WATCHDOG_DIVIDER_32 = 3,
  WATCHDOG_COUNT =
      1250,  // one second of the 40 kHz oscillator; 0.7 s to 1.4 s within its tolerance
};

// Shared with SysTick: `blink` is changed with interrupts off.
static struct led_blink blink;
static volatile uint32_t ticks;

void systick_handler(void);

void systick_handler(void) {
  static uint32_t next = LIGHT_DARK;
  light_set(next);  // first, so that the delay is constant
  next = led_blink_step(&blink) ? LIGHT_LIT : LIGHT_DARK;
  ++ticks;
}

static void show(const struct led_settings* settings) {
  light_dim(settings->brightness);
  const struct led_blink start = led_blink_start(settings);
  interrupts_off();
  blink = start;
  interrupts_on();
}

static void shine(uint32_t test_ticks) {
  interrupts_off();
  blink.test_ticks = test_ticks;
  interrupts_on();
}

static void start_ticks(uint32_t cpu_hz) {
  SYSTICK->LOAD = cpu_hz / (1000000 / LED_TICK_US) - 1;
  SYSTICK->VAL = 0;
  SYSTICK->CTRL = SYSTICK_ENABLE | SYSTICK_INTERRUPT | SYSTICK_CPU_CLOCK;
}

static void start_watchdog(void) {
  IWDG->KR = WATCHDOG_START;
  IWDG->KR = WATCHDOG_UNLOCK;
  IWDG->PR = WATCHDOG_DIVIDER_32;
  IWDG->RLR = WATCHDOG_COUNT;
}

static struct led_board start_board(enum led_clock clock) {
  struct led_board board = {
      .flash = chip_flash(),
      .status = {.protocol = LED_PROTOCOL_VERSION,
                 .version = {LED_VERSION_MAJOR, LED_VERSION_MINOR, LED_VERSION_PATCH},
                 .clock = (uint8_t)clock,
                 .was_watchdog = (RCC->CSR & RCC_CSR_IWDGRSTF) != 0},
  };
  RCC->CSR |= RCC_CSR_RMVF;
  board.settings = led_settings_load(&board.flash);
  return board;
}

static void answer(struct led_board* board, const struct led_frame* request) {
  struct led_frame frame;
  uint8_t bytes[LED_MAX_FRAME];
  const enum led_effect effect = led_command(board, request, &frame);
  if (effect == LED_EFFECT_BLINK) show(&board->settings);
  if (effect == LED_EFFECT_TEST) shine(board->test_ticks);
  serial_line_write(bytes, led_frame_write(&frame, bytes));
}

/// Replies to all complete requests.
static void listen(struct led_board* board, struct led_receiver* receiver) {
  static uint32_t last_byte_at;
  uint8_t byte = 0;
  struct led_frame request;
  const bool has_byte = serial_line_read(&byte);
  if (has_byte) {
    led_receiver_push(receiver, byte);
    last_byte_at = ticks;
  }
  const bool is_silent = ticks - last_byte_at > SILENCE_TICKS;
  while (led_receiver_next(receiver, is_silent, &request)) {
    board->status.skipped = receiver->skipped;
    answer(board, &request);
  }
}

int main(void) {
  const enum led_clock clock = clock_start();
  struct led_board board = start_board(clock);
  struct led_receiver receiver = {.size = 0};
  light_start(clock_hz(clock));
  show(&board.settings);
  serial_line_start(clock_hz(clock));
  start_watchdog();
  start_ticks(clock_hz(clock));
  for (uint32_t seen = ticks;;) {
    listen(&board, &receiver);
    // The watchdog is fed only if both SysTick and the main loop run.
    if (ticks != seen) IWDG->KR = WATCHDOG_FEED;
    seen = ticks;
    wait_for_interrupt();
  }
}
