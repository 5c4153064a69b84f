#include "firmware/led_board/chip_flash.h"

#include "firmware/led_board/stm32f1.h"

enum {
  FIRST_PAGE = 0x08004000,
  PAGE_STEP = 0x800,  // pages have 1 KiB or 2 KiB, depending on the chip
  KEY_1 = 0x45670123,
  PATIENCE = 400000,  // iterations of a loop; erasing needs a million cycles
};
static const uint32_t kKey2 = 0xCDEF89AB;

static uint32_t address_of(int page, size_t index) {
  return FIRST_PAGE + (uint32_t)page * PAGE_STEP + 2 * (uint32_t)index;
}

static void unlock(uint32_t operation) {
  FLASH->KEYR = KEY_1;
  FLASH->KEYR = kKey2;
  FLASH->SR = FLASH_SR_DONE_AND_FAILED;  // writing 1 clears a bit
  FLASH->CR = operation;
}

static void wait_and_lock(void) {
  for (int turn = 0; turn < PATIENCE && (FLASH->SR & FLASH_SR_BSY) != 0; ++turn) {
  }
  FLASH->CR = FLASH_CR_LOCK;
}

static void erase(void* context, int page) {
  (void)context;
  unlock(FLASH_CR_PER);
  FLASH->AR = address_of(page, 0);
  FLASH->CR = FLASH_CR_PER | FLASH_CR_STRT;
  wait_and_lock();
}

static void program(void* context, int page, size_t index, uint16_t value) {
  (void)context;
  unlock(FLASH_CR_PG);
  *(volatile uint16_t*)address_of(page, index) = value;
  wait_and_lock();
}

static uint16_t read(const void* context, int page, size_t index) {
  (void)context;
  return *(const volatile uint16_t*)address_of(page, index);
}

struct led_flash chip_flash(void) {
  const struct led_flash flash = {.erase = erase, .program = program, .read = read};
  return flash;
}
