#include "daemon/ctl/view/access.hpp"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "net/endpoint.hpp"

namespace crepes {
namespace {

constexpr int kMethodNotAllowed = 405;
constexpr int kStatusForbidden = 403;
constexpr int kUnauthorized = 401;
constexpr int kMisdirected = 421;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Without the port: "[::1]:8080" is "::1".
std::string name_in(const std::string& host) {
  if (!host.starts_with('[')) return host.substr(0, host.find(':'));
  const std::size_t end = host.find(']');
  return end == std::string::npos ? std::string() : host.substr(1, end - 1);
}

/// A browser that was led here by a rebound name sends that name. A number cannot be rebound.
bool is_own_host(const std::string& host, const AccessPolicy& policy) {
  const std::string name = name_in(lower(host));
  if (name == "localhost" || Endpoint::parse(name, 1)) return true;
  return std::ranges::find(policy.names, name) != policy.names.end();
}

HttpReply refused(int status, std::string why) {
  return {.status = status, .body = std::move(why)};
}

}  // namespace

bool equals_in_constant_time(std::string_view a, std::string_view b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::optional<HttpReply> refusal_of(const HttpRequest& request, const AccessPolicy& policy,
                                    Access access) {
  const bool is_action = access == Access::kAction;
  if (is_action ? !request.is_post : !request.is_get)
    return refused(kMethodNotAllowed, is_action ? "only POST\n" : "only GET\n");
  if (!is_own_host(request.host, policy))
    return refused(kMisdirected, "this Host is not of this machine: use its address\n");
  if (is_action && request.origin.empty()) return refused(kStatusForbidden, "without an Origin\n");
  if (!request.origin.empty() && lower(request.origin) != "http://" + lower(request.host))
    return refused(kStatusForbidden, "not for pages of another origin\n");
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view sent = request.authorization;
  const bool is_known = sent.starts_with(kScheme) &&
                        equals_in_constant_time(sent.substr(kScheme.size()), policy.token);
  if (access != Access::kFile && !policy.token.empty() && !is_known)
    return refused(kUnauthorized, "a token is required: open the address that was printed\n");
  return std::nullopt;
}

Result<std::string> random_token() {
  if (sodium_init() < 0) return fail(ErrorCode::kIo, "libsodium: cannot be started");
  std::array<unsigned char, 16> bits{};
  randombytes_buf(bits.data(), bits.size());
  std::array<char, 2 * bits.size() + 1> text{};
  sodium_bin2hex(text.data(), text.size(), bits.data(), bits.size());
  return std::string(text.data());
}

}  // namespace crepes
