/// Cookies: who can echo one receives what is sent to its address. Nothing is kept for them.
#pragma once

#include <string>
#include <string_view>

#include "estimator/core/time.hpp"
#include "net/endpoint.hpp"
#include "net/keyed_hash.hpp"

namespace crepes {

class CookieMint {
 public:
  explicit CookieMint(const HashKey& key) : key_(key) {}

  /// Good for this address and port, for one to two minutes.
  [[nodiscard]] std::string cookie_for(const Endpoint& client, Timestamp now) const;
  [[nodiscard]] bool accepts(std::string_view cookie, const Endpoint& client, Timestamp now) const;
  /// Whether it stands anywhere in a text that nobody has parsed yet.
  [[nodiscard]] bool is_in(std::string_view text, const Endpoint& client, Timestamp now) const;

 private:
  HashKey key_;
};

}  // namespace crepes
