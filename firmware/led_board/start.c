/// From reset to main: vectors, initial memory. Unexpected exceptions reset the chip.
#include <stddef.h>

#include "firmware/led_board/stm32f1.h"

extern uint32_t data_begin[], data_end[], data_image[], bss_begin[], bss_end[], stack_top[];

int main(void);
void systick_handler(void);
void usart1_handler(void);

void reset_handler(void);

/// A fault, an unexpected interrupt, or (NMI) a crystal that has stopped.
static void start_over(void) {
  SCB_AIRCR = 0x05FA0004;
  for (;;) {
  }
}

typedef void (*handler)(void);

struct vectors {
  uint32_t* stack;
  handler reset, nmi, faults[12], systick;
  handler interrupts[61];
};

__attribute__((section(".vectors"), used)) static const struct vectors kVectors = {
    .stack = stack_top,
    .reset = reset_handler,
    .nmi = start_over,
    .faults = {[0 ... 11] = start_over},
    .systick = systick_handler,
    .interrupts = {[0 ... USART1_IRQ - 1] = start_over,
                   [USART1_IRQ] = usart1_handler,
                   [USART1_IRQ + 1 ... 60] = start_over},
};

void reset_handler(void) {
  const uint32_t* from = data_image;
  for (uint32_t* to = data_begin; to < data_end; ++to) *to = *from++;
  for (uint32_t* to = bss_begin; to < bss_end; ++to) *to = 0;
  // After the boot loader, address 0 is still its own ROM.
  SCB_VTOR = (uint32_t)&kVectors;
  main();
}

// The compiler calls these to copy and clear structures.
void* memcpy(void* to, const void* from, size_t size);
void* memset(void* to, int value, size_t size);

void* memcpy(void* to, const void* from, size_t size) {
  for (size_t i = 0; i < size; ++i) ((uint8_t*)to)[i] = ((const uint8_t*)from)[i];
  return to;
}

void* memset(void* to, int value, size_t size) {
  for (size_t i = 0; i < size; ++i) ((uint8_t*)to)[i] = (uint8_t)value;
  return to;
}
