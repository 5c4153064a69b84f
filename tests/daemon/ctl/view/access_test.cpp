#include "daemon/ctl/view/access.hpp"

#include <gtest/gtest.h>

#include "daemon/ctl/view/listen_address.hpp"

namespace crepes::access_test {
namespace {

const AccessPolicy kOpen{.token = "", .names = {"robot1", "robot1.local"}};
const AccessPolicy kClosed{.token = "0123456789abcdef", .names = {"robot1"}};

HttpRequest request_to(const std::string& host) {
  return {.is_get = true, .is_post = false, .path = "/robots", .query = "", .host = host};
}

int status_of(const HttpRequest& request, const AccessPolicy& policy,
              Access access = Access::kData) {
  const auto refusal = refusal_of(request, policy, access);
  return refusal ? refusal->status : 200;
}

TEST(Access, AcceptsNumbersAndTheMachinesOwnNames) {
  for (const char* host : {"127.0.0.1:8080", "[::1]:8080", "localhost:8080", "LocalHost",
                           "192.168.1.7:8080", "robot1:8080", "Robot1.local:8080"})
    EXPECT_EQ(status_of(request_to(host), kOpen), 200) << host;
}

TEST(Access, RefusesNamesThatMayHaveBeenRebound) {
  for (const char* host : {"evil.example:8080", "127.0.0.1.evil.example", "robot1.evil.example", "",
                           "[::1", "localhost.evil.example:8080", "[evil.example]:8080"})
    EXPECT_EQ(status_of(request_to(host), kOpen), 421) << host;
}

TEST(Access, RefusesPagesOfAnotherOrigin) {
  HttpRequest request = request_to("127.0.0.1:8080");
  request.origin = "http://127.0.0.1:8080";
  EXPECT_EQ(status_of(request, kOpen), 200);

  for (const char* origin : {"http://evil.example", "http://127.0.0.1:9090", "null",
                             "https://127.0.0.1:8080", "http://127.0.0.1:8080.evil.example"}) {
    request.origin = origin;
    EXPECT_EQ(status_of(request, kOpen), 403) << origin;
  }
}

TEST(Access, ActionsAreFromItsOwnPageOnly) {
  HttpRequest request = request_to("127.0.0.1:8080");
  request.origin = "http://127.0.0.1:8080";
  EXPECT_EQ(status_of(request, kOpen, Access::kAction), 405);
  request.is_get = false;
  request.is_post = true;
  EXPECT_EQ(status_of(request, kOpen, Access::kAction), 200);
  EXPECT_EQ(status_of(request, kOpen, Access::kData), 405);
  EXPECT_EQ(status_of(request, kClosed, Access::kAction), 401);

  for (const char* origin : {"", "null", "http://evil.example"}) {
    request.origin = origin;
    EXPECT_EQ(status_of(request, kOpen, Access::kAction), 403) << origin;
  }
}

TEST(Access, RequiresTheTokenForDataOnly) {
  HttpRequest request = request_to("10.0.0.2:8080");
  EXPECT_EQ(status_of(request, kClosed), 401);
  EXPECT_EQ(status_of(request, kClosed, Access::kFile), 200);

  for (const char* wrong :
       {"Bearer ", "Bearer 0123456789abcdeF", "Bearer 0123456789abcde", "Bearer 0123456789abcdef0",
        "Basic 0123456789abcdef", "0123456789abcdef"}) {
    request.authorization = wrong;
    EXPECT_EQ(status_of(request, kClosed), 401) << wrong;
  }
  request.authorization = "Bearer 0123456789abcdef";
  EXPECT_EQ(status_of(request, kClosed), 200);
}

TEST(Access, AnswersGetOnly) {
  HttpRequest request = request_to("127.0.0.1:8080");
  request.is_get = false;
  EXPECT_EQ(status_of(request, kOpen), 405);
}

TEST(Access, DrawsTokensThatDiffer) {
  const std::string token = random_token().value();
  EXPECT_EQ(token.size(), 32U);
  EXPECT_NE(token, random_token().value());
}

TEST(ListenAddress, ReadsNumbersOfBothFamilies) {
  EXPECT_EQ(parse_address("127.0.0.1:8080", 1)->port, 8080);
  EXPECT_EQ(parse_address("[::1]:80", 1)->address, "::1");
  EXPECT_EQ(parse_address("127.0.0.1:0", 0)->port, 0);
}

TEST(ListenAddress, RefusesWhatIsNotANumericAddressAndAPort) {
  for (const char* text : {"", "127.0.0.1", ":8080", "localhost:8080", "::1:8080", "[::1]",
                           "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:80x", "127.0.0.1:-1"})
    EXPECT_FALSE(parse_address(text, 1)) << text;
}

TEST(ListenAddress, PutsIpv6IntoBracketsInAUrl) {
  EXPECT_EQ(authority_of("::1", 80), "[::1]:80");
  EXPECT_EQ(authority_of("127.0.0.1", 8080), "127.0.0.1:8080");
}

}  // namespace
}  // namespace crepes::access_test
