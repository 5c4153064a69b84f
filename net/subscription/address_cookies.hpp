/// Cookies prove that a client receives what is sent to its address. The server stores no state
/// for them.
#pragma once

#include <string>
#include <string_view>

#include "estimator/core/time.hpp"
#include "net/endpoint.hpp"
#include "net/subscription/keyed_hash.hpp"

namespace crepes {

class AddressCookies {
 public:
  explicit AddressCookies(const HashKey& key) : key_(key) {}

  /// Valid for this address and port, for one to two minutes.
  [[nodiscard]] std::string cookie_for(const Endpoint& client, Timestamp now) const;
  [[nodiscard]] bool accepts(std::string_view cookie, const Endpoint& client, Timestamp now) const;
  /// Whether a valid cookie occurs anywhere in an unparsed datagram.
  [[nodiscard]] bool is_contained_in(std::string_view text, const Endpoint& client,
                                     Timestamp now) const;

 private:
  HashKey key_;
};

}  // namespace crepes
