#include "firmware/led_board/serial_line.h"

#include "firmware/led_board/stm32f1.h"
#include "firmware/protocol/led_frame.h"

enum {
  KEPT = 64,          // a power of two
  PATIENCE = 20000,   // iterations of a loop; a byte needs 2083 cycles
  PRIORITY = 0x80,    // below SysTick's 0
  PINS = 0x44444894,  // PA9 USART output, PA10 input with pull-up; other pins as after reset
};

// The interrupt writes `in`, the main loop writes `out`.
static struct {
  volatile uint8_t bytes[KEPT];
  volatile uint8_t in;
  volatile uint8_t out;
} received;

void usart1_handler(void);

void usart1_handler(void) {
  // Reading SR, then DR, also clears an overrun.
  if ((USART1->SR & USART_SR_RXNE) == 0) {
    (void)USART1->DR;
    return;
  }
  const uint8_t byte = (uint8_t)USART1->DR;
  const uint8_t next = (uint8_t)((received.in + 1) % KEPT);
  if (next == received.out) return;
  received.bytes[received.in] = byte;
  received.in = next;
}

void serial_line_start(uint32_t cpu_hz) {
  RCC->APB2ENR |= RCC_APB2ENR_IOPA | RCC_APB2ENR_USART1;
  GPIOA->BSRR = 1 << 10;
  GPIOA->CRH = PINS;
  USART1->BRR = (cpu_hz + LED_BAUD / 2) / LED_BAUD;
  USART1->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
  NVIC_IPR[USART1_IRQ] = PRIORITY;
  NVIC_ISER[USART1_IRQ / 32] = 1U << USART1_IRQ % 32;
}

bool serial_line_read(uint8_t* byte) {
  const uint8_t out = received.out;
  if (out == received.in) return false;
  *byte = received.bytes[out];
  received.out = (uint8_t)((out + 1) % KEPT);
  return true;
}

void serial_line_write(const uint8_t* bytes, size_t size) {
  for (size_t i = 0; i < size; ++i) {
    for (int turn = 0; (USART1->SR & USART_SR_TXE) == 0; ++turn)
      if (turn == PATIENCE) return;
    USART1->DR = bytes[i];
  }
}
