/// Requests to an LED board and its replies: one reply to each request.
#ifndef CREPES_FIRMWARE_PROTOCOL_LED_MESSAGES_H
#define CREPES_FIRMWARE_PROTOCOL_LED_MESSAGES_H

#include "firmware/protocol/led_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  LED_COUNT = 6,
  LED_TICK_US = 100,  ///< all times of a pattern are multiples of this
  LED_PROTOCOL_VERSION = 1,
  LED_SETTINGS_SIZE = 17,
  LED_STATUS_SIZE = 8,
  LED_TEST_MAX_MS = 60000,
};

/// The types of messages.
enum led_message {
  LED_GET = 0x01,   ///< no payload -> LED_SETTINGS
  LED_SET = 0x02,   ///< struct led_settings -> LED_SETTINGS as stored, or LED_REFUSED
  LED_TEST = 0x03,  ///< u16 ms of steady light, 0 ends it -> LED_DONE, or LED_REFUSED
  LED_ASK = 0x04,   ///< no payload -> LED_STATUS
  LED_SETTINGS = 0x81,
  LED_DONE = 0x83,
  LED_STATUS = 0x84,
  LED_REFUSED = 0x8F,  ///< u8 type of the request, u8 enum led_fault
};

/// Why a request was refused.
enum led_fault {
  LED_FINE,
  LED_BAD_REQUEST,     ///< unknown type, or a payload of another size
  LED_BAD_ID,          ///< not 1 to 65534
  LED_BAD_PATTERN,     ///< not 8 to 32 slots (2 for a duty code), all lit, all dark, or longer
  LED_BAD_TIME,        ///< see struct led_settings
  LED_BAD_BRIGHTNESS,  ///< over 100
  LED_BAD_FLASH,       ///< the settings could not be stored; the old ones remain
  LED_FAULT_COUNT,
};

/// How a board blinks: slot i of a period is lit when bit i of `pattern` is set, for lit_ticks,
/// and dark for dark_ticks otherwise.
///
/// A pattern has 8 to 32 slots of lit_ticks = dark_ticks, 2 to 70 ms. A duty code has two, the
/// first of them lit, each at least 0.5 ms and together 10 to 200 ms.
struct led_settings {
  uint16_t robot_id;  ///< 1 to 65534; 0: never set, the board stays dark
  uint8_t slots;
  uint32_t pattern;
  uint16_t lit_ticks;
  uint16_t dark_ticks;
  uint8_t brightness[LED_COUNT];  ///< percent
};

/// The answer to LED_ASK.
struct led_status {
  uint8_t protocol;
  uint8_t version[3];    ///< of the firmware
  uint8_t clock;         ///< enum led_clock
  uint8_t was_watchdog;  ///< the watchdog ended the last run
  uint16_t skipped;      ///< received bytes outside frames
};

/// What drives the clock of the board.
enum led_clock {
  LED_CLOCK_CRYSTAL,    ///< 24 MHz from the crystal
  LED_CLOCK_RC,         ///< 24 MHz from the internal oscillator, typically 1 % off, up to 3 %
  LED_CLOCK_RC_NO_PLL,  ///< 8 MHz from the internal oscillator
};

enum led_fault led_settings_fault(const struct led_settings* settings);

/// Settings of a new board: dark, but a test lights it up.
struct led_settings led_settings_unset(void);

void led_settings_write(const struct led_settings* settings, uint8_t out[LED_SETTINGS_SIZE]);
struct led_settings led_settings_read(const uint8_t bytes[LED_SETTINGS_SIZE]);
void led_status_write(const struct led_status* status, uint8_t out[LED_STATUS_SIZE]);
struct led_status led_status_read(const uint8_t bytes[LED_STATUS_SIZE]);

#ifdef __cplusplus
}
#endif

#endif
