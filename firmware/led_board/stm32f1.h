/// The registers of an STM32F100 or F103 that this board uses (ST RM0008, RM0041; ARM PM0056).
#ifndef CREPES_FIRMWARE_LED_BOARD_STM32F1_H
#define CREPES_FIRMWARE_LED_BOARD_STM32F1_H

#include <stdint.h>

typedef volatile uint32_t reg32;

/// The registers of the clocks.
struct rcc {
  reg32 CR, CFGR, CIR, APB2RSTR, APB1RSTR, AHBENR, APB2ENR, APB1ENR, BDCR, CSR;
};
/// The registers of the flash memory.
struct flash_interface {
  reg32 ACR, KEYR, OPTKEYR, SR, CR, AR;
};
/// The registers of a port.
struct gpio {
  reg32 CRL, CRH, IDR, ODR, BSRR, BRR;
};
/// The registers of a serial port.
struct usart {
  reg32 SR, DR, BRR, CR1, CR2, CR3;
};
/// The registers of a timer.
struct timer {
  reg32 CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR, RCR, CCR[4];
};
/// The registers of the watchdog.
struct watchdog {
  reg32 KR, PR, RLR, SR;
};
/// The registers of the processor's timer.
struct systick {
  reg32 CTRL, LOAD, VAL;
};

#define TIM2 ((struct timer*)0x40000000)
#define TIM3 ((struct timer*)0x40000400)
#define IWDG ((struct watchdog*)0x40003000)
#define GPIOA ((struct gpio*)0x40010800)
#define USART1 ((struct usart*)0x40013800)
#define RCC ((struct rcc*)0x40021000)
#define FLASH ((struct flash_interface*)0x40022000)
#define SYSTICK ((struct systick*)0xE000E010)
#define NVIC_ISER ((reg32*)0xE000E100)
#define NVIC_IPR ((volatile uint8_t*)0xE000E400)
#define SCB_VTOR (*(reg32*)0xE000ED08)
#define SCB_AIRCR (*(reg32*)0xE000ED0C)

enum {
  RCC_CR_HSEON = 1 << 16,
  RCC_CR_HSERDY = 1 << 17,
  RCC_CR_CSSON = 1 << 19,
  RCC_CR_PLLON = 1 << 24,
  RCC_CR_PLLRDY = 1 << 25,
  RCC_CFGR_SW_PLL = 2,
  RCC_CFGR_SWS = 3 << 2,
  RCC_CFGR_SWS_PLL = 2 << 2,
  RCC_CFGR_PLL_HSE = 1 << 16,
  RCC_CFGR_PLL_X3 = 1 << 18,
  RCC_CFGR_PLL_X6 = 4 << 18,
  RCC_APB2ENR_IOPA = 1 << 2,
  RCC_APB2ENR_USART1 = 1 << 14,
  RCC_APB1ENR_TIM2 = 1 << 0,
  RCC_APB1ENR_TIM3 = 1 << 1,
  RCC_CSR_RMVF = 1 << 24,
  RCC_CSR_IWDGRSTF = 1 << 29,

  FLASH_SR_BSY = 1 << 0,
  FLASH_SR_DONE_AND_FAILED = 0x34,
  FLASH_CR_PG = 1 << 0,
  FLASH_CR_PER = 1 << 1,
  FLASH_CR_STRT = 1 << 6,
  FLASH_CR_LOCK = 1 << 7,

  USART_SR_RXNE = 1 << 5,
  USART_SR_TXE = 1 << 7,
  USART_CR1_RE = 1 << 2,
  USART_CR1_TE = 1 << 3,
  USART_CR1_RXNEIE = 1 << 5,
  USART_CR1_UE = 1 << 13,

  SYSTICK_ENABLE = 1 << 0,
  SYSTICK_INTERRUPT = 1 << 1,
  SYSTICK_CPU_CLOCK = 1 << 2,

  USART1_IRQ = 37,
};

static inline void interrupts_off(void) { __asm volatile("cpsid i" ::: "memory"); }
static inline void interrupts_on(void) { __asm volatile("cpsie i" ::: "memory"); }
static inline void wait_for_interrupt(void) { __asm volatile("wfi" ::: "memory"); }

#endif
