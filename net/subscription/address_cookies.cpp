#include "net/subscription/address_cookies.hpp"

#include <chrono>

namespace crepes {
namespace {

constexpr Duration kSlot = std::chrono::minutes{1};

std::uint64_t slot_of(Timestamp now) {
  return static_cast<std::uint64_t>(now.time_since_epoch() / kSlot);
}

/// 16 hexadecimal digits.
std::string text_of(std::uint64_t hash) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(hash >> shift) & 0xFU];
  return text;
}

}  // namespace

std::string AddressCookies::cookie_for(const Endpoint& client, Timestamp now) const {
  return text_of(keyed_hash(key_, client, slot_of(now)));
}

// The comparison is not constant-time. A cookie has 64 random bits and is valid for two minutes:
// timing over a network reveals too little.
bool AddressCookies::accepts(std::string_view cookie, const Endpoint& client, Timestamp now) const {
  const std::uint64_t slot = slot_of(now);
  return cookie == text_of(keyed_hash(key_, client, slot)) ||
         cookie == text_of(keyed_hash(key_, client, slot - 1));
}

bool AddressCookies::is_contained_in(std::string_view text, const Endpoint& client,
                                     Timestamp now) const {
  const std::uint64_t slot = slot_of(now);
  return text.find(text_of(keyed_hash(key_, client, slot))) != std::string_view::npos ||
         text.find(text_of(keyed_hash(key_, client, slot - 1))) != std::string_view::npos;
}

}  // namespace crepes
