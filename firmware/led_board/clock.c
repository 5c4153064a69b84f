#include "firmware/led_board/clock.h"

#include "firmware/led_board/stm32f1.h"

/// Iterations of a loop at 8 MHz: about 40 ms. A crystal needs 2 ms.
enum { PATIENCE = 40000 };

static bool comes(const reg32* reg, uint32_t mask, uint32_t value) {
  for (int i = 0; i < PATIENCE; ++i)
    if ((*reg & mask) == value) return true;
  return false;
}

/// The PLL can be configured only while it neither runs nor drives the chip. The boot loader may
/// leave it so.
static bool run_on_pll(uint32_t source_and_factor) {
  RCC->CFGR = 0;
  if (!comes(&RCC->CFGR, RCC_CFGR_SWS, 0)) return false;
  RCC->CR &= ~(uint32_t)RCC_CR_PLLON;
  RCC->CFGR = source_and_factor;
  RCC->CR |= RCC_CR_PLLON;
  if (!comes(&RCC->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY)) return false;
  RCC->CFGR |= RCC_CFGR_SW_PLL;
  return comes(&RCC->CFGR, RCC_CFGR_SWS, RCC_CFGR_SWS_PLL);
}

enum led_clock clock_start(void) {
  RCC->CR |= RCC_CR_HSEON;
  if (comes(&RCC->CR, RCC_CR_HSERDY, RCC_CR_HSERDY) &&
      run_on_pll(RCC_CFGR_PLL_HSE | RCC_CFGR_PLL_X3)) {
    RCC->CR |= RCC_CR_CSSON;
    return LED_CLOCK_CRYSTAL;
  }
  RCC->CFGR = 0;  // back to the internal oscillator if necessary
  RCC->CR &= ~(uint32_t)RCC_CR_HSEON;
  if (run_on_pll(RCC_CFGR_PLL_X6)) return LED_CLOCK_RC;
  RCC->CFGR = 0;
  return LED_CLOCK_RC_NO_PLL;
}

uint32_t clock_hz(enum led_clock clock) {
  return clock == LED_CLOCK_RC_NO_PLL ? 8000000 : 24000000;
}
