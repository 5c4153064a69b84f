/// The LED board's flash in memory, with a power supply that can fail.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>

#include "firmware/led_board/flash.h"

namespace crepes {

class RamFlash {
 public:
  static constexpr std::size_t kHalfWords = 32;

  /// The `operations`-th operation from now on is torn: some of its bits take, others do not.
  /// Whatever follows does nothing. Reading works on. After 0 nothing works at once.
  void cut_power_after(std::size_t operations, unsigned seed) {
    operations_left_ = operations;
    random_.seed(seed);
  }
  void restore_power() { operations_left_ = std::numeric_limits<std::size_t>::max(); }

  [[nodiscard]] std::size_t operations() const { return operations_; }
  [[nodiscard]] bool is_misused() const { return is_misused_; }
  [[nodiscard]] std::uint16_t& at(int page, std::size_t index) {
    return pages_.at(static_cast<std::size_t>(page)).at(index);
  }

  /// What the firmware sees of it; must not outlive this.
  [[nodiscard]] led_flash port() {
    return {this, [](void* self, int page) { static_cast<RamFlash*>(self)->erase(page); },
            [](void* self, int page, std::size_t index, std::uint16_t value) {
              static_cast<RamFlash*>(self)->program(page, index, value);
            },
            [](const void* self, int page, std::size_t index) {
              return static_cast<const RamFlash*>(self)
                  ->pages_.at(static_cast<std::size_t>(page))
                  .at(index);
            }};
  }

 private:
  static constexpr std::uint16_t kErased = 0xFFFF;

  using Page = std::array<std::uint16_t, kHalfWords>;

  static Page erased() {
    Page page{};
    page.fill(kErased);
    return page;
  }

  /// The bits that an operation changes.
  std::uint16_t reach() {
    ++operations_;
    if (operations_left_ == 0) return 0;
    if (--operations_left_ > 0) return kErased;
    return static_cast<std::uint16_t>(random_());
  }

  void erase(int page) {
    const bool is_torn = operations_left_ == 1;
    std::uint16_t bits = reach();
    for (std::size_t i = 0; i < kHalfWords; ++i) {
      at(page, i) |= bits;
      if (is_torn) bits = static_cast<std::uint16_t>(random_());
    }
  }

  void program(int page, std::size_t index, std::uint16_t value) {
    if (operations_left_ > 0 && at(page, index) != kErased) is_misused_ = true;
    at(page, index) &= static_cast<std::uint16_t>(value | ~reach());
  }

  std::array<Page, LED_FLASH_PAGES> pages_{erased(), erased()};
  std::size_t operations_left_ = std::numeric_limits<std::size_t>::max();
  std::size_t operations_ = 0;
  bool is_misused_ = false;
  std::mt19937 random_;
};

}  // namespace crepes
