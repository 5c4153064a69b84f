#include "firmware/led_board/light.h"

enum {
  STEPS = 100,      // of brightness
  PWM_HZ = 120000,  // a lit edge can be delayed by one period: 8.3 us
  PWM_MODE_1 =
      0x6868,  // two channels: high while CNT < CCR; CCR is updated at the end of the period
  ALL_CHANNELS = 0x1111,
  START = 0x81,  // with buffered ARR
};

static void start_timer(struct timer* timer, uint32_t cpu_hz) {
  const uint32_t divider = cpu_hz / (PWM_HZ * STEPS);
  timer->PSC = divider > 0 ? divider - 1 : 0;
  timer->ARR = STEPS - 1;
  timer->CCMR1 = PWM_MODE_1;
  timer->CCMR2 = PWM_MODE_1;
  timer->CCER = ALL_CHANNELS;
  timer->EGR = 1;
  timer->CR1 = START;
}

void light_start(uint32_t cpu_hz) {
  RCC->APB2ENR |= RCC_APB2ENR_IOPA;
  RCC->APB1ENR |= RCC_APB1ENR_TIM2 | RCC_APB1ENR_TIM3;
  light_set(LIGHT_DARK);
  start_timer(TIM2, cpu_hz);
  start_timer(TIM3, cpu_hz);
}

void light_dim(const uint8_t percent[LED_COUNT]) {
  for (int i = 0; i < 4; ++i) TIM2->CCR[i] = percent[i];
  for (int i = 0; i < 2; ++i) TIM3->CCR[i] = percent[4 + i];
}
