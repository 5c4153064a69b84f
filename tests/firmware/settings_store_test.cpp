#include "firmware/led_board/settings_store.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/led_settings.hpp"
#include "tests/support/ram_flash.hpp"

namespace crepes::settings_store_test {
namespace {

const led_settings kOld = pattern_settings(3, "00100100111100111111");
const led_settings kNew = duty_settings(64, 333, 667);

led_settings loaded(RamFlash& flash) {
  const led_flash port = flash.port();
  return led_settings_load(&port);
}

bool save(RamFlash& flash, const led_settings& settings) {
  const led_flash port = flash.port();
  return led_settings_save(&port, &settings);
}

TEST(SettingsStore, IsUnsetWhenNothingWasEverSaved) {
  RamFlash flash;

  EXPECT_EQ(bytes_of(loaded(flash)), bytes_of(led_settings_unset()));
}

TEST(SettingsStore, ReturnsWhatWasSavedLast) {
  RamFlash flash;
  for (std::uint16_t id = 1; id < 1000; ++id) {
    ASSERT_TRUE(save(flash, pattern_settings(id, "0100110111")));
    ASSERT_EQ(loaded(flash).robot_id, id);
  }
  EXPECT_FALSE(flash.is_misused());
}

TEST(SettingsStore, APowerCutAtAnyMomentLeavesTheOldOrTheNewSettings) {
  // Enough saves for both pages to be in use, or one, or none.
  for (int saves_before = 0; saves_before < 4; ++saves_before) {
    RamFlash before;
    for (int i = 0; i < saves_before; ++i) ASSERT_TRUE(save(before, kOld));
    RamFlash undisturbed = before;
    ASSERT_TRUE(save(undisturbed, kNew));
    const auto old = bytes_of(saves_before > 0 ? kOld : led_settings_unset());
    const std::size_t operations = undisturbed.operations() - before.operations();
    ASSERT_GT(operations, 10U);

    for (std::size_t cut = 1; cut <= operations; ++cut)
      for (unsigned seed = 0; seed < 50; ++seed) {
        RamFlash flash = before;
        flash.cut_power_after(cut, seed);
        const bool is_saved = save(flash, kNew);
        flash.restore_power();

        const auto found = bytes_of(loaded(flash));
        ASSERT_TRUE(found == old || found == bytes_of(kNew)) << "cut at " << cut;
        ASSERT_EQ(is_saved, found == bytes_of(kNew)) << "cut at " << cut;
        ASSERT_TRUE(save(flash, kNew)) << "after a cut at " << cut;
        ASSERT_EQ(bytes_of(loaded(flash)), bytes_of(kNew));
        ASSERT_FALSE(flash.is_misused());
      }
  }
}

TEST(SettingsStore, ABitThatFlipsInOneCopyBringsBackTheOther) {
  RamFlash whole;
  ASSERT_TRUE(save(whole, kOld));  // page 0
  ASSERT_TRUE(save(whole, kNew));  // page 1
  int recovered = 0;
  for (std::size_t index = 0; index < RamFlash::kHalfWords; ++index)
    for (unsigned bit = 0; bit < 16; ++bit) {
      RamFlash flash = whole;
      flash.at(1, index) ^= static_cast<std::uint16_t>(1U << bit);

      const auto found = bytes_of(loaded(flash));
      ASSERT_TRUE(found == bytes_of(kOld) || found == bytes_of(kNew));
      recovered += found == bytes_of(kOld) ? 1 : 0;
    }
  EXPECT_EQ(recovered, 13 * 16) << "all bits of a record count, and no others";
}

TEST(SettingsStore, ReportsWhenFlashDoesNotHoldTheSettings) {
  RamFlash flash;
  ASSERT_TRUE(save(flash, kOld));
  flash.cut_power_after(0, 1);

  EXPECT_FALSE(save(flash, kNew));
  EXPECT_EQ(bytes_of(loaded(flash)), bytes_of(kOld));
}

}  // namespace
}  // namespace crepes::settings_store_test
