/// Who may read the page and its data. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/ctl/view/http_message.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The addresses, names and rights of a page.
struct AccessPolicy {
  std::string token;               ///< required for data; empty: none is required
  std::vector<std::string> names;  ///< of this machine, in lower case
};

/// What a path leads to.
enum class Access { kFile, kData, kAction };

/// Why a request is refused; empty if it is not. A foreign Host means a name that was rebound to
/// this address (DNS rebinding), a foreign Origin a page of another site. Only data need the token:
/// the page's own files hold no secret, and it is the page that sends the token. An action changes
/// something: it is a POST, which browsers send with an Origin, and only with it.
[[nodiscard]] std::optional<HttpReply> refusal_of(const HttpRequest& request,
                                                  const AccessPolicy& policy, Access access);

/// Compares in a time that depends on the lengths only.
[[nodiscard]] bool equals_in_constant_time(std::string_view a, std::string_view b);

/// 128 random bits as 32 hexadecimal digits.
[[nodiscard]] Result<std::string> random_token();

}  // namespace crepes
